//! Options for the micro-relief of a surface.

use hapterra_core::force::{Pattern, Texture};

use super::recorded::merged;
use crate::cli::failure::{Failure, OrHint};

/// From ridge to ridge where nothing is stated, mm.
const USUAL_WAVELENGTH_MM: f32 = 1.0;
/// Amplitude where nothing is stated: part of the wavelength, and most of it, mm.
const USUAL_PART: f32 = 0.1;
const USUAL_MOST_MM: f32 = 0.2;

/// The micro-relief of a surface.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct SurfaceTexture {
    /// Micro-relief of the surface, felt while the tip moves along it [default: none]
    #[arg(long, value_enum)]
    pub texture: Option<SurfacePattern>,

    /// How far it reaches above and below the surface, at most an eighth of the wavelength
    /// [default: a tenth of the wavelength, at most 0.2]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub texture_amplitude: Option<f32>,

    /// From ridge to ridge in the hand [default: 1]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub texture_wavelength: Option<f32>,

    /// In which direction the ridges of a grating follow each other, from east to north
    /// [default: 0]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub texture_direction: Option<f32>,

    /// Which of the textures that are alike [default: 0]
    #[arg(long, value_name = "N")]
    pub texture_seed: Option<u32>,
}

/// What a texture looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SurfacePattern {
    /// The surface is even
    None,
    /// Heights at random, in all directions
    Grain,
    /// Ridges one after the other
    Grating,
}

impl SurfacePattern {
    const fn pattern(self) -> Pattern {
        match self {
            Self::None => Pattern::None,
            Self::Grain => Pattern::Grain,
            Self::Grating => Pattern::Grating,
        }
    }

    const fn of(pattern: Pattern) -> Self {
        match pattern {
            Pattern::None => Self::None,
            Pattern::Grain => Self::Grain,
            Pattern::Grating => Self::Grating,
        }
    }
}

impl SurfaceTexture {
    /// The texture that is asked for.
    ///
    /// # Errors
    /// Numbers without a texture, or such that no hand could feel or no tick could make.
    pub fn relief(&self) -> Result<Texture, Failure> {
        let pattern = self.texture.map_or(Pattern::None, SurfacePattern::pattern);
        if pattern == Pattern::None {
            return match self.first_number() {
                None => Ok(Texture::NONE),
                Some(number) => Err(format!("{number} of no texture")).or_hint(format!(
                    "add --texture grain or --texture grating, or leave {number} out"
                )),
            };
        }
        if pattern == Pattern::Grain && self.texture_direction.is_some() {
            return Err("--texture-direction of grain, which is alike in all directions")
                .or_hint("leave it out, or choose --texture grating");
        }
        let wavelength_mm = self.texture_wavelength.unwrap_or(USUAL_WAVELENGTH_MM);
        let usual_mm = (USUAL_PART * wavelength_mm).min(USUAL_MOST_MM);
        let texture = Texture {
            pattern,
            amplitude_mm: self.texture_amplitude.unwrap_or(usual_mm),
            wavelength_mm,
            direction_deg: self.texture_direction.unwrap_or(0.0),
            seed: self.texture_seed.unwrap_or(0),
        };
        checked(texture)
    }

    /// The name of the first number that is stated.
    fn first_number(&self) -> Option<&'static str> {
        let stated = [
            (self.texture_amplitude.is_some(), "--texture-amplitude"),
            (self.texture_wavelength.is_some(), "--texture-wavelength"),
            (self.texture_direction.is_some(), "--texture-direction"),
            (self.texture_seed.is_some(), "--texture-seed"),
        ];
        let mut stated = stated.into_iter().filter(|(is_stated, _)| *is_stated);
        stated.next().map(|(_, name)| name)
    }

    /// These options, and where one is missing what a recording says; `told` of those that win.
    pub(super) fn or_recorded(&self, recorded: &Texture, told: &mut Vec<String>) -> Self {
        let is_of = SurfacePattern::of(recorded.pattern);
        let texture = merged("texture", self.texture, is_of, told);
        let stated = Self {
            texture: Some(texture),
            ..self.clone()
        };
        // Nothing of the one is in the other.
        if recorded.is_none() || texture == SurfacePattern::None {
            return stated;
        }
        let Texture {
            amplitude_mm,
            wavelength_mm,
            direction_deg,
            seed,
            ..
        } = *recorded;
        let number =
            |name, stated, recorded, told: &mut _| Some(merged(name, stated, recorded, told));
        Self {
            texture_amplitude: number(
                "texture-amplitude",
                self.texture_amplitude,
                amplitude_mm,
                told,
            ),
            texture_wavelength: number(
                "texture-wavelength",
                self.texture_wavelength,
                wavelength_mm,
                told,
            ),
            texture_direction: match texture {
                SurfacePattern::Grating => number(
                    "texture-direction",
                    self.texture_direction,
                    direction_deg,
                    told,
                ),
                _ => self.texture_direction,
            },
            texture_seed: Some(merged("texture-seed", self.texture_seed, seed, told)),
            ..stated
        }
    }
}

