//! Where a terrain lies in front of the arm and how large it is there.
//!
//! [`suggest_scale`] finds a scale at which a terrain feels good;
//! [`PlacedTerrain`] puts the terrain into the arm's reach.

mod placed_terrain;
mod suggested_scale;

pub use placed_terrain::{PlacedTerrain, PlacingError};
pub use suggested_scale::{SuggestedScale, suggest_scale};
