//! Placement of a terrain in front of the arm.
//!
//! [`Target`] and [`PlacementOptions`] are the user's request. [`Reach`] is the workspace of an
//! arm, from its calibration. [`Placement::new`] computes from both and a grid the place under the
//! home position, scale, level and heights, which determine terrain and scene; `fit` searches for
//! the largest cell with which a terrain fits the workspace. [`PlacementChange`] changes the
//! placement during a session.

mod change;
mod coordinates;
mod error;
mod fit;
mod ground;
mod place_text;
mod placement;
mod reach;
mod surface_change;
mod target;

pub use change::{
    Bounds, ChangeError, Changed, Hand, MAX_STIFFNESS_N_PER_MM, Measure, PlacedSurface,
    PlacementChange, TIPS_MM,
};
pub use coordinates::Coordinates;
pub use error::PlaceError;
pub use place_text::{bounds_in_words, coordinates_in_words, place_in_words};
pub(crate) use placement::CLEAR_RELIEF_MM;
pub use placement::{Heights, Placement, PlacementOptions, Sizing, suited_height};
pub use reach::{Reach, ReachBox};
pub use surface_change::{SurfaceChange, SurfaceError};
pub use target::Target;
