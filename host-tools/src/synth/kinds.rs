//! The formulas: heights from 0 to 1, positions in cells.

use super::hash::{hash, unit};

const OCTAVES: u32 = 8;
/// Cells between the lattice points of the coarsest octave.
const COARSEST: f64 = 256.0;
/// Ratio of the heights of two successive octaves, whose wavelengths have the ratio ½: rough slopes
/// at every scale, like eroded rock.
const GAIN: f64 = 0.45;

/// Returns eight octaves of gradient noise.
pub(super) fn fractal(seed: u64, x: f64, y: f64) -> f64 {
    let mut sum = 0.0;
    let mut weight = 1.0;
    let mut spacing = COARSEST;
    for octave in 0..u64::from(OCTAVES) {
        sum += weight * gradient_noise(seed.wrapping_add(octave << 32), x / spacing, y / spacing);
        weight *= GAIN;
        spacing /= 2.0;
    }
    // The octaves together reach at most ±1.8, in practice hardly ±0.9.
    (0.5 + 0.55 * sum).clamp(0.0, 1.0)
}

/// Returns Perlin noise: a random slope at every lattice point, blended smoothly; within ±1, and 0
/// at the lattice points.
fn gradient_noise(seed: u64, x: f64, y: f64) -> f64 {
    let (west, south) = (x.floor(), y.floor());
    let (u, v) = (x - west, y - south);
    let slope = |east: i64, north: i64| {
        let bits = hash(seed, west as i64 + east, south as i64 + north);
        let (gx, gy) = (2.0 * unit(bits, 0) - 1.0, 2.0 * unit(bits, 1) - 1.0);
        gx * (u - east as f64) + gy * (v - north as f64)
    };
    let (bu, bv) = (blend(u), blend(v));
    let southern = slope(0, 0) + bu * (slope(1, 0) - slope(0, 0));
    let northern = slope(0, 1) + bu * (slope(1, 1) - slope(0, 1));
    southern + bv * (northern - southern)
}

/// Returns a smooth step from 0 to 1 with no slope and no curvature at either end.
fn blend(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

/// Returns crests 64 cells apart that run north and lean to the west.
pub(super) fn ridge(seed: u64, x: f64, y: f64) -> f64 {
    let phase = unit(hash(seed, 0, 0), 0);
    let across = (x + y / 4.0) / 64.0 + phase;
    let place = across - across.floor();
    1.0 - (2.0 * place - 1.0).abs()
}

/// Returns one needle in every block of 16 × 16 samples, half to full height.
pub(super) fn spikes(seed: u64, column: u32, row: u32) -> f64 {
    let bits = hash(seed, i64::from(column / 16), i64::from(row / 16));
    let is_needle = u64::from(column % 16) == bits & 15 && u64::from(row % 16) == (bits >> 4) & 15;
    if is_needle {
        0.5 + 0.5 * unit(bits, 2)
    } else {
        0.0
    }
}

/// Returns blocks of 24 × 24 samples, each at one of eight heights.
pub(super) fn steps(seed: u64, column: u32, row: u32) -> f64 {
    let bits = hash(seed, i64::from(column / 24), i64::from(row / 24));
    (bits % 8) as f64 / 7.0
}

/// Returns a bowl in every block of 256 × 256 samples, of 40 to 80 cells radius, its rim at full
/// height and the plain around it at a third.
pub(super) fn crater(seed: u64, column: u32, row: u32) -> f64 {
    const PLAIN: f64 = 1.0 / 3.0;
    const BLOCK: u32 = 256;
    let bits = hash(seed, i64::from(column / BLOCK), i64::from(row / BLOCK));
    let radius = 40.0 + 40.0 * unit(bits, 0);
    // The slope outside the rim ends at 1.5 radii, inside the block.
    let room = f64::from(BLOCK) - 3.0 * radius;
    let centre = (
        1.5 * radius + room * unit(bits, 1),
        1.5 * radius + room * unit(bits, 2),
    );
    let east = f64::from(column % BLOCK) - centre.0;
    let north = f64::from(row % BLOCK) - centre.1;
    let distance = (east * east + north * north).sqrt() / radius;
    if distance < 1.0 {
        distance * distance
    } else if distance < 1.5 {
        let fall = (1.5 - distance) / 0.5;
        PLAIN + (1.0 - PLAIN) * fall * fall
    } else {
        PLAIN
    }
}
