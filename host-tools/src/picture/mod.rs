//! Pictures of sessions, as PNG files.
//!
//! `plotters` lays out charts, axes and labels; [`canvas`] receives its drawing commands:
//! `tiny-skia` draws with antialiasing, and `lettering` sets Noto Sans (SIL Open Font License) from
//! the `notosans` crate. No system font, C library or screen is needed.
//!
//! [`canvas`], [`style`] and [`axes`] do not depend on terrain and serve any other picture.

pub mod axes;
pub mod canvas;
mod ground_marks;
mod lettering;
pub mod line;
mod map;
mod map_view;
mod panel;
mod relief;
mod session;
pub mod style;
mod timeline;

pub use canvas::{Canvas, PictureError};
pub use ground_marks::GroundFacts;
pub use relief::Surface;
pub use session::SessionPicture;
