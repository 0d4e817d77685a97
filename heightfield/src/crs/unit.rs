//! The unit of a reference system's coordinates.

/// Unit of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unit {
    /// Degrees in a unit.
    Angle(f64),
    /// Metres in a unit, if known.
    Length(Option<f64>),
}

impl Unit {
    /// Returns an angle in radians, rounded to a degree or a grad if only rounding separates them.
    pub(super) fn of_radians(radians: f64) -> Self {
        let degrees = radians.to_degrees();
        let whole = |part: &f64| (degrees / part - 1.0).abs() < 1e-9;
        Self::Angle([1.0, 0.9].into_iter().find(whole).unwrap_or(degrees))
    }
}
