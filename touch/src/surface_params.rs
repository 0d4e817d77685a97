//! The parameters of a surface, checked and with its materials.

use core::ops::RangeInclusive;

use hapterra_core::contact::Friction;
use hapterra_core::force::{Damping, Material, MaterialTable, SurfaceParams, Texture};

/// Parameters of a surface: stiffness, limit, friction, damping, shading, texture, and materials if
/// it is not the same everywhere. Checked on creation; all parameters act in every step.
///
/// ```
/// use hapterra_touch::{SurfaceParams, Friction, Shading, Surface};
///
/// let params = SurfaceParams {
///     friction: Friction::coulomb(0.4),
///     shading: Shading::Smooth,
///     ..SurfaceParams::PREMIUM
/// };
/// let surface = Surface::new(params)?;
///
/// let params = SurfaceParams { friction: Friction::coulomb(-1.0), ..params };
/// let error = Surface::new(params).unwrap_err();
/// assert_eq!(error.to_string(), "dynamic friction is -1: use 0 to 10");
/// # Ok::<(), hapterra_touch::SurfaceError>(())
/// ```
#[doc(alias = "stiffness")]
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    params: SurfaceParams,
    /// The surface itself first; empty if there is only one material.
    table: MaterialTable,
}

/// Parameters that a surface cannot have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// A number is out of its bounds.
    #[error("{what} is {value}: use {min} to {max}")]
    Bounds {
        /// Name of the number.
        what: &'static str,
        /// The number.
        value: f32,
        /// The minimum.
        min: f32,
        /// The maximum.
        max: f32,
    },
    /// The static friction is less than the dynamic friction.
    #[error(
        "static friction is {static_mu} and dynamic friction {dynamic_mu}: static friction is never less"
    )]
    Friction {
        /// Coefficient of static friction.
        static_mu: f32,
        /// Coefficient of dynamic friction.
        dynamic_mu: f32,
    },
    /// There are too many materials.
    #[error("{0} materials besides the surface itself: use at most {max}", max = MaterialTable::MAX - 1)]
    Materials(usize),
    /// There are materials, which scale the stiffness, but the stiffness is zero.
    #[error("a surface with materials has a stiffness of 0 N/mm: use more")]
    NoStiffness,
    /// The texture is too fine or too coarse for the terrain's cells.
    #[error(
        "a texture of {wavelength_mm} mm on cells of {cell_mm} mm: a wave is a millionth of a cell to a million cells long"
    )]
    Texture {
        /// Distance from ridge to ridge, mm.
        wavelength_mm: f32,
        /// Millimetres a cell.
        cell_mm: f32,
    },
}

impl Surface {
    /// Creates a surface of these parameters, the same everywhere.
    ///
    /// # Errors
    /// [`SurfaceError`] with the name of the number that is out of bounds.
    pub fn new(params: SurfaceParams) -> Result<Self, SurfaceError> {
        let table = MaterialTable::EMPTY;
        check(&params)?;
        Ok(Self { params, table })
    }

    /// Adds materials to the surface, for a terrain with materials
    /// ([`Terrain::with_materials`](crate::Terrain::with_materials)): the first has the number 1,
    /// and 0 is the surface itself.
    ///
    /// # Errors
    /// [`SurfaceError`].
    pub fn with_materials(self, materials: &[Material]) -> Result<Self, SurfaceError> {
        let mut all = [Material::of(&self.params); MaterialTable::MAX];
        let Some(others) = all.get_mut(1..=materials.len()) else {
            return Err(SurfaceError::Materials(materials.len()));
        };
        others.copy_from_slice(materials);
        for material in materials {
            check(&material.params(&self.params))?;
        }
        if self.params.stiffness_n_per_mm == 0.0 {
            return Err(SurfaceError::NoStiffness);
        }
        let all = all.get(..=materials.len()).unwrap_or(&all);
        // The number of materials was checked: one to the maximum.
        let table = MaterialTable::new(all).unwrap_or(MaterialTable::EMPTY);
        Ok(Self { table, ..self })
    }

    /// Returns the surface's parameters.
    #[must_use]
    pub const fn params(&self) -> &SurfaceParams {
        &self.params
    }

    /// Returns the surface's materials, the surface itself first; `None` if there is only one.
    pub(crate) fn table(&self) -> Option<&MaterialTable> {
        Some(&self.table).filter(|table| !table.materials().is_empty())
    }

    /// Checks that cells of this size can render the surface's textures.
    pub(crate) fn check_cells(&self, cell_mm: f32) -> Result<(), SurfaceError> {
        let materials = self.table.materials().iter();
        let mut textures = materials
            .map(|material| &material.texture)
            .chain([&self.params.texture]);
        match textures.find(|texture| !texture.fits(cell_mm)) {
            None => Ok(()),
            Some(texture) => Err(SurfaceError::Texture {
                wavelength_mm: texture.wavelength_mm,
                cell_mm,
            }),
        }
    }
}

impl Default for Surface {
    /// Returns the surface of [`SurfaceParams::PREMIUM`]: 0.5 N/mm, without friction.
    fn default() -> Self {
        Self {
            params: SurfaceParams::PREMIUM,
            table: MaterialTable::EMPTY,
        }
    }
}

/// Makes the same checks as [`SurfaceParams::is_valid`], and returns the error.
fn check(params: &SurfaceParams) -> Result<(), SurfaceError> {
    let SurfaceParams {
        stiffness_n_per_mm,
        max_force_n,
        friction,
        damping,
        shading: _,
        texture,
    } = params;
    check_range("stiffness, N/mm,", *stiffness_n_per_mm, 0.0..=f32::MAX)?;
    check_range("max_force, N,", *max_force_n, 0.0..=f32::MAX)?;
    check_range("dynamic friction", friction.dynamic_mu, 0.0..=Friction::MAX)?;
    check_range("static friction", friction.static_mu, 0.0..=Friction::MAX)?;
    let max_s = Friction::MAX_VISCOUS_S;
    check_range("viscous friction, s,", friction.viscous_s, 0.0..=max_s)?;
    if friction.static_mu < friction.dynamic_mu {
        return Err(SurfaceError::Friction {
            static_mu: friction.static_mu,
            dynamic_mu: friction.dynamic_mu,
        });
    }
    let max = Damping::MAX_NS_PER_M;
    check_range("damping, N·s/m,", damping.ns_per_m, 0.0..=max)?;
    if texture.is_none() {
        return Ok(());
    }
    let (shortest, longest) = Texture::WAVELENGTHS_MM;
    check_range(
        "texture wavelength, mm,",
        texture.wavelength_mm,
        shortest..=longest,
    )?;
    let steepest_mm = texture.wavelength_mm * Texture::STEEPEST;
    let max_mm = steepest_mm.min(Texture::MAX_AMPLITUDE_MM);
    check_range("texture amplitude, mm,", texture.amplitude_mm, 0.0..=max_mm)?;
    check_range(
        "texture direction, degrees,",
        texture.direction_deg,
        -360.0..=360.0,
    )
}

fn check_range(
    what: &'static str,
    value: f32,
    range: RangeInclusive<f32>,
) -> Result<(), SurfaceError> {
    let (min, max) = range.into_inner();
    // NaN is in no range.
    match (min..=max).contains(&value) {
        true => Ok(()),
        false => Err(SurfaceError::Bounds {
            what,
            value,
            min,
            max,
        }),
    }
}
