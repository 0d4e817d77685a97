//! Place of a field, from a file's map and the unit of its coordinates.

use super::ground_map::GroundMap;

/// Place of a field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// From columns and rows in file order.
    pub(super) map: GroundMap,
    /// Degrees in a unit of the coordinates, where they are angles.
    pub(super) degrees: f64,
}

impl Place {
    /// A place whose angles, where there are any, are degrees.
    pub(super) const fn new(map: GroundMap) -> Self {
        Self { map, degrees: 1.0 }
    }
}
