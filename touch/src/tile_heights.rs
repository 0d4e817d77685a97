//! Rounding of tile heights, shared by all hosts that cut tiles, so that a path has the same forces
//! on each.

use hapterra_core::grid::MAX_CELL;

/// Returns the whole height, in cells, that is the base of a tile, from its lowest and highest
/// sample in cells, both within ±[`MAX_CELL`]: the lowest, or the middle if single heights would
/// otherwise exceed the contact's range.
#[must_use]
pub fn base(low: f64, high: f64) -> i32 {
    let from_low = high - libm::floor(low) <= f64::from(MAX_CELL);
    let base = if from_low { low } else { 0.5 * (low + high) };
    libm::floor(base) as i32 // both within ±MAX_CELL
}

/// Returns a height above a tile's base, cells, rounded once.
#[must_use]
pub fn height_above(base: i32, height: f64) -> f32 {
    (height - f64::from(base)) as f32
}

/// Returns a whole height in cells that no sample of a terrain exceeds, from its lowest and highest
/// sample in cells.
#[must_use]
pub fn top(low: f64, high: f64) -> i32 {
    // Rounded to `f32` above the base, a sample reaches the next whole number at most; from 2^23 to
    // 2^30, it may be higher by its last place.
    let rounding = if high - low < f64::from(1 << 23) {
        0
    } else {
        64
    };
    (libm::ceil(high) as i32 + rounding).min(MAX_CELL + 1)
}

/// Returns the index of the patch of a coordinate in cells and the fraction in it; `None` outside
/// the field.
#[must_use]
pub fn patch_at(cells: f64, patches: i32) -> Option<(u32, f64)> {
    if !(0.0..=f64::from(patches)).contains(&cells) {
        return None;
    }
    // The last sample belongs to the last patch.
    let patch = libm::floor(cells).min(f64::from(patches - 1));
    Some((patch as u32, cells - patch))
}
