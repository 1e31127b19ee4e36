//! Two vehicles on parallel lines, the thesis' first example (section 1.2).

use super::disagreement::Disagreement;
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::positive;

/// Each vehicle yields to the other in proportion to how far ahead it is; ξ is the distance along the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Introduction {
    a: f64,
}

impl Introduction {
    /// `a` a_i > 0 \[1/s\]: two vehicles agree at the rate a₁ + a₂; 0.2 in Figures 1.9 and 1.10.
    pub fn new(a: f64) -> Result<Introduction, String> {
        Ok(Introduction { a: positive("the gain a", a)? })
    }
}

impl CoordinationLaw for Introduction {
    /// ẋ_i = v_i = −a_i (x_i − x_j) + v_L (1.5); v_L while the other is silent.
    fn demand(&self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        Demand::Rate(-self.a * Disagreement::among(own, neighbours).ahead + reference.v_l)
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }
}

#[cfg(test)]
mod tests {
    use super::Introduction;
    use crate::coordination::ideal_fleet::{
        Fleet, Network, PAIR, assert_shift_invariant_and_ahead_slows_down as assert_sane,
    };

    const FIGURE_1_9: Network<'_, 2> = Network { hears: PAIR, r: [1.0; 2], v_l: 0.5 };

    #[test]
    fn the_error_decays_at_a_1_plus_a_2() {
        let law = Introduction::new(0.2).unwrap();
        let end = FIGURE_1_9.run(&law, Fleet::at([2.0, -1.0]), 5.0, 0.01);
        assert!((end.xi[0] - end.xi[1] - 3.0 * (-0.4f64 * 5.0).exp()).abs() < 1e-9);
        assert!((end.xi[0] + end.xi[1] - 1.0 - 2.0 * 0.5 * 5.0).abs() < 1e-9, "the mean travels at v_L");
    }

    #[test]
    fn heard_by_one_only_it_still_decays() {
        // Figure 1.10: each hears the other for a second, then both are silent for a second (erratum 1.4).
        let law = Introduction::new(0.2).unwrap();
        let mut fleet = Fleet::at([1.5, 0.5]);
        for _ in 0..10 {
            for hears in [[PAIR[0], &[]], [&[], PAIR[1]], [&[], &[]]] {
                fleet = Network { hears, ..FIGURE_1_9 }.run(&law, fleet, 1.0, 0.01);
            }
        }
        // e(3k) = e₀ exp(−0.4 k): the rate is (1 − 1/3)·0.2.
        assert!((fleet.xi[0] - fleet.xi[1] - (-4.0f64).exp()).abs() < 1e-9);
    }

    #[test]
    fn it_is_sane() {
        assert_sane(&Introduction::new(0.2).unwrap());
        assert!(Introduction::new(0.0).is_err());
    }
}