/// A texture whose numbers can be felt and made.
fn checked(texture: Texture) -> Result<Texture, Failure> {
    let Texture {
        amplitude_mm: amplitude,
        wavelength_mm: wavelength,
        direction_deg: direction,
        ..
    } = texture;
    let (shortest, longest) = Texture::WAVELENGTHS_MM;
    if !(shortest..=longest).contains(&wavelength) {
        return Err(format!("a texture with a wavelength of {wavelength} mm")).or_hint(format!(
            "--texture-wavelength from {shortest}, a few encoder counts, to {longest} mm"
        ));
    }
    let most = (wavelength * Texture::STEEPEST).min(Texture::MOST_AMPLITUDE_MM);
    if !(amplitude > 0.0 && amplitude <= most) {
        return Err(format!(
            "a texture of {amplitude} mm with a wavelength of {wavelength} mm"
        ))
        .or_hint(format!(
            "--texture-amplitude above 0 and up to {most} mm: an eighth of the wavelength, and {} mm",
            Texture::MOST_AMPLITUDE_MM
        ));
    }
    texture
        .is_valid()
        .then_some(texture)
        .ok_or_else(|| format!("a grating in the direction {direction}°"))
        .or_hint("--texture-direction from -360 to 360 degrees")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(texture: Option<SurfacePattern>, numbers: [Option<f32>; 3]) -> SurfaceTexture {
        let [texture_amplitude, texture_wavelength, texture_direction] = numbers;
        SurfaceTexture {
            texture,
            texture_amplitude,
            texture_wavelength,
            texture_direction,
            texture_seed: None,
        }
    }

    #[test]
    fn what_is_not_stated_is_as_usual() {
        let none = asked(None, [None; 3]).relief().expect("valid");
        assert!(none.is_none());
        let grain = asked(Some(SurfacePattern::Grain), [None; 3]).relief();
        let grain = grain.expect("valid");
        assert_eq!((grain.amplitude_mm, grain.wavelength_mm), (0.1, 1.0));
        for wavelength in [0.25, 0.3, 7.0, 100.0] {
            let numbers = [None, Some(wavelength), Some(-30.0)];
            let grating = asked(Some(SurfacePattern::Grating), numbers).relief();
            let grating = grating.expect("valid");
            assert!(grating.amplitude_mm <= 0.2 && grating.direction_deg == -30.0);
        }
    }

    #[test]
    fn nonsense_is_refused_with_what_to_do() {
        let (grain, grating) = (Some(SurfacePattern::Grain), Some(SurfacePattern::Grating));
        let bad = [
            (None, [Some(0.1), None, None], "of no texture"),
            (None, [None, Some(1.0), None], "of no texture"),
            (
                Some(SurfacePattern::None),
                [None, None, Some(1.0)],
                "of no texture",
            ),
            (grain, [None, None, Some(10.0)], "of grain"),
            (grain, [Some(-0.1), None, None], "of -0.1 mm"),
            (grain, [Some(0.0), None, None], "of 0 mm"),
            (grain, [Some(f32::NAN), None, None], "of NaN mm"),
            (grain, [Some(0.13), None, None], "of 0.13 mm"),
            (grain, [Some(2.5), Some(50.0), None], "of 2.5 mm"),
            (grain, [None, Some(0.2), None], "wavelength of 0.2 mm"),
            (grain, [None, Some(-1.0), None], "wavelength of -1 mm"),
            (
                grain,
                [None, Some(f32::INFINITY), None],
                "wavelength of inf mm",
            ),
            (grating, [None, None, Some(f32::NAN)], "direction NaN°"),
            (grating, [None, None, Some(400.0)], "direction 400°"),
        ];
        for (pattern, numbers, wanted) in bad {
            let failure = asked(pattern, numbers).relief().expect_err(wanted);
            let lines = failure.text();
            assert!(lines.contains(wanted) && lines.contains("hint"), "{lines}");
        }
        let seed = SurfaceTexture {
            texture_seed: Some(1),
            ..SurfaceTexture::default()
        };
        assert!(seed.relief().is_err());
    }
}
