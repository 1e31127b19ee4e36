//! Path-following laws, one per file.
//!
//! | law | source | equation | file |
//! |---|---|---|---|
//! | line of sight | section 1.2 | (1.4) | [`line_of_sight`] |
//! | nonlinear path following of a wheeled robot | Proposition 3.1, Appendix 6.1 | (3.13)–(3.15) | [`proposition_3_1`] |
//! | the same with Δ ≡ 0 | Proposition 3.2 | (3.16), (3.17), (3.23) | [`proposition_3_2`] |
//! | fully actuated marine vehicle with a side-slip | Proposition 3.3 | (3.26), (3.31), (3.32), erratum 3.3 | [`proposition_3_3`] |
//! | underactuated body in space, working law | Theorem 4.7, section 4.5.1 | (4.46)–(4.53) | [`theorem_4_7`] |

pub mod line_of_sight;
pub mod proposition_3_1;
pub mod proposition_3_2;
pub mod proposition_3_3;
pub mod theorem_4_7;
