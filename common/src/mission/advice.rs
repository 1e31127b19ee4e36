//! What a mission may do and a careful person would not: it flies, with a word beforehand.

use super::Mission;
use super::file::LawChoice;

impl Mission {
    /// What is allowed and hardly meant, in words.
    pub fn advice(&self) -> Vec<String> {
        let rate = self.sampled_step().filter(|step| *step > 1.0).map(|step| too_far(step, self));
        let speed = self.damping_step().filter(|step| *step > 1.0).map(|step| too_hard(step, self));
        rate.into_iter().chain(speed).collect()
    }

    /// How far a control period takes the speed of a vehicle to where its law wants it, as a part of the way, under the laws of chapter 2, which
    /// ask for accelerations: aT.
    ///
    /// A speed v with v' = −a v − bξ − ..., held for T, has with x = ξ the polynomial (z − 1)² + aT(z − 1) + bT²(z + 1)/2, which at z = −1 is
    /// 4 − 2aT: above aT = 2 a root is left of −1, whatever b. Above 1 it steps past.
    fn damping_step(&self) -> Option<f64> {
        let a = match &self.law_choice {
            LawChoice::LeaderFollower(law) => law.a.max(law.a1),
            LawChoice::Gateway(law) => law.a,
            LawChoice::GatewayIntegral(law) => law.a,
            LawChoice::Neighbours(law) => law.a,
            _ => return None,
        };
        Some(a * self.control_period.secs())
    }

    /// How far a control period takes a vehicle towards the mean of its neighbours, as a part of the way, under laws with a
    /// rate in proportion to the disagreement: k n T for a sum over at most n neighbours, k T for a mean over them.
    ///
    /// γ_i(t + T) = γ_i − k T Σ_j (γ_i − γ_j) is a mean of the fleet with weights of its own as long as k n T ≤ 1, so nobody ever leaves
    /// the range of the others. Above 1 it steps past them, and above 2 the disagreement can only grow.
    fn sampled_step(&self) -> Option<f64> {
        let (gain, is_mean) = match &self.law_choice {
            LawChoice::Introduction(law) | LawChoice::Switching(law) => (law.gain, false),
            LawChoice::KnownDelay(law) => (law.gain, false),
            LawChoice::Delayed(law) | LawChoice::DelayedWithLosses(law) => (law.gain, true),
            LawChoice::DelayedEstimating(law) => (law.gain, true),
            _ => return None,
        };
        let heard = |i: usize| self.links.iter().filter(|link| link.to == i).count();
        let most = (0..self.vehicles.len()).map(heard).max().filter(|most| *most > 0)?;
        let neighbours = if is_mean { 1.0 } else { most as f64 };
        Some(gain * neighbours * self.control_period.secs())
    }
}

fn too_far(step: f64, mission: &Mission) -> String {
    let period = mission.control_period.secs();
    let outcome = if step > 2.0 { "the sampled law is unstable" } else { "the sampled law may be unstable" };
    format!(
        "coordination.law: a control period of {period} s takes a vehicle {step:.3e} times the way to its neighbours; above 1 it \
         steps past them, and {outcome}: a smaller gain or control period keeps it below"
    )
}

fn too_hard(step: f64, mission: &Mission) -> String {
    let period = mission.control_period.secs();
    let outcome = if step > 2.0 { "the sampled law is unstable" } else { "the sampled law may be unstable" };
    format!(
        "coordination.law: a control period of {period} s takes the speed of a vehicle {step:.3e} times the way to where gain a wants it; \
         above 1 it steps past, and {outcome}: a smaller gain or control period keeps it below"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: &str = include_str!("../../../missions/thesis/fig-4-2.toml");
    const GATEWAY: &str = include_str!("../../../missions/thesis/fig-2-12.toml");
    const HELIX: &str = include_str!("../../../missions/auv-helix.toml");

    fn advice(text: &str, old: &str, new: &str) -> Vec<String> {
        assert!(text.contains(old), "{old:?} is not in the mission");
        Mission::parse("m", &text.replacen(old, new, 1)).unwrap_or_else(|faults| panic!("{faults}")).advice()
    }

    #[test]
    fn a_gain_too_large_for_the_control_period_is_warned_of() {
        assert_eq!(advice(HELIX, "gain = 0.1", "gain = 0.1"), [""; 0]);
        assert_eq!(advice(PLANE, "name = ", "name = "), [""; 0]);
        // k T = 20 · 0.05 = 1: a mean over the neighbours, so their number does not count.
        assert_eq!(advice(HELIX, "gain = 0.1", "gain = 20.0"), [""; 0]);
        assert!(advice(HELIX, "gain = 0.1", "gain = 30.0")[0].contains("may be unstable"));
        // a T = 3 · 0.02, and with a = 120: 2.4.
        assert_eq!(advice(GATEWAY, " a = 3.0", " a = 3.0"), [""; 0]);
        assert!(advice(GATEWAY, " a = 3.0", " a = 60.0")[0].contains("may be unstable"));
        assert!(advice(GATEWAY, " a = 3.0", " a = 120.0")[0].contains("2.400e0 times the way"));
        assert!(advice(GATEWAY, " a = 3.0", " a = 120.0")[0].contains("law is unstable"));
        assert!(advice(HELIX, "gain = 0.1", "gain = 1e6")[0].contains("5.000e4 times the way"));
    }
}
