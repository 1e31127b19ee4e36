//! What a vehicle believes of another between two of its messages.

use super::rate::RateEstimate;
use crate::mission::file::Between;
use crate::time::Time;

/// How a belief moves on from what was said; the same for all vehicles of a mission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// What stands for a neighbour between its messages.
    pub between: Between,
    /// v_L*/v_L.
    pub nominal_factor: f64,
    /// The delay that the law was told \[s\]; zero if it was told none.
    pub law_delay: f64,
}

/// What one vehicle knows of another.
#[derive(Clone, Copy, Debug, Default)]
pub struct Belief {
    newest: Option<(Time, f64)>,
    rates: RateEstimate,
}

impl Belief {
    /// Takes what the other said: `xi`, made at `made`. Messages come in the order in which they were made.
    pub fn hear(&mut self, made: Time, xi: f64) {
        self.newest = Some((made, xi));
        self.rates.hear(made, xi);
    }

    /// What stands for the other's ξ in a law at `now`; `None` if nothing was heard of it.
    pub fn for_law(&self, model: &Model, now: Time, v_l: f64) -> Option<f64> {
        let (_, xi) = self.newest?;
        let moved = self.moved(model, now, v_l);
        Some(match model.between {
            // The law wants what was true a delay ago.
            Between::Align => xi + moved - model.nominal_factor * v_l * model.law_delay,
            _ => xi + moved,
        })
    }

    /// How far the other is from `xi` if it has moved as believed; infinite if nothing was heard of it.
    pub fn error(&self, model: &Model, now: Time, v_l: f64, xi: f64) -> f64 {
        self.newest.map_or(f64::INFINITY, |(_, said)| (xi - (said + self.moved(model, now, v_l))).abs())
    }

    /// How far the other has moved since its newest message was made, as believed.
    fn moved(&self, model: &Model, now: Time, v_l: f64) -> f64 {
        let Some((made, _)) = self.newest else { return 0.0 };
        let age = (now - made).secs();
        match model.between {
            Between::Hold => 0.0,
            Between::Advance => v_l * age,
            Between::Align => model.nominal_factor * v_l * age,
            Between::Estimate => self.rates.rate(v_l) * age,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Belief, Model};
    use crate::mission::file::Between;
    use crate::time::Time;

    fn model(between: Between) -> Model {
        Model { between, nominal_factor: 0.5, law_delay: 4.0 }
    }

    /// The belief at 20 s, with v_L = 0.5, in a vehicle that said 1 at 6 s and 4 at 16 s, and how wrong it is if that is at 4.5.
    fn believed(between: Between) -> (f64, f64) {
        let mut belief = Belief::default();
        belief.hear(Time::from_secs(6.0), 1.0);
        belief.hear(Time::from_secs(16.0), 4.0);
        let (model, now) = (model(between), Time::from_secs(20.0));
        (belief.for_law(&model, now, 0.5).expect("heard"), belief.error(&model, now, 0.5, 4.5))
    }

    #[test]
    fn each_model_is_what_it_says() {
        let close = |between, law: f64, error: f64| {
            let found = believed(between);
            assert!((found.0 - law).abs() < 1e-12 && (found.1 - error).abs() < 1e-12, "{between:?}: {found:?}");
        };
        close(Between::Hold, 4.0, 0.5);
        close(Between::Advance, 6.0, 1.5);
        close(Between::Estimate, 5.2, 0.7);
        // At v_L* = 0.25 for 4 s, less as much for the delay: γ_j(t − τ).
        close(Between::Align, 4.0, 0.5);
    }

    #[test]
    fn who_was_never_heard_is_infinitely_wrong() {
        let nothing = Belief::default();
        assert_eq!(nothing.for_law(&model(Between::Hold), Time::ZERO, 0.5), None);
        assert_eq!(nothing.error(&model(Between::Advance), Time::ZERO, 0.5, 0.0), f64::INFINITY);
    }
}
