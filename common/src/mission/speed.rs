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

    /// The profile of a flight in which these speeds were recorded: those that are not planned are commands.
    pub fn as_recorded(&self, recorded: &[SpeedCommand]) -> SpeedProfile {
        let mut commands: Vec<SpeedCommand> =
            recorded.iter().filter(|row| !self.steps.contains(row)).copied().collect();
        commands.sort_by_key(|command| command.at);
        let mut profile = self.clone();
        commands.into_iter().for_each(|command| profile.command(command));
        profile
    }

    /// The steps under way, after the start and before `end`, that ask for another speed than before: when, and by how much more.
    pub fn changes(&self, end: Time) -> Vec<(Time, f64)> {
        let pairs = self.steps.windows(2).map(|pair| (pair[1].at, pair[1].speed - pair[0].speed));
        pairs.filter(|(at, more)| *more != 0.0 && *at > Time::ZERO && *at < end).collect()
    }

    /// Since when the speed at `t` holds: zero, if it never changed under way.
    pub fn last_change(&self, t: Time) -> Time {
        self.changes(t).last().map_or(Time::ZERO, |(at, _)| *at)
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
    fn a_change_is_another_speed_under_way() {
        let profile = SpeedProfile::new(vec![at(-1.0, 0.1), at(0.0, 0.5), at(5.0, 0.5), at(10.0, 0.25), at(20.0, 0.5)]);
        let by_hand = [(Time::from_secs(10.0), -0.25), (Time::from_secs(20.0), 0.25)];
        assert_eq!(profile.changes(Time::from_secs(20.5)), by_hand);
        assert_eq!(profile.changes(Time::from_secs(20.0)), by_hand[..1], "at the end it changes nothing any more");
        assert_eq!(profile.last_change(Time::from_secs(20.0)), Time::from_secs(10.0));
        assert_eq!(profile.last_change(Time::from_secs(9.0)), Time::ZERO);
    }

    #[test]
    fn what_is_recorded_and_not_planned_is_a_command() {
        let profile = SpeedProfile::new(vec![at(0.0, 0.5), at(10.0, 0.2)]);
        assert_eq!(profile.as_recorded(profile.steps()), profile);
        // A command at 5 s replaces the step at 10 s, in whichever order rows come.
        let flown = profile.as_recorded(&[at(7.0, 0.3), at(0.0, 0.5), at(5.0, 0.1), at(10.0, 0.2)]);
        assert_eq!(flown.steps(), [at(0.0, 0.5), at(5.0, 0.1), at(7.0, 0.3)]);
    }

    #[test]
    fn a_command_replaces_the_rest_of_the_profile() {
        let mut profile = SpeedProfile::new(vec![at(0.0, 0.5), at(10.0, 0.2)]);
        profile.command(at(5.0, 0.1));
        assert_eq!(profile.at(Time::from_secs(4.0)).v_l, 0.5);
        assert_eq!(profile.at(Time::from_secs(50.0)).v_l, 0.1);
    }
}
