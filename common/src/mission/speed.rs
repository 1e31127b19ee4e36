//! The formation speed over time: the profile of the mission file, overridden by commands under way.

use crate::coordination::SpeedReference;
use crate::time::Time;
use crate::wire::vehicle::SpeedCommand;

/// Most speed commands remembered in one mission; the oldest give way.
const MOST: usize = 1024;

/// A piecewise constant formation speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedProfile {
    /// In order of time, the first at or before zero.
    steps: Vec<SpeedCommand>,
}

impl SpeedProfile {
    /// From steps in order of time.
    pub fn new(steps: Vec<SpeedCommand>) -> SpeedProfile {
        SpeedProfile { steps }
    }

    /// The steps, in order of time.
    pub fn steps(&self) -> &[SpeedCommand] {
        &self.steps
    }

    /// A command given under way: replaces whatever the profile says from then on.
    pub fn command(&mut self, command: SpeedCommand) {
        self.steps.retain(|step| step.at < command.at);
        if self.steps.len() >= MOST {
            self.steps.remove(0);
        }
        self.steps.push(command);
    }

    /// v_L and its derivative at an instant. The derivative of a step is taken as zero.
    pub fn at(&self, t: Time) -> SpeedReference {
        let v_l = self.steps.iter().rev().find(|step| step.at <= t).or(self.steps.first()).map_or(0.0, |s| s.speed);
        SpeedReference { v_l, v_l_dot: 0.0 }
    }

    /// ∫ v_L dt from zero to `t`: how far the formation should have come.
    pub fn distance(&self, t: Time) -> f64 {
        let mut sum = 0.0;
        for (i, step) in self.steps.iter().enumerate() {
            let from = step.at.max(Time::ZERO);
            let to = self.steps.get(i + 1).map_or(t, |next| next.at.min(t));
            if to > from {
                sum += step.speed * (to - from).secs();
            }
        }
        sum
    }

    /// Largest speed that it ever asks for, without sign.
    pub fn fastest(&self) -> f64 {
        self.steps.iter().map(|step| step.speed.abs()).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64, speed: f64) -> SpeedCommand {
        SpeedCommand { at: Time::from_secs(seconds), speed }
    }

    #[test]
    fn a_step_holds_from_its_instant_on() {
        let profile = SpeedProfile::new(vec![at(0.0, 0.5), at(10.0, 0.2)]);
        assert_eq!(profile.at(Time::from_secs(9.999)).v_l, 0.5);
        assert_eq!(profile.at(Time::from_secs(10.0)).v_l, 0.2);
        assert!((profile.distance(Time::from_secs(20.0)) - 7.0).abs() < 1e-12);
    }

    #[test]
    fn a_command_replaces_the_rest_of_the_profile() {
        let mut profile = SpeedProfile::new(vec![at(0.0, 0.5), at(10.0, 0.2)]);
        profile.command(at(5.0, 0.1));
        assert_eq!(profile.at(Time::from_secs(4.0)).v_l, 0.5);
        assert_eq!(profile.at(Time::from_secs(50.0)).v_l, 0.1);
    }
}
