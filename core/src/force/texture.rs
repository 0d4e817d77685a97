//! Textures: the micro-relief of a scene.

use serde::{Deserialize, Serialize};

use crate::rate::TickRate;

/// Part of a wavelength that the proxy may go in a tick while the texture is rendered in full.
pub(super) const WHOLE: f32 = 0.125;

/// Pattern of a texture.
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
    /// Its pattern.
    pub pattern: Pattern,
    /// Largest height above and below the surface, device millimetres.
    pub amplitude_mm: f32,
    /// From ridge to ridge on the map, device millimetres; the shortest wavelength of grain,
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
    pub const MAX_AMPLITUDE_MM: f32 = 2.0;
    /// Most of it to a wavelength: it slopes by up to 38°.
    pub const STEEPEST: f32 = 0.125;
    /// Speed up to which a wave has to be rendered in full, mm/s: that of a finger that explores slowly.
    const SLOW_MM_S: f32 = 50.0;
    /// Wavelengths to a cell that places can be counted in.
    const WAVES_PER_CELL: (f32, f32) = (1.0 / 1_048_576.0, 1_048_576.0);

    /// Returns true if the surface is even.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.pattern == Pattern::None
    }

    /// Returns true if its numbers are such that a loop can work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let (shortest, longest) = Self::WAVELENGTHS_MM;
        let most_mm = self.wavelength_mm * Self::STEEPEST;
        self.is_none()
            || (shortest..=longest).contains(&self.wavelength_mm)
                && (0.0..=Self::MAX_AMPLITUDE_MM).contains(&self.amplitude_mm)
                && self.amplitude_mm <= most_mm
                && (-360.0..=360.0).contains(&self.direction_deg)
    }

    /// Returns true if cells of such a size can carry it.
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
