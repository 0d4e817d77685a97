//! Place of a field: the file's map and the unit of its coordinates.

use super::ground_map::GroundMap;

/// Place of a field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Map from columns and rows in file order.
    pub(super) map: GroundMap,
    /// Degrees in a unit of the coordinates, if they are angles.
    pub(super) degrees: f64,
}

impl Place {
    /// Returns a place whose angles, if any, are in degrees.
    pub(super) const fn new(map: GroundMap) -> Self {
        Self { map, degrees: 1.0 }
    }
}
