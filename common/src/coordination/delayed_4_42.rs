//! Agreement when what is heard is late and at times nothing is heard (section 4.4, Lemma 4.5).

use super::disagreement::Disagreement;
use super::{CoordinationLaw, Demand, DemandKind, Neighbour, Own, SpeedReference};
use crate::positive::{not_negative, positive};

/// As [`Delayed`](super::delayed_4_34::Delayed), and alone at the speed at which the others travel. The vehicles must
/// know the delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DelayedAlone {
    k: f64,
    tau: f64,
}

impl DelayedAlone {
    /// `k` > 0 \[1/s\], the sum of the gains of one vehicle; `tau` τ ≥ 0 \[s\], the delay of the network. Section 4.6
    /// has 0.1 and 5.
    pub fn new(k: f64, tau: f64) -> Result<DelayedAlone, String> {
        Ok(DelayedAlone { k: positive("the gain k", k)?, tau: not_negative("the delay tau", tau)? })
    }

    /// v_L* = v_L/(1 + kτ), the speed at which the fleet travels once it agrees (below (4.37)).
    #[doc(alias = "v_L*")]
    pub fn steady_speed(&self, v_l: f64) -> f64 {
        v_l / (1.0 + self.k * self.tau)
    }
}

impl CoordinationLaw for DelayedAlone {
    /// v_r = v_L − (k/|N_i|) Σ (γ_i(t) − γ_j(t − τ)), or v_L* when N_i is empty (4.42). The printed sign and the
    /// printed γ_j(t) in place of γ_i(t) would not lead to agreement (erratum 4.1).
    fn demand(&self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        let disagreement = Disagreement::among(own, neighbours);
        Demand::Rate(match disagreement.neighbours {
            0 => self.steady_speed(reference.v_l),
            _ => reference.v_l - self.k * disagreement.mean_ahead(),
        })
    }

    fn kind(&self) -> DemandKind {
        DemandKind::Rate
    }
}

#[cfg(test)]
mod tests {
    use super::DelayedAlone;
    use crate::coordination::delayed_4_34::Delayed;
    use crate::coordination::ideal_fleet::{
        Fleet, Network, STAR, assert_shift_invariant_and_ahead_slows_down as assert_sane, run_delayed_with,
    };
    use crate::coordination::{CoordinationLaw, Demand, Own, SpeedReference};

    const SECTION_4_6: Network<'_, 3> = Network { hears: STAR, r: [1.0; 3], v_l: 0.5 };
    const START: Fleet<3> = Fleet { xi: [79.517, 70.483, 65.596], eta: [0.0; 3] };
    const V_L_STAR: f64 = 0.5 / 1.5;

    fn law() -> DelayedAlone {
        DelayedAlone::new(0.1, 5.0).unwrap()
    }

    #[test]
    fn with_a_delay_line_the_fleet_agrees_and_travels_at_v_l_star() {
        let (end, speeds) = SECTION_4_6.run_delayed(&law(), START, 400.0, 5.0, 0.05);
        assert!(end.spread() < 1e-6, "{end:?}");
        assert!(speeds.iter().all(|speed| (speed - V_L_STAR).abs() < 1e-3 * V_L_STAR), "{speeds:?}");
    }

    /// Section 4.6: the links are up for t mod 10 in [7.5, 10) (erratum 4.23), and otherwise as in `cut`. The spread
    /// at the end, and the mean speed of the last 400 seconds.
    fn with_outages(law: &dyn CoordinationLaw, cut: [&[usize]; 3]) -> (f64, f64) {
        let cut = Network { hears: cut, ..SECTION_4_6 };
        let v_r = |t: f64, i: usize, now: &Fleet<3>, heard: &Fleet<3>| {
            let network = if t % 10.0 < 7.5 { &cut } else { &SECTION_4_6 };
            network.v_r(law, i, now, heard)
        };
        let after = |seconds| run_delayed_with(START, seconds, 5.0, 0.05, v_r).0;
        let (agreed, end) = (after(800.0), after(1200.0));
        (end.spread(), (end.xi[0] - agreed.xi[0]) / 400.0)
    }

    #[test]
    fn five_seconds_late_through_windows_of_two_and_a_half() {
        let (spread, speed) = with_outages(&law(), [&[], &[], &[]]);
        assert!(spread < 1e-3, "{spread}");
        assert!((speed - V_L_STAR).abs() < 1e-3 * V_L_STAR, "{speed}");
    }

    #[test]
    fn v_l_star_matters_when_one_vehicle_is_cut_off_alone() {
        // Erratum 4.24: with v_L in place of v_L*, cutting off one vehicle costs coordination.
        let first_alone: [&[usize]; 3] = [&[], &[2], &[1]];
        assert!(with_outages(&law(), first_alone).0 < 1e-3);
        let (spread, _) = with_outages(&Delayed::new(0.1).unwrap(), first_alone);
        assert!(spread > 3.0, "{spread}");
    }

    #[test]
    fn when_all_are_cut_off_together_it_costs_only_the_speed() {
        let (spread, speed) = with_outages(&Delayed::new(0.1).unwrap(), [&[], &[], &[]]);
        assert!(spread < 1e-3 && (speed - 0.4447).abs() < 1e-3, "{spread} {speed}");
    }

    #[test]
    fn as_printed_there_is_no_agreement() {
        // Erratum 4.1: v_L + k/|N_i| Σ (γ_j(t) − γ_j(t − τ)) does not see γ_i at all; the fleet keeps its errors
        // and travels at v_L/(1 − kτ) = 1.
        let start = Fleet::at([15.0, 5.0, 0.0]);
        let printed = |_: f64, i: usize, now: &Fleet<3>, heard: &Fleet<3>| {
            let change: f64 = STAR[i].iter().map(|&j| now.xi[j] - heard.xi[j]).sum();
            0.5 + 0.1 / STAR[i].len() as f64 * change
        };
        let (end, speeds) = run_delayed_with(start, 400.0, 5.0, 0.05, printed);
        assert!((end.xi[0] - end.xi[1] - 10.0).abs() < 1e-9 && (end.xi[1] - end.xi[2] - 5.0).abs() < 1e-9);
        assert!(speeds.iter().all(|speed| (speed - 1.0).abs() < 1e-3), "{speeds:?}");
    }

    #[test]
    fn alone_it_travels_at_v_l_star() {
        let own = Own { xi: 3.0, eta: 0.0, r: 1.0, ..Own::default() };
        let reference = SpeedReference { v_l: 0.5, v_l_dot: 0.0 };
        assert_eq!(law().demand(reference, &own, &[]), Demand::Rate(V_L_STAR));
        let prompt = DelayedAlone::new(0.1, 0.0).unwrap();
        assert_eq!(prompt.demand(reference, &own, &[]), Demand::Rate(0.5), "without delay v_L* is v_L");
    }

    #[test]
    fn it_is_sane() {
        assert_sane(&law());
        assert!(DelayedAlone::new(0.1, -1.0).is_err() && DelayedAlone::new(0.0, 1.0).is_err());
    }
}
