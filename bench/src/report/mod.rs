//! Measurements as a table, a CSV file and a picture.

mod continuity;
mod effects;
mod file;
mod labels;
mod picture;
mod streaming;
mod streaming_picture;
mod summary;
mod table;

pub use continuity::continuity;
pub use effects::{EFFECTS_HEADER, effects, write_effects};
pub use file::{HEADER, write_csv};
pub use picture::draw;
pub use streaming::{STREAMING_HEADER, streaming, streaming_head, write_streaming};
pub use streaming_picture::draw_streaming;
pub use summary::summary;
use table::number;
pub use table::table;
