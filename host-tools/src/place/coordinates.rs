//! Coordinates of a place.

use heightfield::{Georeference, ReferenceSystem};

/// Coordinates of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// x and y of the file's own reference system, or columns and rows where it has none.
    Own,
    /// Longitude and latitude, degrees: of WGS 84, or what else
    /// [`heightfield::Georeference::lonlat`] says of the file.
    LonLat,
    /// x and y, east before north, of the reference system with this code of EPSG's.
    Epsg(u16),
}

impl Coordinates {
    /// The same, as the file's own where these are in its reference system.
    pub(super) fn of(self, file: &Georeference<'_>) -> Self {
        match self {
            Self::Epsg(code) if file.reference() == ReferenceSystem::from_code(code).as_ref() => {
                Self::Own
            }
            other => other,
        }
    }
}
