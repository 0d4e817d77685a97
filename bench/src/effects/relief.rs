//! The relief of a texture in f64, by the formulas of docs/explanation/effects.md.

use std::f64::consts::TAU;

use hapterra_core::force::{Pattern, Texture};

/// Returns the height of a relief of height 1 at a point, and its slopes eastward and northward a
/// millimetre.
pub(super) fn height_and_slopes(texture: &Texture, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
    match texture.pattern {
        Pattern::None => (0.0, [0.0; 2]),
        Pattern::Grating => grating(texture, [x, y]),
        Pattern::Grain => grain(texture, [x, y]),
    }
}

fn grating(texture: &Texture, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
    let waves = f64::from(1.0 / texture.wavelength_mm);
    let (north, east) = f64::from(texture.direction_deg).to_radians().sin_cos();
    let shift = f64::from(hash(texture.seed)) / 2_f64.powi(32);
    let (sin, cos) = (TAU * (waves * (east * x + north * y) + shift)).sin_cos();
    (sin, [east, north].map(|part| TAU * waves * part * cos))
}

fn grain(texture: &Texture, place: [f64; 2]) -> (f64, [f64; 2]) {
    let grains = f64::from(2.0 / texture.wavelength_mm);
    let [(column, u), (row, v)] = place.map(|c| {
        let counted = c * grains;
        (counted.floor() as i64, counted - counted.floor())
    });
    let random_height = |east: i64, north: i64| corner(texture.seed, column + east, row + north);
    let [sw, se, nw, ne] = [
        random_height(0, 0),
        random_height(1, 0),
        random_height(0, 1),
        random_height(1, 1),
    ];
    let eased = |s: f64| s * s * (3.0 - 2.0 * s);
    let steepness = |s: f64| 6.0 * s * (1.0 - s) * grains;
    let mixed = |a: f64, b: f64, s: f64| a + (b - a) * eased(s);
    let height = mixed(mixed(sw, se, u), mixed(nw, ne, u), v);
    let east = mixed(se - sw, ne - nw, v) * steepness(u);
    let north = mixed(nw - sw, ne - se, u) * steepness(v);
    (height, [east, north])
}

/// Returns the random height of a corner: textures with the same numbers are equal.
fn corner(seed: u32, column: i64, row: i64) -> f64 {
    let number = column * 0x9E37_79B1 + row * 0x85EB_CA77 + i64::from(hash(seed));
    f64::from(hash(number as u32) as i32) / 2_f64.powi(31)
}

/// Wellons' `lowbias32`.
fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::effect::texture;

    #[test]
    fn slopes_are_derivatives_of_the_heights() {
        const STEP: f64 = 1e-6;
        for pattern in [Pattern::Grain, Pattern::Grating] {
            let texture = texture(pattern);
            let high = |x: f64, y: f64| height_and_slopes(&texture, [x, y]).0;
            for place in [[3.21, 4.56], [100.1, 17.9], [0.77, 200.3]] {
                let [x, y] = place;
                let (_, [east, north]) = height_and_slopes(&texture, place);
                let eastward = (high(x + STEP, y) - high(x - STEP, y)) / (2.0 * STEP);
                let northward = (high(x, y + STEP) - high(x, y - STEP)) / (2.0 * STEP);
                assert!((east - eastward).abs() < 1e-6, "{east} {eastward}");
                assert!((north - northward).abs() < 1e-6, "{north} {northward}");
            }
        }
    }
}
