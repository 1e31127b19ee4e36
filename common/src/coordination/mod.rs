//! Coordination laws, one per file.
//!
//! | law | source | equation | demand | hears | file |
//! |---|---|---|---|---|---|
//! | two vehicles on lines | section 1.2 | ẋ_i = −a_i (x_i − x_j) + v_L (1.5) | rate | ξ_j | [`introduction_1_5`] |
//! | solution I | Proposition 3.4 | u = −(LC + C + A)η − ALξ (3.43) | acceleration | ξ_j, η_j/R_j | [`solution_1_3_43`] |
//! | solution II | Proposition 3.4 | u = −Aη − BCLξ (3.44) | acceleration | ξ_j | [`solution_2_3_44`] |
//! | solution III | Proposition 3.5 | u = −(A⁻¹L + A)Cη − B sat(η + A⁻¹Lξ) (3.45) | acceleration | ξ_j, η_j/R_j | [`solution_3_3_45`] |
//! | switching network | Theorems 4.4 and 4.5 | v_r = v_L − k_i Σ(γ_i − γ_j) (4.21) | rate | γ_j | [`switching_4_21`] |
//! | delay, never alone | Lemma 4.4 | v_r = v_L − k/\|N_i\| Σ(γ_i − γ_j(t−τ)) (4.34) | rate | γ_j | [`delayed_4_34`] |
//! | delay, at times alone | Lemma 4.5 | (4.34), and v_L* when N_i is empty (4.42) | rate | γ_j | [`delayed_4_42`] |
//!
//! What all of them need of the neighbours is in [`disagreement`].

pub mod delayed_4_34;
pub mod delayed_4_42;
pub mod disagreement;
pub mod introduction_1_5;
pub mod solution_1_3_43;
pub mod solution_2_3_44;
pub mod solution_3_3_45;
pub mod switching_4_21;

/// What the fleet is asked to do: the formation speed and its derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpeedReference {
    /// Formation speed v_L \[units of ξ per s\].
    #[doc(alias = "v_L")]
    pub v_l: f64,
    /// Its time derivative \[units of ξ per s²\].
    pub v_l_dot: f64,
}

/// What a law knows of its own vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Own {
    /// Coordination state with the pattern removed, ξ_i − h_i.
    #[doc(alias = "γ")]
    pub xi: f64,
    /// Speed-tracking error η_i = v_i − R_i v_L of (3.38) \[m/s\]; zero for vehicles that take a rate.
    #[doc(alias = "η")]
    pub eta: f64,
    /// R_i(ξ_i) = ds/dξ \[m per unit of ξ\].
    pub r: f64,
}

/// What a law knows of one neighbour in N_i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// The neighbour's coordination state with its pattern removed, as last heard.
    pub xi: f64,
    /// The neighbour's normalised speed-tracking error η_j / R_j; zero if the law does not ask for it.
    pub eta_over_r: f64,
}

/// What coordination asks of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// A reference rate of the virtual target v_r \[units of ξ per s\] (chapters 1 and 4).
    Rate(f64),
    /// A reference for the derivative of the speed-tracking error u_i = dη_i/dt \[m/s²\] (chapters 2 and 3).
    Acceleration(f64),
}

/// Which kind of demand a law gives or a vehicle takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DemandKind {
    /// See [`Demand::Rate`].
    Rate,
    /// See [`Demand::Acceleration`].
    Acceleration,
}

/// A coordination law of one vehicle.
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

#[cfg(test)]
mod ideal_fleet;
