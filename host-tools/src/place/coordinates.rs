//! Coordinates of a place.

use heightfield::{Georeference, ReferenceSystem};

/// Coordinates of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// x and y of the file's own reference system, or columns and rows if it has none.
    Own,
    /// Longitude and latitude, degrees: of WGS 84, or as [`heightfield::Georeference::lonlat`]
    /// returns for the file.
    LonLat,
    /// x and y, east before north, of the reference system with this EPSG code.
    Epsg(u16),
}

impl Coordinates {
    /// Returns the file's own coordinates if they are in this reference system, otherwise `self`.
    pub(super) fn of(self, file: &Georeference<'_>) -> Self {
        match self {
            Self::Epsg(code) if file.reference() == ReferenceSystem::from_code(code).as_ref() => {
                Self::Own
            }
            other => other,
        }
    }
}
