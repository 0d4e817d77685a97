//! Texture: a micro-relief on the surface, felt by the force while the proxy stays where it is
//! (Minsky 1990; Ho, Basdogan and Srinivasan 1999).
//!
//! The force is scaled by as much as the relief adds to the depth, and the relief's slope adds
//! a part along the surface. Where the surface is read less than four times a wave, that would
//! be another wave than the one that is asked for: the texture fades before.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::relief::Relief;
use crate::grid::GridPoint;
use crate::rate::TickRate;
use crate::scalar::{larger, one_over_root, smaller};

/// What a texture looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// The surface is even.
    #[default]
    None,
    /// Heights at random, in all directions.
    Grain,
    /// Ridges one after the other.
    Grating,
}

/// The micro-relief of a surface. It lies fast on the terrain, counted from the terrain's
/// origin, and is as large as stated in the hand at every scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Texture {
    /// What it looks like.
    pub pattern: Pattern,
    /// How far it reaches above and below the surface, hand millimetres.
    pub amplitude_mm: f32,
    /// From ridge to ridge on the map, hand millimetres; the shortest wavelength of grain,
    /// which is made of rises and falls of half of that.
    pub wavelength_mm: f32,
    /// In which direction the ridges of a grating follow each other, degrees from east to north.
    pub direction_deg: f32,
    /// Which of the textures that are alike; it shifts a grating.
    pub seed: u32,
}

impl Texture {
    /// An even surface.
    pub const NONE: Self = Self {
        pattern: Pattern::None,
        amplitude_mm: 0.0,
        wavelength_mm: 0.0,
        direction_deg: 0.0,
        seed: 0,
    };
    /// Wavelengths that a scene may ask for, mm: an encoder count of a Phantom is 0.03 mm at the tip,
    /// and has to be less than the part of a wave with which fading begins.
    pub const WAVELENGTHS_MM: (f32, f32) = (0.25, 100.0);
    /// Most that a texture may reach above the surface, mm.
    pub const MOST_AMPLITUDE_MM: f32 = 2.0;
    /// Most of it to a wavelength: it slopes by up to 38°.
    pub const STEEPEST: f32 = 0.125;
    /// Speed that a wave has to be felt at in whole, mm/s: of a finger that explores slowly.
    const SLOW_MM_S: f32 = 50.0;
    /// Wavelengths to a cell that places can be counted in.
    const WAVES_PER_CELL: (f32, f32) = (1.0 / 1_048_576.0, 1_048_576.0);

    /// Whether the surface is even.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.pattern == Pattern::None
    }

    /// Whether its numbers are such that a loop can work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let (shortest, longest) = Self::WAVELENGTHS_MM;
        let most_mm = self.wavelength_mm * Self::STEEPEST;
        self.is_none()
            || (shortest..=longest).contains(&self.wavelength_mm)
                && (0.0..=Self::MOST_AMPLITUDE_MM).contains(&self.amplitude_mm)
                && self.amplitude_mm <= most_mm
                && (-360.0..=360.0).contains(&self.direction_deg)
    }

    /// Whether cells of such a size can carry it.
    #[must_use]
    pub fn fits(&self, cell_mm: f32) -> bool {
        let (fewest, most) = Self::WAVES_PER_CELL;
        self.is_none() || (fewest..=most).contains(&(cell_mm / self.wavelength_mm))
    }

    /// The shortest wavelength that a slow hand feels in whole at a rate, mm.
    #[must_use]
    pub fn shortest_mm(rate: TickRate) -> f32 {
        let by_rate = Self::SLOW_MM_S * rate.tick_s() / WHOLE;
        by_rate.max(Self::WAVELENGTHS_MM.0)
    }
}

