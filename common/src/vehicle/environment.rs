//! What disturbs a vehicle: the water moves, instruments err, and an engine may be stuck (sections 2.4 and 2.5.3).
//!
//! | disturbance | what it does | who sees it |
//! |---|---|---|
//! | current c(t) = c₀ + c₁ sin(2π t/T + φ) | moves the vehicle by c on top of its own motion; speeds are through the water | the position |
//! | measurement noise | Gaussian, drawn anew at each control period | the laws, never the record |
//! | speed stuck at v₀ | the forward speed is v₀ whatever is commanded | everybody |
//!
//! [`Environment`] makes the [`Conditions`] of a control period out of its instant and its number alone, so that it does
//! not matter which periods were run. They are held over the period: no plant of this crate depends on where it is,
//! so that a current that is constant over a period adds c dt to the position, exactly.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::positive::{finite, not_negative, positive};
use crate::random::Stream;
use crate::time::Time;

/// What a vehicle is exposed to during one control period. The default is nothing at all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conditions {
    /// When the period begins.
    pub now: Time,
    /// Velocity of the water in the inertial frame \[m/s\].
    pub current: Option<Vector3<f64>>,
    /// The errors of the instruments at the period's instant.
    pub errors: Option<InstrumentErrors>,
    /// The speed at which the vehicle is stuck \[m/s\].
    pub stuck_speed: Option<f64>,
}

impl Conditions {
    /// How far the water carries a vehicle in `dt` seconds \[m\]; nothing where it stands still.
    pub fn drift(&self, dt: f64) -> Option<Vector3<f64>> {
        self.current.map(|current| current * dt)
    }
}

/// Measured minus true, of everything that a vehicle measures of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InstrumentErrors {
    /// Position in the inertial frame \[m\].
    pub position: Vector3<f64>,
    /// Heading \[rad\].
    pub heading: f64,
    /// Velocity along the body's axes \[m/s\]; planar vehicles measure the first, or the first two.
    pub velocity: Vector3<f64>,
    /// Turning rates about the body's axes \[rad/s\]; planar vehicles measure the third.
    pub spin: Vector3<f64>,
}

/// A current: constant, or with a slow sinusoid on top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Current {
    /// c₀ \[m/s\].
    pub mean: Vector3<f64>,
    /// The part that changes.
    pub tide: Option<Tide>,
}

/// c₁ sin(2π t/T + φ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tide {
    /// c₁ \[m/s\].
    pub amplitude: Vector3<f64>,
    /// T \[s\], positive.
    pub period: f64,
    /// φ \[rad\].
    pub phase: f64,
}

impl Current {
    /// c(t) \[m/s\].
    pub fn at(&self, now: Time) -> Vector3<f64> {
        match self.tide {
            Some(tide) => self.mean + tide.amplitude * (TAU * now.secs() / tide.period + tide.phase).sin(),
            None => self.mean,
        }
    }

    /// The current if it is made of numbers, otherwise what is wrong with it.
    pub fn checked(self) -> Result<Current, String> {
        self.mean.iter().try_for_each(|&x| finite("a current", x).map(drop))?;
        if let Some(tide) = self.tide {
            tide.amplitude.iter().try_for_each(|&x| finite("a tide", x).map(drop))?;
            positive("a tide's period", tide.period)?;
            finite("a tide's phase", tide.phase)?;
        }
        Ok(self)
    }
}

/// Standard deviations of the instruments' errors, none of them negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoiseLevels {
    /// Of each coordinate of the position \[m\].
    pub position: f64,
    /// Of the heading \[rad\].
    pub heading: f64,
    /// Of each measured component of the velocity \[m/s\].
    pub speed: f64,
    /// Of each measured turning rate \[rad/s\].
    pub turn_rate: f64,
}

impl NoiseLevels {
    /// The levels if none is negative, otherwise what is wrong with them.
    pub fn checked(self) -> Result<NoiseLevels, String> {
        not_negative("the noise of the position", self.position)?;
        not_negative("the noise of the heading", self.heading)?;
        not_negative("the noise of the speed", self.speed)?;
        not_negative("the noise of the turning rate", self.turn_rate)?;
        Ok(self)
    }

    /// The errors at control period `index`: a function of the stream's seed and name and of the index alone.
    fn sample(&self, stream: &mut Stream, index: u64) -> InstrumentErrors {
        // A level of zero draws nothing: it costs nothing, and the others keep their numbers.
        let mut three = |level: f64, first: u8| match level {
            0.0 => Vector3::zeros(),
            _ => Vector3::from_fn(|i, _| level * normal(stream, index, first + i as u8)),
        };
        InstrumentErrors {
            position: three(self.position, 0),
            velocity: three(self.speed, 3),
            spin: three(self.turn_rate, 6),
            heading: if self.heading == 0.0 { 0.0 } else { self.heading * normal(stream, index, 9) },
        }
    }
}

