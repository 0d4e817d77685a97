//! Pictures of sessions, as PNG files.
//!
//! `plotters` lays out charts, axes and labels; all it draws ends in [`canvas`], where
//! `tiny-skia` draws soft edges and `lettering` sets Noto Sans (SIL Open Font License)
//! from the `notosans` crate: no system font, no C library, no screen.
//!
//! [`canvas`], [`style`] and [`axes`] know nothing about terrain and serve any
//! other picture too.

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
