//! Without coordination: every vehicle by itself, for path following alone (Figures 2.4, 2.6 and 2.11).

use super::leader_follower_2_30::Leader;
use super::{Demand, DemandKind, FleetLaw, Neighbour, Own, SpeedReference, VehicleLaw};
use crate::positive::positive;

/// Every vehicle keeps its own speed R_i v_L, as the leader of (2.30) does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alone {
    a_1: f64,
}

impl Alone {
    /// `a_1` > 0 \[1/s\], the rate at which speeds come to R_i v_L.
    pub fn new(a_1: f64) -> Result<Alone, String> {
        Ok(Alone { a_1: positive("the gain a_1", a_1)? })
    }
}

impl FleetLaw for Alone {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, _: usize) -> Box<dyn VehicleLaw> {
        Box::new(Leader { a_1: self.a_1 })
    }
}

/// The same force for every vehicle: a square wave, first forward (Figure 2.6). Nobody minds v_L.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SquareWave {
    amplitude: f64,
    period: f64,
}

impl SquareWave {
    /// F/m is +`amplitude` \[m/s²\], positive, for the first half of each `period` \[s\], positive, and −`amplitude` for
    /// the second: speeds rise and fall by amplitude · period/2.
    pub fn new(amplitude: f64, period: f64) -> Result<SquareWave, String> {
        Ok(SquareWave { amplitude: positive("the amplitude", amplitude)?, period: positive("the period", period)? })
    }
}

impl FleetLaw for SquareWave {
    fn kind(&self) -> DemandKind {
        DemandKind::Acceleration
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        None
    }

    fn vehicle(&self, _: usize) -> Box<dyn VehicleLaw> {
        Box::new(Pulled { wave: *self, phase: 0.0 })
    }
}

/// A vehicle under the force.
#[derive(Debug)]
struct Pulled {
    wave: SquareWave,
    /// Time since the last rise of the force \[s\].
    phase: f64,
}

impl VehicleLaw for Pulled {
    fn demand(&mut self, _: SpeedReference, _: &Own, _: &[Neighbour]) -> Demand {
        let SquareWave { amplitude, period } = self.wave;
        // Half a period counted in control periods is reached up to rounding.
        let forward = self.phase < 0.5 * period - 1e-9 * period;
        Demand::Forward(if forward { amplitude } else { -amplitude })
    }

    fn advance(&mut self, dt: f64) {
        let phase = (self.phase + dt) % self.wave.period;
        self.phase = if self.wave.period - phase < 1e-9 * self.wave.period { 0.0 } else { phase };
    }
}

#[cfg(test)]
mod tests {
    use super::{Alone, SquareWave};
    use crate::coordination::{Demand, FleetLaw, Neighbour, Own, SpeedReference};

    #[test]
    fn the_wave_is_even_over_thousands_of_periods() {
        // Control periods of 0.02 and 0.1 s, of which the latter add up to less than half a wave or a whole one.
        for (period, dt, steps) in [(4.0, 0.02, 200), (1.6, 0.1, 16), (1.0, 0.1, 10)] {
            let mut law = SquareWave::new(0.05, period).unwrap().vehicle(0);
            let mut forward = 0;
            for step in 0..200_000 {
                let demand = law.demand(SpeedReference::default(), &Own::default(), &[]);
                let expected = if step % steps < steps / 2 { 0.05 } else { -0.05 };
                assert_eq!(demand, Demand::Forward(expected), "{period} {step}");
                forward += i32::from(expected > 0.0);
                law.advance(dt);
            }
            assert_eq!(forward, 100_000);
        }
        assert!(SquareWave::new(0.0, 1.0).is_err() && SquareWave::new(1.0, f64::NAN).is_err());
    }

    #[test]
    fn alone_everybody_is_a_leader() {
        let law = Alone::new(2.0).unwrap();
        let own = Own { v: 0.5, r: 2.0, ..Own::default() };
        let reference = SpeedReference { v_l: 0.1, v_l_dot: 0.0 };
        for i in 0..3 {
            let heard = [Neighbour { vehicle: 1, xi: 9.0, ..Neighbour::default() }];
            assert_eq!(law.vehicle(i).demand(reference, &own, &heard), Demand::Forward(-2.0 * (0.5 - 0.2)));
        }
        assert!(Alone::new(0.0).is_err());
    }
}
