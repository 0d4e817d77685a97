//! What was measured, as a table, a CSV file and a picture.

mod continuity;
mod file;
mod labels;
mod picture;
mod summary;
mod table;

pub use continuity::continuity;
pub use file::{HEADER, write_csv};
pub use picture::draw;
pub use summary::summary;
pub use table::table;
