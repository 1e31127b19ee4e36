//! Agreement when what is heard is late (section 4.4, Lemma 4.4).

use super::disagreement::Disagreement;
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// The gain is shared among those heard, so that delay slows every vehicle alike: the fleet agrees and travels at
/// v_L* = v_L/(1 + kτ). It requires that no vehicle is ever alone; otherwise use
/// [`DelayedAlone`](super::delayed_4_42::DelayedAlone).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delayed {
    k: f64,
}

impl Delayed {
    /// `k` > 0 \[1/s\], the sum of the gains of one vehicle.
    pub fn new(k: f64) -> Result<Delayed, String> {
        Ok(Delayed { k: positive("the gain k", k)? })
    }
}

impl CoordinationLaw for Delayed {
    /// v_r = v_L − k_i Σ (γ_i(t) − γ_j(t − τ)) (4.34) with k_i = k/|N_i| (Lemma 4.4; erratum 4.2: a constant k_i
    /// leaves a coordination error); v_L when N_i is empty.
    fn demand(&self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        Demand::Rate(reference.v_l - self.k * Disagreement::among(own, neighbours).mean_ahead())
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }
}

#[cfg(test)]
mod tests {
    use super::Delayed;
    use crate::coordination::ideal_fleet::{
        Fleet, Network, PAIR, STAR, assert_shift_invariant_and_ahead_slows_down as assert_sane,
    };
    use crate::coordination::switching_4_21::Switching;
    use crate::coordination::{CoordinationLaw, Demand, Own, SpeedReference};

    const SECTION_4_6: Network<'_, 3> = Network { hears: STAR, r: [1.0; 3], v_l: 0.5 };
    const START: Fleet<3> = Fleet { xi: [10.0, 4.0, 0.0], eta: [0.0; 3] };

    #[test]
    fn two_vehicles_without_delay_in_closed_form() {
        let network = Network { hears: PAIR, r: [1.0; 2], v_l: 0.5 };
        let end = network.run(&Delayed::new(0.3).unwrap(), Fleet::at([1.0, 0.0]), 4.0, 0.01);
        assert!((end.xi[0] - end.xi[1] - (-0.6f64 * 4.0).exp()).abs() < 1e-9);
    }

    #[test]
    fn the_star_agrees_and_travels_at_v_l_star() {
        let (end, speeds) = SECTION_4_6.run_delayed(&Delayed::new(0.1).unwrap(), START, 400.0, 5.0, 0.05);
        assert!(end.spread() < 1e-6, "{end:?}");
        for speed in speeds {
            assert!((speed - 0.5 / 1.5).abs() < 1e-3 * 0.5 / 1.5);
        }
    }

    #[test]
    fn a_gain_that_is_not_shared_leaves_an_error() {
        // Erratum 4.2. With d = γ₁ − γ₂ at speed c: c(1 + kτ) = v_L − kd at the tips, c(1 + 2kτ) = v_L + 2kd in
        // the middle; with k = 0.1, τ = 5, v_L = 0.5: d = 0.5, c = 0.3.
        let (end, speeds) = SECTION_4_6.run_delayed(&Switching::new(0.1).unwrap(), START, 600.0, 5.0, 0.05);
        assert!((end.xi[0] - end.xi[1] - 0.5).abs() < 1e-4, "{end:?}");
        assert!(speeds.iter().all(|speed| (speed - 0.3).abs() < 1e-4), "{speeds:?}");
    }

    #[test]
    fn alone_it_travels_at_v_l() {
        let own = Own { xi: 3.0, eta: 0.0, r: 1.0, ..Own::default() };
        let reference = SpeedReference { v_l: 0.5, v_l_dot: 0.0 };
        assert_eq!(Delayed::new(0.3).unwrap().demand(reference, &own, &[]), Demand::Rate(0.5));
    }

    #[test]
    fn it_is_sane() {
        assert_sane(&Delayed::new(0.3).unwrap());
        assert!(Delayed::new(0.0).is_err());
    }
}
