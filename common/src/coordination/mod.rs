//! Coordination laws, one per file.
//!
//! | law | source | equation | demand | hears | file |
//! |---|---|---|---|---|---|
//! | two vehicles on lines | section 1.2 | ẋ_i = −a_i (x_i − x_j) + v_L (1.5) | rate | ξ_j | [`introduction_1_5`] |
//! | two vehicles, one of which learns v_L | section 1.2 | ẋ_2 = −a_2 (x_2 − x_1) + b_2 e_I, after (1.5) | rate | ξ_j | [`leader_1_5`] |
//! | leader and followers | section 2.2.1 | F_1 = −a_1(v_1 − v_1^c) (2.30), followers (2.31) | forward acceleration | ξ_1 | [`leader_follower_2_30`] |
//! | gateway | section 2.2.2, erratum 2.2 | (2.33), (2.34) | forward acceleration | ξ_1, or all ξ_i | [`gateway_2_33`] |
//! | gateway with the extra integrator | section 2.5.3, errata 2.2, 2.12 | (2.33), (2.34) with δe_{1,i} | forward acceleration | ξ_1, or all ξ_i and δe_{1,i} | [`gateway_2_33`] |
//! | neighbours in a row | Figure 2.7-3, a law of our own | (2.33) for any vehicle | forward acceleration | ξ_{i±1} | [`neighbours_2_7`] |
//! | alone | (2.30) for every vehicle | F_i = −a_1(v_i − R_i v_L) | forward acceleration | nothing | [`prescribed_2_6`] |
//! | square wave | Figure 2.6 | F_i/m = ±amplitude | forward acceleration | nothing | [`prescribed_2_6`] |
//! | solution I | Proposition 3.4 | u = −(LC + C + A)η − ALξ (3.43) | acceleration | ξ_j, η_j/R_j | [`solution_1_3_43`] |
//! | solution II | Proposition 3.4 | u = −Aη − BCLξ (3.44) | acceleration | ξ_j | [`solution_2_3_44`] |
//! | solution III | Proposition 3.5 | u = −(A⁻¹L + A)Cη − B sat(η + A⁻¹Lξ) (3.45) | acceleration | ξ_j, η_j/R_j | [`solution_3_3_45`] |
//! | weighted links | Remark 3.10 | u_i = −a_i η_i − b_i/R_i Σ w_k (ξ_i − ξ_j) (3.62) | acceleration | ξ_j | [`weighted_3_62`] |
//! | moving pattern | section 3.3.3 | solution III about ξ − h(t) (3.70) | acceleration | ξ_j − h_j, η_j/R_j − h_j' | [`pattern_3_70`] |
//! | one-way links | Proposition 3.6 | u = −Aη − BC⁻¹Lξ (3.72) | acceleration | ξ_j | [`directed_3_72`] |
//! | one-way links, solution II | Remark 3.13 | u = −Aη − BCLξ (3.83) | acceleration | ξ_j | [`solution_2_3_44`] |
//! | one-way links, fixed pattern | Remark 3.15 | u = −Aη − BC⁻¹L(ξ − h) (3.86) | acceleration | ξ_j − h_j | [`directed_3_72`] |
//! | one vehicle is told v_L | Proposition 3.7 | F = −aC⁻¹LCv − bC⁻¹Lξ (3.90)–(3.92) | forward acceleration | ξ_j, v_j/R_j | [`decentralised_3_92`] |
//! | switching network | Theorems 4.4 and 4.5 | v_r = v_L − k_i Σ(γ_i − γ_j) (4.21) | rate | γ_j | [`switching_4_21`] |
//! | delay, never alone | Lemma 4.4 | v_r = v_L − k/\|N_i\| Σ(γ_i − γ_j(t−τ)) (4.34) | rate | γ_j | [`delayed_4_34`] |
//! | delay, at times alone | Lemma 4.5 | (4.34), and v_L* when N_i is empty (4.42) | rate | γ_j | [`delayed_4_42`] |
//! | auxiliary state, fixed network | Theorem 4.8 | γ̇ = v_L + z − A₁⁻¹(Lγ + α_2) (4.59)–(4.61) | rate | γ_j | [`auxiliary_4_59`] |
//! | auxiliary state, switching network | Theorem 4.9 | the same with α_2 ≡ 0 (4.62) | rate | γ_j | [`auxiliary_4_59`] |
//! | delay, not told | this project; after Lemma 4.5 | (4.42) with v_L* estimated on board | rate | γ_j | [`delayed_4_42_estimating`] |
//! | delay, known | this project | v_r = v_L − kΣ(γ_i(t−τ_ij) − γ_j(t−τ_ij)) | rate | γ_j and its age | [`known_delay`] |
//!
//! Vehicles with gains of their own have their rows from [`diagonal`].
//! What all of them need of the neighbours is in [`disagreement`], what the laws of chapter 2 share in [`recruiting`].

