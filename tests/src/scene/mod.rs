//! Scenes: a terrain, a way of the hand, and how the tiles come.

pub mod hand;
pub mod run;
pub mod stage;
pub mod symmetry;
pub mod terrain;
pub mod twin;
