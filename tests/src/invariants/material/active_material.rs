//! The active material, by docs/how-to/materials.md: the target, and the linear change to it.

use hapterra_core::contact::{ContactState, Friction};
use hapterra_core::force::Texture;
use hapterra_core::grid::GridPoint;

use crate::invariants::texture::TextureOracle;
use crate::scene::materials::Materials;

/// Ticks of a whole change: 0.1 s.
const CHANGE_TICKS: u32 = 100;
/// Ticks after which a change is complete: the sum of a hundred rounded steps may leave a tiny
/// rest.
const SETTLED_TICKS: u32 = CHANGE_TICKS + 2;
/// That rest, as a fraction.
const REMAINDER: f64 = 5e-6;
/// Ticks in which a texture fades out or in.
const FADE_TICKS: u32 = CHANGE_TICKS / 2;

/// Numbers that change linearly from one material to the next: stiffness, static, dynamic and
/// viscous friction, damping.
type Coefficients = [f64; 5];

/// A possible active material.
#[derive(Clone, Debug)]
pub(super) struct ActiveMaterial {
    /// The class of the target material.
    class: u8,
    from: Coefficients,
    /// Ticks of the change up to now.
    elapsed_ticks: u32,
    coefficients: Coefficients,
    /// Error bound of the numbers at the start of the change.
    uncertainty: Coefficients,
    /// The texture that is rendered, and its share in units of 1/[`FADE_TICKS`].
    texture: Texture,
    fade_ticks: u32,
    /// Oracle of its texture.
    texture_oracle: Option<TextureOracle>,
    /// The share of the texture at this speed.
    speed_share: f64,
    was_rendered: bool,
}

impl ActiveMaterial {
    /// Returns the default material, active before the first contact.
    pub(super) fn default(materials: &Materials) -> Self {
        let coefficients = coefficients(materials, 0);
        let texture = materials.table[0].texture;
        Self {
            class: 0,
            from: coefficients,
            elapsed_ticks: SETTLED_TICKS,
            coefficients,
            uncertainty: [0.0; 5],
            texture,
            fade_ticks: FADE_TICKS,
            texture_oracle: texture_oracle(&texture, materials.cell_mm),
            speed_share: 0.0,
            was_rendered: false,
        }
    }

    /// Returns the class of the target material.
    pub(super) const fn class(&self) -> u8 {
        self.class
    }

    /// Returns the stiffness, N/mm.
    pub(super) const fn stiffness(&self) -> f64 {
        self.coefficients[0]
    }

    /// Returns the error bound of the stiffness, N/mm.
    pub(super) fn stiffness_uncertainty(&self) -> f64 {
        self.total_uncertainty()[0]
    }

    fn total_uncertainty(&self) -> Coefficients {
        match self.elapsed_ticks < SETTLED_TICKS {
            true => std::array::from_fn(|i| {
                self.uncertainty[i] + REMAINDER * (self.from[i] + self.coefficients[i])
            }),
            false => [0.0; 5],
        }
    }

    /// Returns true if friction may hold the proxy in the next tick, also during a change from a
    /// material with friction.
    pub(super) fn may_have_friction(&self) -> bool {
        let [_, was_static, was_dynamic, was_viscous, _] = self.from;
        let was_rough = was_static + was_dynamic + was_viscous > 0.0;
        !self.friction().is_none() || (self.elapsed_ticks < SETTLED_TICKS && was_rough)
    }

    /// Returns the damping, N·s/m.
    pub(super) const fn damping(&self) -> f64 {
        self.coefficients[4]
    }

    /// Returns the error bound of the damping, N·s/m.
    pub(super) fn damping_uncertainty(&self) -> f64 {
        self.total_uncertainty()[4]
    }

    /// Returns the friction of the next tick.
    pub(super) fn friction(&self) -> Friction {
        self.friction_of(|i| self.coefficients[i])
    }

    /// Returns the smallest and the largest possible friction.
    pub(super) fn friction_bounds(&self) -> [Friction; 2] {
        let uncertainty = self.total_uncertainty();
        [-1.0, 1.0].map(|sign| {
            self.friction_of(|i| (self.coefficients[i] + sign * uncertainty[i]).max(0.0))
        })
    }

    fn friction_of(&self, number: impl Fn(usize) -> f64) -> Friction {
        let [static_mu, dynamic_mu, viscous_s] = [1, 2, 3].map(|i| number(i) as f32);
        Friction {
            static_mu: static_mu.max(dynamic_mu),
            dynamic_mu,
            viscous_s,
        }
    }

    /// Returns the texture, if any, and the share of it that is rendered.
    pub(super) fn texture(&self) -> Option<(&TextureOracle, f64)> {
        let share = self.speed_share * f64::from(self.fade_ticks) / f64::from(FADE_TICKS);
        self.texture_oracle
            .as_ref()
            .map(|texture_oracle| (texture_oracle, share))
    }

    /// Returns true if the change to this material is complete.
    pub(super) fn is_settled(&self) -> bool {
        self.elapsed_ticks >= SETTLED_TICKS && self.fade_ticks == FADE_TICKS
    }

