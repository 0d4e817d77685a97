//! The micro-relief of a texture: its height and slope at a place of the terrain.
//!
//! A place is counted in waves or grains from the terrain's origin: 32 bits of whole ones, which
//! wrap, and 32 bits of a fraction. The number per cell is rounded once, to an `f32`; everything
//! after that is exact. So the relief is as fine 10⁸ cells from the origin as near it, and does not
//! depend on windows or tiles.

use super::texture::{Pattern, Texture};
use crate::grid::GridPoint;
use crate::phantom::sin_cos;

/// Grains per wavelength: a rise and a fall.
const GRAINS_PER_WAVE: f32 = 2.0;

/// The relief of a texture with heights up to 1, over cells of one size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Relief {
    /// Waves, or grains, per cell eastward and northward.
    per_cell: [f32; 2],
    /// The seed, mixed.
    seed: u32,
    is_grain: bool,
}

/// Height of a relief at a place, and its slopes eastward and northward per cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ReliefPoint {
    pub(super) height: f32,
    pub(super) slopes: [f32; 2],
}

impl Relief {
    pub(super) fn of(texture: &Texture, waves_per_cell: f32) -> Self {
        let is_grain = texture.pattern == Pattern::Grain;
        let per_cell = if is_grain {
            [GRAINS_PER_WAVE * waves_per_cell; 2]
        } else {
            let (north, east) = sin_cos(texture.direction_deg.to_radians());
            [east * waves_per_cell, north * waves_per_cell]
        };
        let seed = hash(texture.seed);
        Self {
            per_cell,
            seed,
            is_grain,
        }
    }

    pub(super) fn at(&self, at: &GridPoint) -> ReliefPoint {
        let ([x, y, _], frac) = (at.cell(), at.frac());
        let [east, north] = self.per_cell;
        let place = [fixed_point(east, x, frac.x), fixed_point(north, y, frac.y)];
        let (height, [along_x, along_y]) = if self.is_grain {
            grain(place, self.seed)
        } else {
            let shift = u64::from(self.seed);
            let phase = place[0].wrapping_add(place[1]).wrapping_add(shift);
            let (height, slope) = wave(phase as u32);
            (height, [slope; 2])
        };
        ReliefPoint {
            height,
            slopes: [along_x * east, along_y * north],
        }
    }
}

/// Returns a coordinate times `per_cell`, in 2⁻³²; the whole part wraps.
fn fixed_point(per_cell: f32, cell: i32, frac: f32) -> u64 {
    const ONE: f32 = 4_294_967_296.0;
    let per_cell = (per_cell * ONE) as i64;
    let part = i64::from((frac * ONE) as u32);
    let (whole, fraction) = (per_cell >> 32, per_cell & 0xFFFF_FFFF);
    let of_cells = i64::from(cell).wrapping_mul(per_cell);
    let of_part = part.wrapping_mul(whole);
    // Both are below 2³².
    let of_fraction = (part as u64 * fraction as u64) >> 32;
    (of_cells.wrapping_add(of_part) as u64).wrapping_add(of_fraction)
}

/// Returns the sine of a phase, where 2³² is a full turn, within 5e-4: its height, and its slope
/// per turn. Height and slope are continuous, and the slope is the exact derivative of the height.
fn wave(phase: u32) -> (f32, f32) {
    const A: f32 = core::f32::consts::FRAC_PI_2;
    // A + B + C = 1 and A + 3 B + 5 C = 0: the slope at the crest is zero.
    const B: f32 = 0.5 * (5.0 - 4.0 * A);
    const C: f32 = 1.0 - A - B;
    const QUARTER: u32 = 1 << 30;
    let turn = phase as i32;
    let (folded, sign) = if turn.unsigned_abs() > QUARTER {
        (i32::MIN.wrapping_sub(turn), -4.0)
    } else {
        (turn, 4.0)
    };
    let x = folded as f32 / QUARTER as f32;
    let s = x * x;
    let height = x * (A + s * (B + s * C));
    (height, sign * (A + s * (3.0 * B + s * (5.0 * C))))
}

/// Interpolates random heights at the corners of square grains: returns the height, and its slopes
/// per grain.
fn grain([x, y]: [u64; 2], seed: u32) -> (f32, [f32; 2]) {
    // Odd, and far from multiples of each other.
    const EAST: u32 = 0x9E37_79B1;
    const NORTH: u32 = 0x85EB_CA77;
    let (col, row) = ((x >> 32) as u32, (y >> 32) as u32);
    let corner = col
        .wrapping_mul(EAST)
        .wrapping_add(row.wrapping_mul(NORTH))
        .wrapping_add(seed);
    let random_height = |east: u32, north: u32| {
        let number = hash(corner.wrapping_add(east).wrapping_add(north));
        number as i32 as f32 / (1_u32 << 31) as f32
    };
    let [sw, se] = [random_height(0, 0), random_height(EAST, 0)];
    let [nw, ne] = [random_height(0, NORTH), random_height(EAST, NORTH)];
    let ((u, steep_u), (v, steep_v)) = (eased(x as u32), eased(y as u32));
    let (south, north) = (mix(sw, se, u), mix(nw, ne, u));
    let along_x = mix(se - sw, ne - nw, v) * steep_u;
    (mix(south, north, v), [along_x, (north - south) * steep_v])
}

/// Returns a smooth step from 0 to 1 with level ends, and its slope.
fn eased(part: u32) -> (f32, f32) {
    let x = (part >> 8) as f32 / (1_u32 << 24) as f32;
    (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x))
}

fn mix(x: f32, y: f32, share: f32) -> f32 {
    x + (y - x) * share
}

/// Returns a hash that is not correlated with its input (Wellons' `lowbias32`).
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7FEB_352D);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846C_A68B);
    x ^ x >> 16
}

#[cfg(test)]
#[path = "relief_tests.rs"]
mod tests;
