//! When to speak, and what to believe between messages: the open road of the thesis' last chapter.
//!
//! | what | file |
//! |---|---|
//! | what a vehicle believes of another between two of its messages | [`belief`] |
//! | the rate at which another moves, from what it said last | [`rate`] |
//! | when a difference is worth a message | [`trigger`] |
//! | one vehicle's decisions: speak now or not, ask, acknowledge | [`speaker`] |
//!
//! A vehicle that speaks by event knows what its neighbours believe of it, because it does the same sum as they: it
//! speaks when that belief has become wrong. That holds only of what they *heard*. What was said may have been lost, so
//! every message tells what its sender heard of the others, and what nobody confirms is said again. `docs/talking.md`
//! derives what all this costs in coordination; [`crate::theory::event_triggered`] computes it.

pub mod belief;
pub mod rate;
pub mod speaker;
pub mod trigger;
