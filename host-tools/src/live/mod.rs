//! A session with a hand in it: what `run` and `demo` share.
//!
//! [`suggest`] finds a scale at which a terrain feels good, [`Stage`] puts the
//! terrain in front of the arm, [`Figures`] collects what was felt.

mod figures;
mod stage;
mod suggest;
mod timeline;

pub use figures::{Figures, Mean};
pub use stage::{Stage, StageError};
pub use suggest::{Suggestion, suggest};
pub use timeline::Timeline;
