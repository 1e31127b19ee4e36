//! Plants: equations of motion, one per file.
//!
//! | plant | source | equation | file |
//! |---|---|---|---|
//! | kinematic unicycle | section 1.2 | ẋ = v cos ψ, ẏ = v sin ψ; v and ψ are the inputs | [`kinematic_unicycle`] |
//! | dynamic unicycle | section 3.2.1, (3.12) | v̇ = F/m, ṙ = N/I | [`dynamic_unicycle`] |
//! | underactuated body in space | sections 4.5, 4.6 | (4.44), (4.45) | [`auv`] |
//! | its Sirene-like parameters, derived | section 4.6 | – | [`sirene`] |
//!
//! What disturbs a plant (currents, noise of its instruments, a speed that is stuck) is in [`environment`].
//!
//! Every planar model has its arguments in the order `(t, x, u, params)`; [`integrate`] holds the inputs and integrates.

pub mod attitude;
pub mod auv;
pub mod dynamic_unicycle;
pub mod environment;
pub mod integrate;
pub mod kinematic_unicycle;
pub mod sirene;