pub mod auxiliary_4_59;
pub mod decentralised_3_92;
pub mod delayed_4_34;
pub mod delayed_4_42;
pub mod delayed_4_42_estimating;
pub mod diagonal;
pub mod directed_3_72;
pub mod disagreement;
pub mod gateway_2_33;
pub mod introduction_1_5;
pub mod known_delay;
pub mod leader_1_5;
pub mod leader_follower_2_30;
pub mod neighbours_2_7;
pub mod pattern_3_70;
pub mod prescribed_2_6;
pub mod recruiting;
pub mod solution_1_3_43;
pub mod solution_2_3_44;
pub mod solution_3_3_45;
pub mod switching_4_21;
pub mod weighted_3_62;

/// What the fleet is asked to do: the formation speed and its derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpeedReference {
    /// Formation speed v_L \[units of ξ per s\].
    #[doc(alias = "v_L")]
    pub v_l: f64,
    /// Its time derivative \[units of ξ per s²\].
    pub v_l_dot: f64,
}

/// What a law knows of its own vehicle. What a kind of vehicle does not have is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Own {
    /// Coordination state with the pattern removed, ξ_i − h_i.
    #[doc(alias = "γ")]
    pub xi: f64,
    /// Speed-tracking error η_i = v_i − R_i v_L of (3.38) \[m/s\]; zero for vehicles that take a rate.
    #[doc(alias = "η")]
    pub eta: f64,
    /// R_i(ξ_i) = ds/dξ \[m per unit of ξ\].
    pub r: f64,
    /// Forward speed v_i \[m/s\]; zero for vehicles that take a rate.
    pub v: f64,
    /// dR_i/dt along the path \[m per unit of ξ and s\].
    pub r_dot: f64,
    /// First derivative of the pattern h_i in time \[units of ξ per s\].
    pub h_dot: f64,
    /// Second derivative of the pattern h_i in time \[units of ξ per s²\].
    pub h_ddot: f64,
    /// α_2 of (4.52), by which coordination excites path following; zero but for Theorem 4.7.
    pub alpha_2: f64,
}

/// What a law knows of one neighbour in N_i.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Neighbour {
    /// Its index in the mission.
    pub vehicle: usize,
    /// What stands for its coordination state with its pattern removed: as last heard, or advanced from there.
    pub xi: f64,
    /// The one more scalar that it sent, as its law's [`VehicleLaw::says`] gave it; zero if the law sends none.
    pub scalar: f64,
    /// Its coordination state as it said it.
    pub said: f64,
    /// How long ago it said so \[s\].
    pub age: f64,
}

/// What coordination asks of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// A reference rate of the virtual target v_r \[units of ξ per s\] (chapters 1 and 4).
    Rate(f64),
    /// A reference for the derivative of the speed-tracking error u_i = dη_i/dt \[m/s²\] (chapter 3); the vehicle adds
    /// d/dt(R_i v_L).
    Acceleration(f64),
    /// The forward acceleration dv_i/dt = F_i/m itself \[m/s²\] (chapter 2, and vehicles that are not told v_L).
    Forward(f64),
}

