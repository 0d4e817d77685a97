//! The micro-relief of a surface, from a table's numbers.

use hapterra_core::force::{Pattern, Texture};

use super::table::{MaterialEntry, TextureName};

/// Default distance between ridges, mm.
const DEFAULT_WAVELENGTH_MM: f32 = 1.0;
/// Default amplitude: a fraction of the wavelength, and its maximum, mm.
const DEFAULT_AMPLITUDE_SHARE: f32 = 0.1;
const MAX_DEFAULT_AMPLITUDE_MM: f32 = 0.2;

/// Returns a material's texture, based on the default's. A stated pattern replaces all numbers.
///
/// # Errors
/// Numbers without a texture, or numbers too small to feel or too large to render.
pub(super) fn texture(entry: &MaterialEntry, default: &Texture) -> Result<Texture, String> {
    let pattern = entry
        .texture
        .map_or(default.pattern, |texture| match texture {
            TextureName::None => Pattern::None,
            TextureName::Grain => Pattern::Grain,
            TextureName::Grating => Pattern::Grating,
        });
    if pattern == Pattern::None {
        return match first_number(entry) {
            None => Ok(Texture::NONE),
            Some(number) => Err(format!(
                "{number} of no texture: add texture = \"grain\" or \"grating\", or leave it out"
            )),
        };
    }
    if pattern == Pattern::Grain && entry.texture_direction.is_some() {
        return Err(
            "texture_direction of grain, which is alike in all directions: leave it out, or choose texture = \"grating\""
                .to_owned(),
        );
    }
    let inherited = entry.texture.is_none().then_some(default);
    let wavelength_mm = entry.texture_wavelength;
    let wavelength_mm = wavelength_mm.or(inherited.map(|it| it.wavelength_mm));
    let wavelength_mm = wavelength_mm.unwrap_or(DEFAULT_WAVELENGTH_MM);
    let amplitude_mm = entry.texture_amplitude;
    let amplitude_mm = amplitude_mm.or(inherited.map(|it| it.amplitude_mm));
    let direction_deg = entry.texture_direction;
    let direction_deg = direction_deg.or(inherited.map(|it| it.direction_deg));
    let seed = entry.texture_seed.or(inherited.map(|it| it.seed));
    checked(Texture {
        pattern,
        amplitude_mm: amplitude_mm
            .unwrap_or((DEFAULT_AMPLITUDE_SHARE * wavelength_mm).min(MAX_DEFAULT_AMPLITUDE_MM)),
        wavelength_mm,
        direction_deg: direction_deg.unwrap_or(0.0),
        seed: seed.unwrap_or(0),
    })
}

/// Returns the name of the first stated number.
fn first_number(entry: &MaterialEntry) -> Option<&'static str> {
    let numbers = [
        (entry.texture_amplitude.is_some(), "texture_amplitude"),
        (entry.texture_wavelength.is_some(), "texture_wavelength"),
        (entry.texture_direction.is_some(), "texture_direction"),
        (entry.texture_seed.is_some(), "texture_seed"),
    ];
    let mut numbers = numbers.into_iter().filter(|(is_stated, _)| *is_stated);
    numbers.next().map(|(_, name)| name)
}

/// Returns a texture if it is perceptible and can be rendered.
fn checked(texture: Texture) -> Result<Texture, String> {
    let Texture {
        amplitude_mm: amplitude,
        wavelength_mm: wavelength,
        direction_deg: direction,
        ..
    } = texture;
    let (shortest, longest) = Texture::WAVELENGTHS_MM;
    if !(shortest..=longest).contains(&wavelength) {
        return Err(format!(
            "a texture with a wavelength of {wavelength} mm: texture_wavelength from {shortest}, a few encoder counts, to {longest} mm"
        ));
    }
    let max = (wavelength * Texture::STEEPEST).min(Texture::MAX_AMPLITUDE_MM);
    if !(amplitude > 0.0 && amplitude <= max) {
        return Err(format!(
            "a texture of {amplitude} mm with a wavelength of {wavelength} mm: texture_amplitude above 0 and up to {max} mm, which is an eighth of the wavelength, and {} mm at most",
            Texture::MAX_AMPLITUDE_MM
        ));
    }
    texture.is_valid().then_some(texture).ok_or_else(|| {
        format!(
            "a grating in the direction {direction}°: texture_direction from -360 to 360 degrees"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture_with(
        texture: Option<TextureName>,
        numbers: [Option<f32>; 3],
    ) -> Result<Texture, String> {
        let [texture_amplitude, texture_wavelength, texture_direction] = numbers;
        let entry = MaterialEntry {
            texture,
            texture_amplitude,
            texture_wavelength,
            texture_direction,
            ..MaterialEntry::default()
        };
        super::texture(&entry, &Texture::NONE)
    }

    #[test]
    fn unset_texture_options_use_defaults() {
        assert_eq!(texture_with(None, [None; 3]), Ok(Texture::NONE));
        let grain = texture_with(Some(TextureName::Grain), [None; 3]).expect("valid");
        assert_eq!((grain.amplitude_mm, grain.wavelength_mm), (0.1, 1.0));
        for wavelength in [0.25, 0.3, 7.0, 100.0] {
            let numbers = [None, Some(wavelength), Some(-30.0)];
            let grating = texture_with(Some(TextureName::Grating), numbers).expect("valid");
            assert!(grating.amplitude_mm <= 0.2 && grating.direction_deg == -30.0);
        }
    }

    #[test]
    fn class_texture_inherits_unstated_numbers() {
        let numbers = [Some(0.1), Some(1.5), Some(20.0)];
        let default = texture_with(Some(TextureName::Grating), numbers).expect("valid");
        let higher = MaterialEntry {
            texture_amplitude: Some(0.15),
            ..MaterialEntry::default()
        };
        let texture = super::texture(&higher, &default).expect("valid");
        let amplitude_mm = 0.15;
        assert_eq!(
            texture,
            Texture {
                amplitude_mm,
                ..default
            }
        );
        let other = MaterialEntry {
            texture: Some(TextureName::Grain),
            ..MaterialEntry::default()
        };
        let texture = super::texture(&other, &default).expect("valid");
        assert_eq!((texture.wavelength_mm, texture.direction_deg), (1.0, 0.0));
    }

    #[test]
    fn invalid_texture_is_refused_with_a_remedy() {
        let (grain, grating) = (Some(TextureName::Grain), Some(TextureName::Grating));
        let bad = [
            (None, [Some(0.1), None, None], "of no texture"),
            (None, [None, Some(1.0), None], "of no texture"),
            (
                Some(TextureName::None),
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
        for (pattern, numbers, expected) in bad {
            let why = texture_with(pattern, numbers).expect_err(expected);
            assert!(why.contains(expected) && why.contains(": "), "{why}");
        }
    }
}
