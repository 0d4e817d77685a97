//! Reports of a device during a session: times over restarts ([`Timeline`]), rows in device
//! millimetres of their placements ([`SampleLog`], [`Placements`]), figures of the whole session
//! ([`Figures`]).

mod figures;
mod placements;
mod sample_log;
mod timeline;

pub use figures::{Figures, Mean};
pub use placements::{Placements, SessionPlacement};
pub use sample_log::SampleLog;
pub use timeline::Timeline;