/// The `which`-th standard normal number of an index, by Box and Muller: two of them come from each pair of uniform
/// ones. There are four pairs in one place of the stream, so that an index takes two places.
fn normal(stream: &mut Stream, index: u64, which: u8) -> f64 {
    let (place, lane) = (2 * index + u64::from(which / 8), which % 8);
    let (first, second) = (stream.unit_at(place, lane & !1), stream.unit_at(place, lane | 1));
    // 1 − u lies in (0, 1], where the logarithm is finite.
    let radius = (-2.0 * (1.0 - first).ln()).sqrt();
    let (sin, cos) = (TAU * second).sin_cos();
    radius * if lane & 1 == 0 { cos } else { sin }
}

/// The forward speed is stuck for a while (section 2.5.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckSpeed {
    /// v₀ \[m/s\].
    pub speed: f64,
    /// The first instant of the failure.
    pub from: Time,
    /// The first instant after it.
    pub to: Time,
}

/// All that disturbs one vehicle in a mission. The default is nothing at all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbances {
    /// How the water moves.
    pub current: Option<Current>,
    /// How the instruments err.
    pub noise: Option<NoiseLevels>,
    /// When the speed is stuck.
    pub stuck: Option<StuckSpeed>,
}

/// What surrounds one vehicle during a flight.
#[derive(Clone, Debug)]
pub struct Environment {
    disturbances: Disturbances,
    stream: Stream,
}

impl Environment {
    /// The surroundings of the vehicle `id` in the run with this `seed`; `None` where nothing disturbs it.
    pub fn new(disturbances: Disturbances, seed: u64, id: &str) -> Option<Environment> {
        (disturbances != Disturbances::default())
            .then(|| Environment { disturbances, stream: Stream::new(seed, &format!("noise/{id}")) })
    }

