//! Pictures of what was felt, as PNG files.
//!
//! `plotters` lays out charts, axes and labels; everything it draws ends in
//! [`canvas`], a backend of our own that draws at twice the size with
//! anti-aliased strokes and properly set type, so that a picture needs no
//! system font, no C library and no screen. The typeface, Noto Sans (SIL Open
//! Font License), comes inside the `notosans` crate.
//!
//! [`canvas`], [`style`] and [`axes`] know nothing about terrain and serve any
//! other picture too.

pub mod axes;
pub mod canvas;
pub mod line;
mod map;
mod panel;
mod relief;
mod session;
pub mod style;
mod timeline;
mod window;

pub use canvas::{Canvas, PictureError};
pub use relief::Field;
pub use session::{Sample, Session, draw_session, save_session};
