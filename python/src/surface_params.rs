//! Surfaces.

use hapterra_touch::{
    Damping, Friction, Material, Pattern, Shading, Surface as Touched, SurfaceParams, Texture,
};
use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound, Py, PyResult, Python, pyclass, pymethods};

use crate::refused;

const DEFAULTS: SurfaceParams = SurfaceParams::PREMIUM;
/// The command's defaults of a texture, mm.
const WAVELENGTH_MM: f32 = 1.0;
const MAX_AMPLITUDE_MM: f32 = 0.2;

/// The parameters of a surface, by keyword and checked.
///
/// Parameters
/// ----------
/// stiffness : N/mm between the haptic interface point (HIP) and the proxy, 0 or more; 0.5.
/// max_force : N, the limit of the force, 0 or more; 8.5.
/// friction : Coulomb's coefficient while the proxy slides, 0 to 10; 0, frictionless.
/// static_friction : the same until it begins to slide; as friction.
/// viscous_friction : s, 0 to 1; the delay of the proxy; 0.
/// damping : N·s/m along the force, 0 to 20; 0.
/// shading : "none", with edges between cells, or "smooth", with gradual changes of direction.
/// texture : "none", "grain" or "grating".
/// texture_amplitude : mm above and below the surface, at most 2 and an eighth of the wavelength;
///     a tenth of the wavelength, at most 0.2.
/// texture_wavelength : mm from ridge to ridge, 0.25 to 100; 1.
/// texture_direction : direction across the ridges of a grating, degrees from east to north; 0.
/// texture_seed : selects a variant of the texture; 0.
/// materials : surfaces for the numbers 1, 2, ... of ``Terrain(materials=)``, 15 at most. Their
///     stiffness, friction, damping and texture count; limit and shading are the surface's own.
///
/// Raises
/// ------
/// ValueError
///     With the name of the number that is out of bounds.
#[pyclass(frozen, eq, module = "hapterra")]
#[derive(PartialEq)]
pub(crate) struct Surface {
    pub(crate) surface: Touched,
    others: usize,
}

#[pymethods]
impl Surface {
    #[new]
    #[pyo3(signature = (
        *, stiffness=DEFAULTS.stiffness_n_per_mm, max_force=DEFAULTS.max_force_n,
        friction=DEFAULTS.friction.dynamic_mu, static_friction=None,
        viscous_friction=DEFAULTS.friction.viscous_s, damping=DEFAULTS.damping.ns_per_m,
        shading="none", texture="none", texture_amplitude=None, texture_wavelength=WAVELENGTH_MM,
        texture_direction=0.0, texture_seed=0, materials=Vec::new(),
    ))]
    // One for each keyword of Python.
    #[expect(clippy::too_many_arguments)]
    fn new(
        stiffness: f32,
        max_force: f32,
        friction: f32,
        static_friction: Option<f32>,
        viscous_friction: f32,
        damping: f32,
        shading: &str,
        texture: &str,
        texture_amplitude: Option<f32>,
        texture_wavelength: f32,
        texture_direction: f32,
        texture_seed: u32,
        materials: Vec<Py<Self>>,
    ) -> PyResult<Self> {
        let params = SurfaceParams {
            stiffness_n_per_mm: stiffness,
            max_force_n: max_force,
            friction: Friction {
                static_mu: static_friction.unwrap_or(friction),
                dynamic_mu: friction,
                viscous_s: viscous_friction,
            },
            damping: Damping {
                ns_per_m: damping,
                ..DEFAULTS.damping
            },
            shading: choice("shading", SHADINGS, shading)?,
            texture: match choice("texture", PATTERNS, texture)? {
                Pattern::None => Texture::NONE,
                pattern => Texture {
                    pattern,
                    amplitude_mm: texture_amplitude
                        .unwrap_or((0.1 * texture_wavelength).min(MAX_AMPLITUDE_MM)),
                    wavelength_mm: texture_wavelength,
                    direction_deg: texture_direction,
                    seed: texture_seed,
                },
            },
        };
        let surface = Touched::new(params).map_err(refused)?;
        let others = materials.len();
        if others == 0 {
            return Ok(Self { surface, others });
        }
        let of = |other: &Py<Self>| Material::of(other.get().surface.params());
        let materials: Vec<_> = materials.iter().map(of).collect();
        let surface = surface.with_materials(&materials).map_err(refused)?;
        Ok(Self { surface, others })
    }

    /// Returns the parameters by the names of the constructor, without those of an absent texture,
    /// and the number of materials.
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let params = self.surface.params();
        let dict = PyDict::new(py);
        dict.set_item("stiffness", params.stiffness_n_per_mm)?;
        dict.set_item("max_force", params.max_force_n)?;
        dict.set_item("friction", params.friction.dynamic_mu)?;
        dict.set_item("static_friction", params.friction.static_mu)?;
        dict.set_item("viscous_friction", params.friction.viscous_s)?;
        dict.set_item("damping", params.damping.ns_per_m)?;
        dict.set_item("shading", name(SHADINGS, params.shading))?;
        dict.set_item("texture", name(PATTERNS, params.texture.pattern))?;
        if !params.texture.is_none() {
            dict.set_item("texture_amplitude", params.texture.amplitude_mm)?;
            dict.set_item("texture_wavelength", params.texture.wavelength_mm)?;
            dict.set_item("texture_seed", params.texture.seed)?;
        }
        if params.texture.pattern == Pattern::Grating {
            dict.set_item("texture_direction", params.texture.direction_deg)?;
        }
        dict.set_item("materials", self.others)?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let params = self.surface.params();
        let Friction {
            static_mu,
            dynamic_mu,
            viscous_s,
        } = params.friction;
        let mut text = format!(
            "Surface(stiffness={}, max_force={}, friction={dynamic_mu}, static_friction={static_mu}, \
             viscous_friction={viscous_s}, damping={}, shading='{}', texture='{}'",
            params.stiffness_n_per_mm,
            params.max_force_n,
            params.damping.ns_per_m,
            name(SHADINGS, params.shading),
            name(PATTERNS, params.texture.pattern),
        );
        let texture = &params.texture;
        if !texture.is_none() {
            text += &format!(
                ", texture_amplitude={}, texture_wavelength={}, texture_direction={}, texture_seed={}",
                texture.amplitude_mm, texture.wavelength_mm, texture.direction_deg, texture.seed
            );
        }
        if self.others > 0 {
            text += &format!(", materials=[{} more]", self.others);
        }
        text + ")"
    }
}

type Names<T, const COUNT: usize> = [(&'static str, T); COUNT];

const SHADINGS: Names<Shading, 2> = [("none", Shading::None), ("smooth", Shading::Smooth)];
const PATTERNS: Names<Pattern, 3> = [
    ("none", Pattern::None),
    ("grain", Pattern::Grain),
    ("grating", Pattern::Grating),
];

fn choice<T: Copy, const COUNT: usize>(
    what: &str,
    names: Names<T, COUNT>,
    given: &str,
) -> PyResult<T> {
    let found = names.iter().find(|(name, _)| *name == given);
    found.map(|(_, of)| *of).ok_or_else(|| {
        let names = names.map(|(name, _)| format!("{name:?}")).join(" or ");
        refused(format!("{what} is {given:?}: use {names}"))
    })
}

fn name<T: PartialEq, const COUNT: usize>(names: Names<T, COUNT>, of: T) -> &'static str {
    let found = names.into_iter().find(|(_, it)| *it == of);
    found.map_or("", |(name, _)| name)
}
