//! Path-following laws, one per file.
//!
//! | law | source | equation | file |
//! |---|---|---|---|
//! | line of sight | section 1.2 | (1.4) | [`line_of_sight`] |
//! | decoupling, full state | section 2.1.1, Figure 2.2; errata 2.1, 2.4, 2.5 | (2.14)–(2.16) | [`decoupling_2_14`] |
//! | decoupling, output feedback | section 2.1.1, Figures 2.3 and 2.4 | H_2 design of (2.12), (2.13) | [`output_feedback_2_3`], [`h2_figure_2_4`] |
//! | state transformation | section 2.1.2, Figure 2.5; errata 2.7, 2.8 | (2.17)–(2.19) | [`state_transformation_2_19`] |
//! | nonlinear path following of a wheeled robot | Proposition 3.1, Appendix 6.1 | (3.13)–(3.15) | [`proposition_3_1`] |
//! | underactuated body in space, working law | Theorem 4.7, section 4.5.1 | (4.46)–(4.53) | [`theorem_4_7`] |
//!
//! What the laws of chapter 2 share is in [`trimming`].

pub mod decoupling_2_14;
pub mod h2_figure_2_4;
pub mod line_of_sight;
pub mod output_feedback_2_3;
pub mod proposition_3_1;
pub mod state_transformation_2_19;
pub mod theorem_4_7;
pub mod trimming;
