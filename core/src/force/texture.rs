//! Textures: the micro-relief of a scene.

use serde::{Deserialize, Serialize};

use crate::rate::TickRate;

/// Share of a wavelength per tick up to which the texture is rendered in full.
pub(super) const FULL_TEXTURE_SPEED: f32 = 0.125;

/// Pattern of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// The surface has no texture.
    #[default]
    None,
    /// Random heights, alike in all directions.
    Grain,
    /// Parallel ridges.
    Grating,
}

/// The micro-relief of a surface. It is fixed to the terrain, counted from the terrain's origin,
/// and has the stated size in device millimetres at every scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Texture {
    /// Its pattern.
    pub pattern: Pattern,
    /// Maximum height above and below the surface, device millimetres.
    pub amplitude_mm: f32,
    /// Distance between ridges on the map, device millimetres; for grain, the shortest wavelength,
    /// made of rises and falls of half of it.
    pub wavelength_mm: f32,
    /// Direction in which the ridges of a grating follow each other, degrees from east to north.
    pub direction_deg: f32,
    /// Number that selects one of many similar textures; it shifts a grating.
    pub seed: u32,
}

impl Texture {
    /// No texture.
    pub const NONE: Self = Self {
        pattern: Pattern::None,
        amplitude_mm: 0.0,
        wavelength_mm: 0.0,
        direction_deg: 0.0,
        seed: 0,
    };
    /// Valid wavelengths, mm: an encoder count of a Phantom is 0.03 mm at the tip, and must be less
    /// than the part of a wave at which fading begins.
    pub const WAVELENGTHS_MM: (f32, f32) = (0.25, 100.0);
    /// Maximum amplitude, mm.
    pub const MAX_AMPLITUDE_MM: f32 = 2.0;
    /// Maximum amplitude per wavelength: slopes of up to 38°.
    pub const STEEPEST: f32 = 0.125;
    /// Speed up to which a wave must be rendered in full, mm/s: that of a finger that explores
    /// slowly.
    const SLOW_MM_S: f32 = 50.0;
    /// Valid wavelengths per cell: a position can be counted in them.
    const WAVES_PER_CELL: (f32, f32) = (1.0 / 1_048_576.0, 1_048_576.0);

    /// Returns true if there is no texture.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.pattern == Pattern::None
    }

    /// Returns true if all numbers are in their valid ranges.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let (shortest, longest) = Self::WAVELENGTHS_MM;
        let max_mm = self.wavelength_mm * Self::STEEPEST;
        self.is_none()
            || (shortest..=longest).contains(&self.wavelength_mm)
                && (0.0..=Self::MAX_AMPLITUDE_MM).contains(&self.amplitude_mm)
                && self.amplitude_mm <= max_mm
                && (-360.0..=360.0).contains(&self.direction_deg)
    }

    /// Returns true if cells of this size can carry the texture.
    #[must_use]
    pub fn fits(&self, cell_mm: f32) -> bool {
        let (min, max) = Self::WAVES_PER_CELL;
        self.is_none() || (min..=max).contains(&(cell_mm / self.wavelength_mm))
    }

    /// Returns the shortest wavelength, mm, that is rendered in full to a slow hand at a rate.
    #[must_use]
    pub fn shortest_mm(rate: TickRate) -> f32 {
        let by_rate = Self::SLOW_MM_S * rate.tick_s() / FULL_TEXTURE_SPEED;
        by_rate.max(Self::WAVELENGTHS_MM.0)
    }
}
