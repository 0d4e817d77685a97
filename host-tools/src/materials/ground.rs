//! Errors of classes that cannot be placed on a terrain.

use heightfield::{Raster, Sides, System};

/// Reason for which classes cannot be placed on a terrain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GroundError {
    /// One of the two files states its position, and the other does not.
    #[error(
        "{unplaced} does not state its reference system, and {placed} does: the classes cannot be placed on the terrain"
    )]
    NoSystem {
        /// The file without a reference system.
        unplaced: String,
        /// The other file.
        placed: String,
    },
    /// Their reference systems differ, and no conversion between them is known.
    #[error(
        "{file} is in a reference system that cannot be converted to longitude and latitude, and not in that of {other}"
    )]
    NoConversion {
        /// The file in that system.
        file: String,
        /// The other file.
        other: String,
    },
    /// They belong to different bodies.
    #[error("{classes} is on another body than {terrain}")]
    OtherBody {
        /// The file of classes.
        classes: String,
        /// The terrain.
        terrain: String,
    },
    /// They do not overlap.
    #[error("{classes} does not overlap {terrain}: {there}, and the terrain {here}")]
    Apart {
        /// The file of classes.
        classes: String,
        /// The terrain.
        terrain: String,
        /// Position of the classes.
        there: String,
        /// Position of the terrain.
        here: String,
    },
    /// More materials than a device can store.
    #[error("{0} classes; a scene has at most 15, and the default")]
    TooMany(usize),
}

/// Returns the position of a raster, in longitude and latitude if they are known.
pub(super) fn place_of(raster: &Raster) -> String {
    if let Some(bounds) = raster.bounds_lonlat() {
        let (west, south, east, north) = (bounds.west, bounds.south, bounds.east, bounds.north);
        return format!("longitude {west:.4}° to {east:.4}°, latitude {south:.4}° to {north:.4}°");
    }
    let on = raster.georeference();
    let [west, south, east, north]: Sides = on.bounds();
    match on.system() {
        System::Cells => format!("columns {west} to {east}, rows {south} to {north}"),
        _ => format!("x {west} to {east}, y {south} to {north}"),
    }
}
