//! What the numbers of a place are.

/// What the numbers of a place are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// x and y of the file's own reference system, or columns and rows where it has none.
    Own,
    /// Longitude and latitude, degrees: of WGS 84, or what else
    /// [`heightfield::Georeference::lonlat`] says of the file.
    LonLat,
}