/// Which kind of demand a law gives or a vehicle takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DemandKind {
    /// See [`Demand::Rate`].
    Rate,
    /// See [`Demand::Acceleration`] and [`Demand::Forward`].
    Acceleration,
}

/// A coordination law without states of its own, the same for every vehicle.
pub trait CoordinationLaw: Send + Sync + std::fmt::Debug {
    /// The demand given what is known now; `neighbours` is N_i, possibly empty.
    fn demand(&self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand;
    /// The kind of demand it gives.
    fn kind(&self) -> DemandKind;
    /// Whether neighbours must send η_j / R_j beside ξ_j.
    fn needs_speed_error(&self) -> bool {
        false
    }
}

/// The coordination law of a fleet, as a mission chooses it: makes each vehicle's law.
///
/// Every [`CoordinationLaw`] is one. Laws with states, or in which vehicles have different parts, implement it themselves.
pub trait FleetLaw: Send + Sync + std::fmt::Debug {
    /// The kind of demand it gives.
    fn kind(&self) -> DemandKind;
    /// What the vehicle with this index sends beside ξ, in words and with its unit; `None` if ξ is all.
    fn says(&self, vehicle: usize) -> Option<&'static str>;
    /// The law of the vehicle with this index in the mission.
    fn vehicle(&self, index: usize) -> Box<dyn VehicleLaw>;
}

/// The coordination law of one vehicle, with its states.
pub trait VehicleLaw: Send + std::fmt::Debug {
    /// The demand for the coming control period, given what is known at its begin.
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand;
    /// Moves the law's own states over a control period of `dt` seconds, with what it knew at its begin held.
    fn advance(&mut self, dt: f64) {
        let _ = dt;
    }
    /// The rate at which a neighbour is taken to have moved on since it spoke \[units of ξ per s\], if the mission has its
    /// word advanced: v_L, but for a vehicle that is not told v_L. `scalar` is what the neighbour said beside ξ.
    fn neighbour_rate(&self, reference: SpeedReference, scalar: f64) -> f64 {
        let _ = scalar;
        reference.v_l
    }
    /// The one more scalar that goes on the air beside ξ. Always `Some` if [`FleetLaw::says`] is for this vehicle, else
    /// always `None`.
    fn says(&self, own: &Own) -> Option<f64> {
        let _ = own;
        None
    }
}

impl<L: CoordinationLaw + Clone + 'static> FleetLaw for L {
    fn kind(&self) -> DemandKind {
        CoordinationLaw::kind(self)
    }

    fn says(&self, _: usize) -> Option<&'static str> {
        self.needs_speed_error().then_some("normalised speed-tracking error η/R [units of ξ per s]")
    }

    fn vehicle(&self, _index: usize) -> Box<dyn VehicleLaw> {
        Box::new(Stateless(self.clone()))
    }
}

/// A law without states as the law of one vehicle.
#[derive(Debug)]
struct Stateless<L>(L);

impl<L: CoordinationLaw> VehicleLaw for Stateless<L> {
    fn demand(&mut self, reference: SpeedReference, own: &Own, neighbours: &[Neighbour]) -> Demand {
        self.0.demand(reference, own, neighbours)
    }

    fn says(&self, own: &Own) -> Option<f64> {
        self.0.needs_speed_error().then_some(own.eta / own.r)
    }
}

#[cfg(test)]
mod ideal_fleet;
#[cfg(test)]
mod sampled_fleet;

#[cfg(test)]
mod tests {
    use super::introduction_1_5::Introduction;
    use super::{FleetLaw, SpeedReference};

    #[test]
    fn a_neighbour_is_taken_to_go_on_at_the_formation_speed() {
        let law = FleetLaw::vehicle(&Introduction::new(0.5).unwrap(), 0);
        assert_eq!(law.neighbour_rate(SpeedReference { v_l: 0.3, v_l_dot: 0.0 }, 7.0), 0.3);
    }
}