    /// What the vehicle is exposed to in the control period number `index`, which begins at `now`.
    pub fn conditions(&mut self, now: Time, index: u64) -> Conditions {
        let Disturbances { current, noise, stuck } = self.disturbances;
        Conditions {
            now,
            current: current.map(|current| current.at(now)),
            errors: noise.map(|levels| levels.sample(&mut self.stream, index)),
            stuck_speed: stuck.filter(|stuck| stuck.from <= now && now < stuck.to).map(|stuck| stuck.speed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVELS: NoiseLevels = NoiseLevels { position: 0.5, heading: 0.02, speed: 0.1, turn_rate: 0.01 };

    fn environment(disturbances: Disturbances) -> Environment {
        Environment::new(disturbances, 7, "v1").expect("disturbed")
    }

    /// All ten numbers of a control period, each divided by its level.
    fn numbers(environment: &mut Environment, index: u64) -> Vec<f64> {
        let e = environment.conditions(Time::ZERO, index).errors.expect("noise");
        let parts = [(e.position, LEVELS.position), (e.velocity, LEVELS.speed), (e.spin, LEVELS.turn_rate)];
        let parts = parts.iter().flat_map(|(part, level)| part.iter().map(|x| x / level).collect::<Vec<_>>());
        parts.chain([e.heading / LEVELS.heading]).collect()
    }

    #[test]
    fn nothing_disturbs_by_default() {
        assert!(Environment::new(Disturbances::default(), 1, "v1").is_none());
        assert_eq!(Conditions::default().drift(1.0), None);
    }

    #[test]
    fn a_current_carries_a_vehicle_along_and_a_tide_turns() {
        let tide = Tide { amplitude: Vector3::new(0.0, 0.2, 0.0), period: 40.0, phase: 0.0 };
        let current = Current { mean: Vector3::new(0.1, 0.0, 0.0), tide: Some(tide) };
        let at = |t: f64| current.at(Time::from_secs(t));
        assert_eq!(at(0.0), Vector3::new(0.1, 0.0, 0.0));
        assert!((at(10.0) - Vector3::new(0.1, 0.2, 0.0)).norm() < 1e-15);
        assert!((at(30.0) - Vector3::new(0.1, -0.2, 0.0)).norm() < 1e-15);
        // φ = 30° at the start, a quarter turn 40/3 s later.
        let early = Current { tide: Some(Tide { phase: TAU / 12.0, ..tide }), ..current };
        assert!(
            (early.at(Time::ZERO).y - 0.1).abs() < 1e-15
                && (early.at(Time::from_secs(40.0 / 6.0)).y - 0.2).abs() < 1e-9
        );
        let mut environment = environment(Disturbances { current: Some(current), ..Disturbances::default() });
        let drift = environment.conditions(Time::from_secs(10.0), 100).drift(0.5).expect("flows");
        assert!((drift - Vector3::new(0.05, 0.1, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn the_speed_is_stuck_from_the_first_instant_to_before_the_last() {
        let stuck = StuckSpeed { speed: 0.25, from: Time::from_secs(10.0), to: Time::from_secs(60.0) };
        let mut environment = environment(Disturbances { stuck: Some(stuck), ..Disturbances::default() });
        let mut at = |t: f64| environment.conditions(Time::from_secs(t), 0).stuck_speed;
        assert_eq!([at(9.9), at(10.0), at(59.9), at(60.0)], [None, Some(0.25), Some(0.25), None]);
    }

    #[test]
    fn noise_is_a_function_of_seed_vehicle_and_period_alone() {
        let disturbances = Disturbances { noise: Some(LEVELS), ..Disturbances::default() };
        let mut one = environment(disturbances);
        let fifth = numbers(&mut one, 5);
        numbers(&mut one, 77);
        assert_eq!(numbers(&mut one, 5), fifth);
        assert_ne!(numbers(&mut one, 6), fifth);
        let other = |seed, id| numbers(&mut Environment::new(disturbances, seed, id).expect("noise"), 5);
        assert_eq!(other(7, "v1"), fifth);
        assert!(other(8, "v1") != fifth && other(7, "v2") != fifth);
    }

    #[test]
    fn no_number_is_used_twice() {
        let disturbances = Disturbances { noise: Some(LEVELS), ..Disturbances::default() };
        let mut one = environment(disturbances);
        let mut all: Vec<f64> = (0..200).flat_map(|index| numbers(&mut one, index)).map(f64::abs).collect();
        all.sort_by(f64::total_cmp);
        assert!(all.windows(2).all(|pair| pair[1] - pair[0] > 1e-12 * pair[1]), "a place of the stream is read twice");
    }

    #[test]
    fn a_quiet_instrument_leaves_the_numbers_of_the_others_alone() {
        let with = |levels| environment(Disturbances { noise: Some(levels), ..Disturbances::default() });
        let of = |levels| with(levels).conditions(Time::ZERO, 3).errors.expect("noise");
        let quiet = of(NoiseLevels { position: 0.0, ..LEVELS });
        assert_eq!(quiet, InstrumentErrors { position: Vector3::zeros(), ..of(LEVELS) });
        assert_eq!(of(NoiseLevels { heading: 0.0, ..LEVELS }), InstrumentErrors { heading: 0.0, ..of(LEVELS) });
    }

    #[test]
    fn noise_is_white_and_normal() {
        let mut environment = environment(Disturbances { noise: Some(LEVELS), ..Disturbances::default() });
        let periods = 20_000;
        let rows: Vec<Vec<f64>> = (0..periods).map(|index| numbers(&mut environment, index)).collect();
        let mean = |f: &dyn Fn(&[f64]) -> f64| rows.iter().map(|row| f(row)).sum::<f64>() / periods as f64;
        // Five standard deviations of the means of 2e4 samples; the fourth moment of a normal number is 3 ± √96.
        let close = |value: f64, expected: f64, deviation: f64| {
            (value - expected).abs() < 5.0 * deviation / (periods as f64).sqrt()
        };
        for i in 0..10 {
            assert!(close(mean(&|row| row[i]), 0.0, 1.0), "{i}");
            assert!(close(mean(&|row| row[i] * row[i]), 1.0, 2f64.sqrt()), "{i}");
            assert!(close(mean(&|row| row[i].powi(4)), 3.0, 96f64.sqrt()), "{i}");
            for j in 0..i {
                assert!(close(mean(&|row| row[i] * row[j]), 0.0, 1.0), "{i} {j}");
            }
        }
        let after: f64 = rows.windows(2).map(|pair| pair[0][0] * pair[1][0]).sum();
        assert!(close(after / periods as f64, 0.0, 1.0), "one period says nothing about the next");
    }

    #[test]
    fn what_is_no_disturbance_is_refused() {
        let still = Current { mean: Vector3::zeros(), tide: None };
        assert!(Current { mean: Vector3::repeat(f64::NAN), ..still }.checked().is_err());
        let tide = Tide { amplitude: Vector3::x(), period: 0.0, phase: 0.0 };
        assert!(Current { tide: Some(tide), ..still }.checked().is_err());
        assert!(NoiseLevels { speed: -1.0, ..LEVELS }.checked().is_err());
        assert!(still.checked().is_ok() && LEVELS.checked().is_ok());
    }
}