    /// Returns true if it behaves like another one from now on.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let reported = |one: &Self| {
            (
                one.class,
                one.elapsed_ticks,
                one.fade_ticks,
                one.was_rendered,
            )
        };
        let speed = |one: &Self| {
            one.texture_oracle
                .as_ref()
                .map_or(0.0, TextureOracle::speed)
        };
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
        let pairs = |of: fn(&Self) -> &Coefficients| of(self).iter().zip(of(other)).all(is_near);
        reported(self) == reported(other)
            && self.texture == other.texture
            && (speed(self) - speed(other)).abs() < 1e-9
            && pairs(|one| &one.coefficients)
            && (self.elapsed_ticks >= SETTLED_TICKS || pairs(|one| &one.from))
    }

    /// Returns the possible materials after another tick with these classes nearest to the proxy:
    /// two of them on the line half way between two samples.
    pub(super) fn successors(
        &self,
        materials: &Materials,
        state: ContactState,
        nearest: &[u8],
        proxy: &GridPoint,
    ) -> Vec<Self> {
        let mut after = match state {
            ContactState::Touching => {
                let each = nearest
                    .iter()
                    .flat_map(|class| self.on_class(*class, materials));
                each.collect()
            }
            // A releasing contact keeps its material.
            ContactState::Releasing => vec![self.clone()],
            ContactState::Unseeded | ContactState::Free => vec![Self {
                was_rendered: false,
                ..self.clone()
            }],
        };
        for one in &mut after {
            if let Some(texture_oracle) = &mut one.texture_oracle {
                one.speed_share = texture_oracle.share(proxy);
            }
        }
        after
    }

    /// Returns the materials after a tick in contact with ground of a class.
    fn on_class(&self, class: u8, materials: &Materials) -> Vec<Self> {
        let mut next = self.clone();
        if class != self.class {
            next.uncertainty = self.total_uncertainty();
            (next.class, next.from, next.elapsed_ticks) = (class, self.coefficients, 0);
        }
        let target = coefficients(materials, class);
        let texture = materials.table[usize::from(class)].texture;
        if !self.was_rendered {
            (next.elapsed_ticks, next.coefficients, next.was_rendered) =
                (SETTLED_TICKS, target, true);
            next.set_texture(&texture, materials.cell_mm, FADE_TICKS);
            return vec![next];
        }
        next.elapsed_ticks = (next.elapsed_ticks + 1).min(SETTLED_TICKS);
        let share = f64::from(next.elapsed_ticks.min(CHANGE_TICKS)) / f64::from(CHANGE_TICKS);
        next.coefficients =
            std::array::from_fn(|i| next.from[i] + (target[i] - next.from[i]) * share);
        next.fade_texture(&texture, materials.cell_mm)
    }

    /// Fades the old texture out, then the new one in.
    fn fade_texture(mut self, target: &Texture, cell_mm: f32) -> Vec<Self> {
        if self.texture == *target {
            self.fade_ticks = (self.fade_ticks + 1).min(FADE_TICKS);
            return vec![self];
        }
        let is_even = self.texture.pattern == Texture::NONE.pattern;
        let remaining = self.fade_ticks.saturating_sub(1);
        if remaining > 0 && !is_even {
            self.fade_ticks = remaining;
            return vec![self];
        }
        let mut other = self.clone();
        other.set_texture(target, cell_mm, 0);
        if is_even || self.fade_ticks == 0 {
            return vec![other];
        }
        // By rounding of its share, the old texture may have another tick with a share of zero.
        self.fade_ticks = 0;
        vec![other, self]
    }

    fn set_texture(&mut self, texture: &Texture, cell_mm: f32, fade_ticks: u32) {
        if self.texture != *texture {
            self.texture_oracle = texture_oracle(texture, cell_mm);
        }
        (self.texture, self.fade_ticks) = (*texture, fade_ticks);
    }
}

/// Returns the numbers of a material, with the stiffness scaled to the scene's.
fn coefficients(materials: &Materials, class: u8) -> Coefficients {
    let table = &materials.table;
    let scale = f64::from(materials.params.stiffness_n_per_mm / table[0].stiffness_n_per_mm);
    let one = &table[usize::from(class)];
    [
        f64::from(one.stiffness_n_per_mm) * scale,
        f64::from(one.friction.static_mu),
        f64::from(one.friction.dynamic_mu),
        f64::from(one.friction.viscous_s),
        f64::from(one.damping_ns_per_m),
    ]
}

/// Returns an oracle of a texture, in cells.
fn texture_oracle(texture: &Texture, cell_mm: f32) -> Option<TextureOracle> {
    let is_some = texture.pattern != Texture::NONE.pattern;
    is_some.then(|| {
        TextureOracle::new(Texture {
            amplitude_mm: texture.amplitude_mm / cell_mm,
            wavelength_mm: texture.wavelength_mm / cell_mm,
            ..*texture
        })
    })
}
