//! Path-following laws, one per file.
<<<<<<< HEAD

pub mod theorem_4_7;
=======
//!
//! | law | source | equation | file |
//! |---|---|---|---|
//! | line of sight | section 1.2 | ψ = −sign(v) asin(2/π atan(y/Δ)) (1.4) | [`line_of_sight`] |
//! | virtual target for wheeled robots | Proposition 3.1 | N = φ̇ − k₄(r − φ) − (ψ_e − σ), ṡ = v cos ψ_e + k₃ x_e (3.13)-(3.15) | [`proposition_3_1`] |

pub mod line_of_sight;
pub mod proposition_3_1;
>>>>>>> robot
