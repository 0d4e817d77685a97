//! What a device reports while it is touched: times over restarts
//! ([`Timeline`]), rows in hand millimetres of their views ([`SampleLog`], [`FeltViews`]), figures of the
//! whole session ([`Figures`]).

mod felt_views;
mod figures;
mod sample_log;
mod timeline;

pub use felt_views::{FeltView, FeltViews};
pub use figures::{Figures, Mean};
pub use sample_log::SampleLog;
pub use timeline::Timeline;