/// Part of a wavelength that the proxy may go in a tick while the texture is felt in whole, and
/// the part from which on nothing of it is.
const WHOLE: f32 = 0.125;
const GONE: f32 = 0.25;
/// The depth, times the amplitude, in squares of the wavelength, beyond which the part along the
/// surface grows no more. So its stiffness is at most that of the surface: heights bend by
/// at most 48 amplitudes a wavelength squared.
const DEEPEST: f32 = 1.0 / 48.0;
/// Speed of a proxy that was elsewhere before, or nowhere, wavelengths a tick.
const JUMP: f32 = 1.0;
/// How fast the speed falls, 1/s: encoders tell a slow hand's speed in jumps.
const FORGETS_PER_S: f32 = 100.0;

/// The texture of one scene at one rate.
#[derive(Clone, Copy, Debug)]
pub struct Texturer {
    relief: Relief,
    /// Cells.
    amplitude: f32,
    /// Cells.
    deepest: f32,
    waves_per_cell: f32,
    /// What a tick leaves of the speed that was above.
    keeps: f32,
    /// The proxy's speed, wavelengths a tick.
    speed: f32,
    before: Option<GridPoint>,
}

impl Texturer {
    /// Of a scene with cells of such a size; one without texture has none, and one with cells
    /// that cannot carry it neither.
    #[must_use]
    pub fn of(texture: &Texture, cell_mm: f32, rate: TickRate) -> Option<Self> {
        if texture.is_none() || !texture.fits(cell_mm) {
            return None;
        }
        let waves_per_cell = cell_mm / texture.wavelength_mm;
        let deepest_mm =
            DEEPEST * texture.wavelength_mm * (texture.wavelength_mm / texture.amplitude_mm);
        Some(Self {
            relief: Relief::of(texture, waves_per_cell),
            amplitude: texture.amplitude_mm / cell_mm,
            deepest: deepest_mm / cell_mm,
            waves_per_cell,
            keeps: 1.0 - FORGETS_PER_S * rate.tick_s(),
            speed: 0.0,
            before: None,
        })
    }

    /// The displacement of a tick in cells, which is also what the spring stretches by, with the
    /// texture at the proxy. Never pulls: along `displacement` the result is not negative.
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
    /// let felt = (0..200).map(|_| texturer.add(Vec3::Z, &crest)).last().expect("ticks");
    /// assert!((felt - Vec3::Z * 1.1).length() < 1e-6);
    /// ```
    pub fn add(&mut self, displacement: Vec3, proxy: &GridPoint) -> Vec3 {
        let share = self.share_at(proxy);
        self.with_share(displacement, proxy, share)
    }

    /// The same with a part of the texture only, from 0 to 1.
    // Apart, so that a texture that is felt whole costs no more.
    #[cold]
    #[inline(never)]
    pub(crate) fn add_part(&mut self, displacement: Vec3, proxy: &GridPoint, part: f32) -> Vec3 {
        let share = self.share_at(proxy);
        self.with_share(displacement, proxy, share * part)
    }

    #[inline]
    fn with_share(&self, displacement: Vec3, proxy: &GridPoint, share: f32) -> Vec3 {
        let squared = displacement.length_squared();
        // Nothing is felt, or the texture is too fast.
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
        // By the last places, it might be below.
        let times = larger(times, 0.0);
        displacement * times - along * smaller(depth, self.deepest)
    }

    /// Takes the proxy's place in a tick; how much of the texture is felt there.
    fn share_at(&mut self, proxy: &GridPoint) -> f32 {
        let now = match &self.before {
            Some(before) => {
                let way = before.to(proxy) * self.waves_per_cell;
                let squared = way.x * way.x + way.y * way.y;
                match squared.is_normal() {
                    // A jump is no speed: it is forgotten as soon as any that is too fast.
                    true => smaller(squared * one_over_root(squared), JUMP),
                    false => 0.0,
                }
            }
            None => JUMP,
        };
        self.before = Some(*proxy);
        // At once where it rises; where it falls, by and by.
        self.speed = now + larger(0.0, self.speed - now) * self.keeps;
        let left = (GONE - self.speed) / (GONE - WHOLE);
        let left = left.clamp(0.0, 1.0);
        left * left * (3.0 - 2.0 * left)
    }
}

#[cfg(test)]
#[path = "texture_tests.rs"]
mod tests;
