//! Where a terrain lies in front of the arm and how large it is there.
//!
//! [`Target`] and [`ViewOptions`] are what the user asks for. [`Reach`] is what an arm can
//! get to, by its calibration. [`View::new`] makes of both and of a grid the one answer: the
//! place under the home position, scale, level and heights, from which terrain and scene
//! follow. [`ViewChange`] makes another view of it while it is felt.

mod change;
mod coordinates;
mod error;
mod fit;
mod ground;
mod reach;
mod surface_change;
mod target;
mod view;
mod words;

pub use change::{Bounds, ChangeError, Changed, Hand, Laid, STIFFEST_N_PER_MM, ViewChange};
pub use coordinates::Coordinates;
pub use error::PlaceError;
pub use reach::{Reach, ReachBox};
pub use surface_change::{SurfaceChange, SurfaceError};
pub use target::Target;
pub(crate) use view::FELT_MM;
pub use view::{Heights, Sizing, View, ViewOptions, suited_height};
pub use words::{bounds_in_words, coordinates_in_words, place_in_words};
