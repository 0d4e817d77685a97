//! The force with texture, by the formulas of docs/explanation/effects.md, in f64 and integers.

use glam::DVec3;
use hapterra_core::force::{Pattern, Texture};
use hapterra_core::grid::GridPoint;

use super::observed_tick::ObservedTick;

/// A tick of the stress test, s.
const TICK_S: f64 = 1e-3;
/// Rounding, as a fraction of the depth and of the amplitude.
const ROUNDING: f64 = 1e-5;
/// Tolerance against pulling, as a fraction of the depth.
const TANGENTIAL_ROUNDING: f64 = 1e-6;
/// Error bounds of the product's sine and of its slope.
const SINE: f64 = 5e-4;
const SLOPE: f64 = 1e-2;
/// Rounding of grain with heights and slopes of 1.
const GRAIN: f64 = 1e-5;
/// Additional tolerance, as a fraction of the texture's share, due to rounding of a speed.
const SHARE: f64 = 1e-3;
/// Depths whose squares are subnormal have no texture, cells.
const MIN_DEPTH: f64 = 2e-19;
const MAX_DEPTH: f64 = 1e18;

/// Checks the texture of one scene with cells of a millimetre, tick by tick.
#[derive(Clone, Debug)]
pub struct TextureOracle {
    texture: Texture,
    before: Option<GridPoint>,
    /// Wavelengths a tick, decaying.
    speed: f64,
}

/// Contribution of a texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Added {
    /// Addition to the displacement, cells.
    pub(super) expected: DVec3,
    /// Error bound of the displacement, cells.
    pub(super) allowed: f64,
}

/// A texture as it is rendered, cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextureBounds {
    /// Height above and below the surface.
    pub(super) amplitude: f64,
    /// Addition to the depth.
    pub(super) rise: f64,
    /// Largest addition along the surface.
    pub(super) along: f64,
}

/// Verdict on a textured force.
type Verdict = Result<(), String>;

impl TextureOracle {
    /// Creates the oracle before the first tick.
    #[must_use]
    pub const fn new(texture: Texture) -> Self {
        Self {
            texture,
            before: None,
            speed: 0.0,
        }
    }

    /// Checks the next tick.
    ///
    /// # Errors
    /// The error of its force.
    pub fn check(&mut self, observed: &ObservedTick) -> Verdict {
        let share = self.share(&observed.output.proxy);
        let Some(textured) = observed.textured else {
            return Ok(());
        };
        let shaded = observed.shaded.map(|shaded| shaded.displacement);
        let plain = shaded.unwrap_or(observed.output.displacement).as_dvec3();
        let (textured, depth) = (textured.as_dvec3(), plain.length());
        if !(MIN_DEPTH..MAX_DEPTH).contains(&depth) {
            let same = (textured - plain).length() <= MIN_DEPTH;
            return held(same || depth >= MAX_DEPTH, || {
                format!("{textured} of {plain}")
            });
        }
        let normal = plain / depth;
        held(textured.dot(normal) >= -TANGENTIAL_ROUNDING * depth, || {
            format!("{textured} pulls, of {plain}")
        })?;
        let Added { expected, allowed } = self.adds(plain, &observed.output.proxy, share);
        let off = (textured - plain - expected * share).length();
        let reported = || {
            format!(
                "{textured} is {off:e} off {plain} and {share} of {expected}, {allowed:e} may be: {observed:?}"
            )
        };
        // Exact, if the proxy is too fast for any texture.
        let is_gone = (2.0 - 8.0 * self.speed) < -1e-5;
        held(off <= allowed && (!is_gone || textured == plain), reported)
    }

    /// Returns the contribution of the whole texture to a displacement at a point, cells; `share`
    /// only changes the error bound.
    pub(super) fn adds(&self, plain: DVec3, proxy: &GridPoint, share: f64) -> Added {
        let depth = plain.length();
        let normal = plain / depth;
        let (amplitude, wavelength) = self.sizes();
        let (height, slopes) = height_and_slopes(&self.texture, proxy);
        let slopes = slopes - normal * slopes.dot(normal);
        let deepest = wavelength * wavelength / (48.0 * amplitude);
        let output = depth.min(deepest);
        let expected =
            normal * (amplitude * height * (depth / amplitude).min(1.0)) - slopes * output;
        let (high, steep) = match self.texture.pattern {
            Pattern::Grain => (GRAIN, GRAIN),
            _ => (SINE, SLOPE),
        };
        let misplaced = std::f64::consts::TAU / wavelength * self.misplaced(proxy);
        let steepest = std::f64::consts::TAU * amplitude / wavelength;
        let allowed = amplitude.min(depth) * (high + misplaced)
            + output * steepest * (steep + 8.0 * misplaced)
            + SHARE * (amplitude.min(depth) + output * steepest) * f64::from(u8::from(share < 1.0))
            + ROUNDING * depth;
        Added { expected, allowed }
    }

