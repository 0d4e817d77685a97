//! Heights between samples: linear along rows and along columns.

/// A place this close to a sample is on it, in samples.
pub const ON_SAMPLE: f64 = 1e-9;

/// The height at a place in columns and rows, both from zero; NaN beyond, and where a
/// corner that counts has none. Corners that do not count are not asked for.
pub fn at([column, row]: [f64; 2], height: impl Fn(u32, u32) -> f64) -> f64 {
    let (Some((column, east)), Some((row, north))) = (split(column), split(row)) else {
        return f64::NAN;
    };
    let across = |row: u32| mix(east, height(column, row), || height(column + 1, row));
    mix(north, across(row), || across(row + 1))
}

/// A place in samples as a sample and the share of the way to the next.
fn split(place: f64) -> Option<(u32, f64)> {
    let nearest = place.round();
    let (sample, share) = if (place - nearest).abs() <= ON_SAMPLE * nearest.abs().max(1.0) {
        (nearest, 0.0)
    } else {
        (place.floor(), place - place.floor())
    };
    (sample >= 0.0 && sample < f64::from(u32::MAX)).then_some((sample as u32, share))
}

/// `share` of the way from one height to the next, which is not asked for where it
/// does not count.
fn mix(share: f64, from: f64, to: impl Fn() -> f64) -> f64 {
    match share {
        0.0 => from,
        _ => from * (1.0 - share) + to() * share,
    }
}
