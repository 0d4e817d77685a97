//! The parameters of a surface.

use std::mem::MaybeUninit;

use hapterra_touch::{
    Damping, Friction, Material, Pattern, Shading, Surface, SurfaceError, SurfaceParams, Texture,
};

use crate::border::array;
use crate::status::{Failure, HapterraStatus};

/// The normals that the force's direction follows.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapterraShading {
    /// Normals of the cells: the force's direction changes abruptly where two cells meet.
    None = 0,
    /// Normals that change gradually from cell to cell.
    Smooth = 1,
}

/// The pattern of a texture.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HapterraTexture {
    /// None: the surface is smooth.
    None = 0,
    /// Random heights, in all directions.
    Grain = 1,
    /// Parallel ridges.
    Grating = 2,
}

/// The parameters of a surface. Fill it with `hapterra_surface_default`, then change fields; it is
/// checked when it is used. 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapterraSurface {
    /// Stiffness, N/mm; not negative.
    pub stiffness_n_per_mm: f32,
    /// Maximum force, N; not negative.
    pub max_force_n: f32,
    /// Coulomb's coefficient at rest, 0 to 10, not less than the dynamic one.
    pub static_friction: f32,
    /// Coulomb's coefficient while the proxy slides, 0 to 10.
    pub dynamic_friction: f32,
    /// Viscous friction over stiffness, s, 0 to 1.
    pub viscous_friction_s: f32,
    /// Damping along the force, N·s/m, 0 to 20.
    pub damping_ns_per_m: f32,
    /// A value of `HapterraShading`.
    pub shading: u32,
    /// A value of `HapterraTexture`.
    pub texture: u32,
    /// Height of a texture above and below the surface, mm, 0 to 2, and at most an eighth of
    /// its wavelength.
    pub texture_amplitude_mm: f32,
    /// Wavelength of a texture, mm, 0.25 to 100.
    pub texture_wavelength_mm: f32,
    /// Direction across the ridges of a grating, degrees from east to north.
    pub texture_direction_deg: f32,
    /// Seed of a texture: selects a variant of the same pattern.
    pub texture_seed: u32,
}

impl HapterraSurface {
    pub(crate) fn of(params: &SurfaceParams) -> Self {
        Self {
            stiffness_n_per_mm: params.stiffness_n_per_mm,
            max_force_n: params.max_force_n,
            static_friction: params.friction.static_mu,
            dynamic_friction: params.friction.dynamic_mu,
            viscous_friction_s: params.friction.viscous_s,
            damping_ns_per_m: params.damping.ns_per_m,
            shading: match params.shading {
                Shading::None => HapterraShading::None,
                Shading::Smooth => HapterraShading::Smooth,
            } as u32,
            texture: match params.texture.pattern {
                Pattern::None => HapterraTexture::None,
                Pattern::Grain => HapterraTexture::Grain,
                Pattern::Grating => HapterraTexture::Grating,
            } as u32,
            texture_amplitude_mm: params.texture.amplitude_mm,
            texture_wavelength_mm: params.texture.wavelength_mm,
            texture_direction_deg: params.texture.direction_deg,
            texture_seed: params.texture.seed,
        }
    }

    pub(crate) fn params(&self) -> Result<SurfaceParams, Failure> {
        let unknown = |what: &str, number: u32, known: &str| {
            let message = format!("{what} is {number}: use {known}");
            Failure::new(HapterraStatus::Choice, message)
        };
        Ok(SurfaceParams {
            stiffness_n_per_mm: self.stiffness_n_per_mm,
            max_force_n: self.max_force_n,
            friction: Friction {
                static_mu: self.static_friction,
                dynamic_mu: self.dynamic_friction,
                viscous_s: self.viscous_friction_s,
            },
            damping: Damping {
                ns_per_m: self.damping_ns_per_m,
                ..Damping::NONE
            },
            shading: match self.shading {
                0 => Shading::None,
                1 => Shading::Smooth,
                other => return Err(unknown("shading", other, "0 (none) or 1 (smooth)")),
            },
            texture: Texture {
                pattern: match self.texture {
                    0 => Pattern::None,
                    1 => Pattern::Grain,
                    2 => Pattern::Grating,
                    other => {
                        let known = "0 (none), 1 (grain) or 2 (grating)";
                        return Err(unknown("texture", other, known));
                    }
                },
                amplitude_mm: self.texture_amplitude_mm,
                wavelength_mm: self.texture_wavelength_mm,
                direction_deg: self.texture_direction_deg,
                seed: self.texture_seed,
            },
        })
    }
}

impl From<SurfaceError> for Failure {
    fn from(error: SurfaceError) -> Self {
        Self::new(HapterraStatus::Surface, error)
    }
}

/// Fills a surface with the defaults: 0.5 N/mm, 8.5 N, without friction, damping and texture.
/// Returns `HAPTERRA_STATUS_NULL_POINTER` for null.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_surface_default(
    surface: Option<&mut MaybeUninit<HapterraSurface>>,
) -> HapterraStatus {
    let Some(surface) = surface else {
        return HapterraStatus::NullPointer;
    };
    surface.write(HapterraSurface::of(&SurfaceParams::PREMIUM));
    HapterraStatus::Ok
}

/// Creates a surface with its materials.
///
/// # Safety
/// At `surfaces` are `count` values.
pub(crate) unsafe fn surface(
    surfaces: *const HapterraSurface,
    count: usize,
) -> Result<Surface, Failure> {
    // SAFETY: by this function's contract.
    let surfaces = unsafe { array(surfaces, count) }?;
    let Some((first, others)) = surfaces.split_first() else {
        return Err(Failure::new(
            HapterraStatus::Surface,
            "no surface: pass at least one",
        ));
    };
    let surface = Surface::new(first.params()?)?;
    if others.is_empty() {
        return Ok(surface);
    }
    let materials = others
        .iter()
        .map(|other| Ok(Material::of(&other.params()?)));
    let materials = materials.collect::<Result<Vec<_>, Failure>>()?;
    Ok(surface.with_materials(&materials)?)
}