    /// Returns the height and slope of the whole texture at a point and depth, cells.
    pub(super) fn relief(&self, proxy: &GridPoint, depth: f64) -> TextureBounds {
        let (amplitude, wavelength) = self.sizes();
        let (height, slopes) = height_and_slopes(&self.texture, proxy);
        let deepest = wavelength * wavelength / (48.0 * amplitude);
        TextureBounds {
            amplitude,
            rise: amplitude * height * (depth / amplitude).min(1.0),
            along: slopes.length() * depth.min(deepest),
        }
    }

    /// Returns the speed in wavelengths a tick.
    pub(super) const fn speed(&self) -> f64 {
        self.speed
    }

    /// Returns the error of a position, cells: 2⁻²³, or for a turned texture, whose direction is
    /// rounded, the last place of the distance from the origin.
    fn misplaced(&self, at: &GridPoint) -> f64 {
        let [x, y, _] = at.cell().map(|cell| f64::from(cell.unsigned_abs()));
        let is_turned = self.texture.direction_deg != 0.0;
        let cells = if is_turned { x + y } else { 0.0 };
        1.2e-7 * (1.0 + 2.0 * cells)
    }

    fn sizes(&self) -> (f64, f64) {
        (
            f64::from(self.texture.amplitude_mm),
            f64::from(self.texture.wavelength_mm),
        )
    }

    /// Returns the rendered share of a texture at a proxy. The speed in it falls by at most a tenth
    /// a tick.
    pub(super) fn share(&mut self, proxy: &GridPoint) -> f64 {
        let now = self.before.map_or(1.0, |before| {
            let displacement = before.to(proxy).as_dvec3();
            (displacement.x.hypot(displacement.y) / self.sizes().1).min(1.0)
        });
        self.before = Some(*proxy);
        self.speed = now + (self.speed - now).max(0.0) * (1.0 - 100.0 * TICK_S);
        let left = (2.0 - 8.0 * self.speed).clamp(0.0, 1.0);
        left * left * (3.0 - 2.0 * left)
    }
}

fn held(holds: bool, reported: impl Fn() -> String) -> Verdict {
    holds.then_some(()).ok_or_else(reported)
}

/// Returns the height of a texture of amplitude 1 at a point, and the slopes of `texture`.
fn height_and_slopes(texture: &Texture, at: &GridPoint) -> (f64, DVec3) {
    let amplitude = f64::from(texture.amplitude_mm);
    let waves = 1.0 / texture.wavelength_mm;
    let (cell, frac) = (at.cell(), at.frac());
    if texture.pattern == Pattern::Grain {
        let grains = 2.0 * waves;
        let ((col, u), (row, v)) = (
            counted(grains, cell[0], frac.x),
            counted(grains, cell[1], frac.y),
        );
        let corner = |east, north| drawn(col + east, row + north, texture.seed);
        let ((u, steep_u), (v, steep_v)) = (eased(u), eased(v));
        let [sw, se, nw, ne] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        let height = (sw * (1.0 - u) + se * u) * (1.0 - v) + (nw * (1.0 - u) + ne * u) * v;
        let east = ((se - sw) * (1.0 - v) + (ne - nw) * v) * steep_u;
        let north = ((nw - sw) * (1.0 - u) + (ne - se) * u) * steep_v;
        let per_cell = amplitude * f64::from(grains);
        return (height, DVec3::new(east, north, 0.0) * per_cell);
    }
    let angle = f64::from(texture.direction_deg).to_radians();
    let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
    // Rounded once, as in the product.
    let [east, north] = [direction.x, direction.y].map(|part| (part as f32) * waves);
    let seed = f64::from(scrambled(texture.seed)) / 2_f64.powi(32);
    let turns = counted(east, cell[0], frac.x).1 + counted(north, cell[1], frac.y).1 + seed;
    let (sin, cos) = (std::f64::consts::TAU * turns).sin_cos();
    let steepness = amplitude * std::f64::consts::TAU * f64::from(waves) * cos;
    (sin, direction * steepness)
}

/// Returns the integer and fractional part of a coordinate times a number per cell.
fn counted(per_cell: f32, cell: i32, frac: f32) -> (i64, f64) {
    let per_cell = (f64::from(per_cell) * 2_f64.powi(32)) as i128;
    let place = (i128::from(cell) << 30) + (f64::from(frac) * 2_f64.powi(30)) as i128;
    let product = per_cell * place;
    let rest = product & ((1 << 62) - 1);
    ((product >> 62) as i64, rest as f64 / 2_f64.powi(62))
}

fn eased(x: f64) -> (f64, f64) {
    (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x))
}

fn drawn(col: i64, row: i64, seed: u32) -> f64 {
    let corner = (i128::from(col) * 0x9E37_79B1 + i128::from(row) * 0x85EB_CA77) as u32;
    let number = scrambled(corner.wrapping_add(scrambled(seed)));
    f64::from(number as i32) / 2_f64.powi(31)
}

/// Wellons' `lowbias32`.
fn scrambled(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}
