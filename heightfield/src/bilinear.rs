//! Bilinear heights between samples.

/// Positions this close to a sample, in samples, count as on it.
pub const ON_SAMPLE: f64 = 1e-9;

/// Returns the height at a position in columns and rows, both from zero; NaN outside the field, or
/// if a corner with a weight has no height. Corners with zero weight are not read.
pub fn at([column, row]: [f64; 2], height: impl Fn(u32, u32) -> f64) -> f64 {
    let (Some((column, east)), Some((row, north))) = (split(column), split(row)) else {
        return f64::NAN;
    };
    let across = |row: u32| mix(east, height(column, row), || height(column + 1, row));
    mix(north, across(row), || across(row + 1))
}

/// Splits a position into a sample and the fraction of the step to the next.
fn split(place: f64) -> Option<(u32, f64)> {
    let nearest = place.round();
    let (sample, share) = if (place - nearest).abs() <= ON_SAMPLE * nearest.abs().max(1.0) {
        (nearest, 0.0)
    } else {
        (place.floor(), place - place.floor())
    };
    (sample >= 0.0 && sample < f64::from(u32::MAX)).then_some((sample as u32, share))
}

/// Interpolates from one height to the next by `share`; `to` is not called if its weight is zero.
fn mix(share: f64, from: f64, to: impl Fn() -> f64) -> f64 {
    match share {
        0.0 => from,
        _ => from * (1.0 - share) + to() * share,
    }
}
