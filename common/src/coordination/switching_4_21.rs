//! Agreement over a network whose links come and go (section 4.3).

use super::disagreement::Disagreement;
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// The rate of the virtual target yields in proportion to how far it is ahead of those heard now. For networks
/// without delay: with one, the gain must be shared among the neighbours as in
/// [`Delayed`](super::delayed_4_34::Delayed) (erratum 4.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switching {
    k: f64,
}

impl Switching {
    /// `k` k_i > 0 \[1/s\]: two vehicles agree at the rate k₁ + k₂.
    pub fn new(k: f64) -> Result<Switching, String> {
        Ok(Switching { k: positive("the gain k", k)? })
    }
}

impl CoordinationLaw for Switching {
    /// v_r = v_L − k_i Σ (γ_i − γ_j) (4.21); v_L when N_i is empty.
    fn demand(&self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        Demand::Rate(reference.v_l - self.k * Disagreement::among(own, neighbours).ahead)
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }
}

#[cfg(test)]
mod tests {
    use super::Switching;
    use crate::coordination::ideal_fleet::{
        Fleet, Network, PAIR, ROW_OF_FOUR, STAR, assert_shift_invariant_and_ahead_slows_down as assert_sane,
    };
    use crate::coordination::{CoordinationLaw, Demand, Own, SpeedReference};

    #[test]
    fn two_vehicles_in_closed_form() {
        let law = Switching::new(0.3).unwrap();
        let network = Network { hears: PAIR, r: [1.0, 5.0], v_l: 0.5 };
        let end = network.run(&law, Fleet::at([1.0, 0.0]), 4.0, 0.01);
        assert!((end.xi[0] - end.xi[1] - (-0.6f64 * 4.0).exp()).abs() < 1e-9, "whatever R is");
    }

    #[test]
    fn the_row_of_four_decays_at_least_at_its_algebraic_connectivity() {
        // λ₂ of a row of four is 2 − √2; the disagreement ‖γ − mean‖ is bounded by exp(−k λ₂ t).
        let network = Network { hears: ROW_OF_FOUR, r: [1.0; 4], v_l: 0.5 };
        let law = Switching::new(0.5).unwrap();
        let size = |fleet: &Fleet<4>| {
            let mean = fleet.xi.iter().sum::<f64>() / 4.0;
            fleet.xi.iter().map(|xi| (xi - mean).powi(2)).sum::<f64>().sqrt()
        };
        let start = Fleet::at([0.0, 1.0, -2.0, 3.0]);
        let bound = |t: f64| size(&start) * (-0.5 * (2.0 - 2f64.sqrt()) * t).exp();
        for t in [1.0, 5.0, 20.0] {
            let end = network.run(&law, start.clone(), t, 0.02);
            assert!(size(&end) <= bound(t) * (1.0 + 1e-6) && size(&end) > 0.1 * bound(t), "{t}");
        }
    }

    #[test]
    fn links_that_take_turns_suffice() {
        let law = Switching::new(0.5).unwrap();
        let mut fleet = Fleet::at([0.0, 1.0, -2.0]);
        for _ in 0..20 {
            for hears in [[STAR[0], &[0][..], &[]], [&[], &[2], STAR[2]], [&[], &[], &[]]] {
                fleet = Network { hears, r: [1.0; 3], v_l: 0.5 }.run(&law, fleet, 1.0, 0.05);
            }
        }
        assert!(fleet.spread() < 1e-3);
    }

    #[test]
    fn alone_it_travels_at_v_l() {
        let own = Own { xi: 3.0, eta: 0.0, r: 1.0, ..Own::default() };
        let reference = SpeedReference { v_l: 0.5, v_l_dot: 0.0 };
        assert_eq!(Switching::new(0.3).unwrap().demand(reference, &own, &[]), Demand::Rate(0.5));
    }

    #[test]
    fn it_is_sane() {
        assert_sane(&Switching::new(0.3).unwrap());
        assert!(Switching::new(f64::NAN).is_err());
    }
}
