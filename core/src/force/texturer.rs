//! Texture: a micro-relief on the surface, rendered by the force while the proxy stays where it is
//! (Minsky 1990; Ho, Basdogan and Srinivasan 1999).
//!
//! The force is scaled by the relief's addition to the depth, and the relief's slope adds a
//! component along the surface. With fewer than four samples per wave, the rendered wave would be a
//! different one: the texture fades out before that.

use glam::Vec3;

use super::relief::Relief;
use super::texture::{FULL_TEXTURE_SPEED, Texture};
use crate::grid::GridPoint;
use crate::rate::TickRate;
use crate::scalar::{larger, one_over_root, smaller};

/// Share of a wavelength per tick from which the texture is not rendered.
const NO_TEXTURE_SPEED: f32 = 0.25;
/// Limit of the depth times the amplitude, in squares of the wavelength, for the component along
/// the surface: its stiffness is then at most that of the surface, since heights bend by at most 48
/// amplitudes per squared wavelength.
const MAX_DEPTH_RATIO: f32 = 1.0 / 48.0;
/// Speed of a proxy that jumped, or that had no last position, wavelengths a tick.
const JUMP: f32 = 1.0;
/// Decay rate of the speed, 1/s: encoders report a slow hand's speed in jumps.
const SPEED_DECAY_PER_S: f32 = 100.0;

/// The texture of one scene at one rate.
#[derive(Clone, Copy, Debug)]
pub struct Texturer {
    relief: Relief,
    /// Cells.
    amplitude: f32,
    /// Cells.
    max_depth: f32,
    waves_per_cell: f32,
    /// Share of a higher speed that remains after a tick.
    decay: f32,
    /// The proxy's speed, wavelengths a tick.
    speed: f32,
    before: Option<GridPoint>,
}

impl Texturer {
    /// Creates the texturer of a scene with cells of this size; returns `None` without texture, or
    /// if the cells cannot carry it.
    #[must_use]
    pub fn of(texture: &Texture, cell_mm: f32, rate: TickRate) -> Option<Self> {
        if texture.is_none() || !texture.fits(cell_mm) {
            return None;
        }
        let waves_per_cell = cell_mm / texture.wavelength_mm;
        let max_depth_mm = MAX_DEPTH_RATIO
            * texture.wavelength_mm
            * (texture.wavelength_mm / texture.amplitude_mm);
        Some(Self {
            relief: Relief::of(texture, waves_per_cell),
            amplitude: texture.amplitude_mm / cell_mm,
            max_depth: max_depth_mm / cell_mm,
            waves_per_cell,
            decay: 1.0 - SPEED_DECAY_PER_S * rate.tick_s(),
            speed: 0.0,
            before: None,
        })
    }

    /// Returns the displacement of a tick in cells, the extension of the spring, with the texture
    /// at the proxy. Never pulls: along `displacement` the result is not negative.
    ///
    /// ```
    /// use hapterra_core::Vec3;
    /// use hapterra_core::force::{Pattern, Texture, Texturer};
    /// use hapterra_core::grid::GridPoint;
    /// use hapterra_core::rate::TickRate;
    ///
    /// let grating = Texture {
    ///     pattern: Pattern::Grating,
    ///     amplitude_mm: 0.1,
    ///     wavelength_mm: 2.0,
    ///     ..Texture::NONE
    /// };
    /// let mut texturer = Texturer::of(&grating, 1.0, TickRate::DEFAULT).expect("textured");
    /// // A millimetre deep on a crest, a quarter of a wave from the origin.
    /// let crest = GridPoint::new([0; 3], Vec3::X * 0.5);
    /// let last = (0..200).map(|_| texturer.add(Vec3::Z, &crest)).last().expect("ticks");
    /// assert!((last - Vec3::Z * 1.1).length() < 1e-6);
    /// ```
    pub fn add(&mut self, displacement: Vec3, proxy: &GridPoint) -> Vec3 {
        let share = self.share_at(proxy);
        self.with_share(displacement, proxy, share)
    }

    /// Does the same with only a part of the texture, from 0 to 1.
    // Separate, so that a texture that is rendered in full costs no more.
    #[cold]
    #[inline(never)]
    pub(crate) fn add_part(&mut self, displacement: Vec3, proxy: &GridPoint, part: f32) -> Vec3 {
        let share = self.share_at(proxy);
        self.with_share(displacement, proxy, share * part)
    }

    #[inline]
    fn with_share(&self, displacement: Vec3, proxy: &GridPoint, share: f32) -> Vec3 {
        let squared = displacement.length_squared();
        // No force is rendered, or the texture is too fast.
        if !squared.is_normal() || share == 0.0 {
            return displacement;
        }
        let one_over_depth = one_over_root(squared);
        let (depth, normal) = (squared * one_over_depth, displacement * one_over_depth);
        let amplitude = share * self.amplitude;
        let rise = self.relief.at(proxy);
        let [east, north] = rise.slopes;
        let slopes = Vec3::new(east, north, 0.0) * amplitude;
        let along = slopes - normal * slopes.dot(normal);
        let times = 1.0 + amplitude * rise.height / larger(depth, self.amplitude);
        // Because of rounding it might be negative.
        let times = larger(times, 0.0);
        displacement * times - along * smaller(depth, self.max_depth)
    }

    /// Updates the speed with the proxy's place in a tick; returns the rendered share of the
    /// texture.
    fn share_at(&mut self, proxy: &GridPoint) -> f32 {
        let now = match &self.before {
            Some(before) => {
                let displacement = before.to(proxy) * self.waves_per_cell;
                let squared = displacement.x * displacement.x + displacement.y * displacement.y;
                match squared.is_normal() {
                    // A jump is not a speed: limited to a value that decays at once.
                    true => smaller(squared * one_over_root(squared), JUMP),
                    false => 0.0,
                }
            }
            None => JUMP,
        };
        self.before = Some(*proxy);
        // The speed rises at once and falls gradually.
        self.speed = now + larger(0.0, self.speed - now) * self.decay;
        let share = (NO_TEXTURE_SPEED - self.speed) / (NO_TEXTURE_SPEED - FULL_TEXTURE_SPEED);
        let share = share.clamp(0.0, 1.0);
        share * share * (3.0 - 2.0 * share)
    }
}

#[cfg(test)]
#[path = "texturer_tests.rs"]
mod tests;
