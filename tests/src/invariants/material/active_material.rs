//! The active material, by docs/how-to/materials.md: the target, and the linear change to it.

use hapterra_core::contact::{ContactState, Friction};
use hapterra_core::force::Texture;
use hapterra_core::grid::GridPoint;

use crate::invariants::texture::TextureOracle;
use crate::scene::materials::Materials;

/// Ticks of a whole change: 0.1 s.
const CHANGE: u32 = 100;
/// Ticks after which a change is complete: the sum of a hundred rounded steps may leave a tiny
/// rest.
const OVER: u32 = CHANGE + 2;
/// That rest, as a fraction.
const LEFT: f64 = 5e-6;
/// Ticks in which a texture fades out or in.
const FADE: u32 = CHANGE / 2;

/// Numbers that change linearly from one material to the next: stiffness, static, dynamic and
/// viscous friction, damping.
type Numbers = [f64; 5];

/// A possible active material.
#[derive(Clone, Debug)]
pub(super) struct ActiveMaterial {
    /// The class of the target material.
    wanted: u8,
    from: Numbers,
    /// Ticks of the change up to now.
    done: u32,
    numbers: Numbers,
    /// Error bound of the numbers at the start of the change.
    unsure: Numbers,
    /// The texture that is rendered, and its share in units of 1/[`FADE`].
    texture: Texture,
    parts: u32,
    /// Oracle of its texture.
    judge: Option<TextureOracle>,
    /// The share of the texture at this speed.
    speed_share: f64,
    was_rendered: bool,
}

impl ActiveMaterial {
    /// Returns the default material, active before the first contact.
    pub(super) fn default(materials: &Materials) -> Self {
        let numbers = numbers(materials, 0);
        let texture = materials.table[0].texture;
        Self {
            wanted: 0,
            from: numbers,
            done: OVER,
            numbers,
            unsure: [0.0; 5],
            texture,
            parts: FADE,
            judge: judge(&texture, materials.cell_mm),
            speed_share: 0.0,
            was_rendered: false,
        }
    }

    /// Returns the class of the target material.
    pub(super) const fn wanted(&self) -> u8 {
        self.wanted
    }

    /// Returns the stiffness, N/mm.
    pub(super) const fn stiffness(&self) -> f64 {
        self.numbers[0]
    }

    /// Returns the error bound of the stiffness, N/mm.
    pub(super) fn unsure_stiffness(&self) -> f64 {
        self.unsure_numbers()[0]
    }

    fn unsure_numbers(&self) -> Numbers {
        match self.done < OVER {
            true => {
                std::array::from_fn(|i| self.unsure[i] + LEFT * (self.from[i] + self.numbers[i]))
            }
            false => [0.0; 5],
        }
    }

    /// Returns true if friction may hold the proxy in the next tick, also during a change from a
    /// material with friction.
    pub(super) fn may_rub(&self) -> bool {
        let [_, was_static, was_dynamic, was_viscous, _] = self.from;
        let was_rough = was_static + was_dynamic + was_viscous > 0.0;
        !self.friction().is_none() || (self.done < OVER && was_rough)
    }

    /// Returns the damping, N·s/m.
    pub(super) const fn damping(&self) -> f64 {
        self.numbers[4]
    }

    /// Returns the error bound of the damping, N·s/m.
    pub(super) fn unsure_damping(&self) -> f64 {
        self.unsure_numbers()[4]
    }

    /// Returns the friction of the next tick.
    pub(super) fn friction(&self) -> Friction {
        self.friction_of(|i| self.numbers[i])
    }

    /// Returns the smallest and the largest possible friction.
    pub(super) fn frictions(&self) -> [Friction; 2] {
        let unsure = self.unsure_numbers();
        [-1.0, 1.0].map(|sign| self.friction_of(|i| (self.numbers[i] + sign * unsure[i]).max(0.0)))
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
        let share = self.speed_share * f64::from(self.parts) / f64::from(FADE);
        self.judge.as_ref().map(|judge| (judge, share))
    }

    /// Returns true if the change to this material is complete.
    pub(super) fn is_settled(&self) -> bool {
        self.done >= OVER && self.parts == FADE
    }

    /// Returns true if it behaves like another one from now on.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        let reported = |one: &Self| (one.wanted, one.done, one.parts, one.was_rendered);
        let speed = |one: &Self| one.judge.as_ref().map_or(0.0, TextureOracle::speed);
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
        let pairs = |of: fn(&Self) -> &Numbers| of(self).iter().zip(of(other)).all(is_near);
        reported(self) == reported(other)
            && self.texture == other.texture
            && (speed(self) - speed(other)).abs() < 1e-9
            && pairs(|one| &one.numbers)
            && (self.done >= OVER || pairs(|one| &one.from))
    }

    /// Returns the possible materials after another tick with these classes nearest to the proxy:
    /// two of them on the line half way between two samples.
    pub(super) fn after(
        &self,
        materials: &Materials,
        state: ContactState,
        nearest: &[u8],
        proxy: &GridPoint,
    ) -> Vec<Self> {
        let mut after = match state {
            ContactState::Touching => {
                let each = nearest.iter().flat_map(|class| self.on(*class, materials));
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
            if let Some(judge) = &mut one.judge {
                one.speed_share = judge.share(proxy);
            }
        }
        after
    }

    /// Returns the materials after a tick in contact with ground of a class.
    fn on(&self, class: u8, materials: &Materials) -> Vec<Self> {
        let mut next = self.clone();
        if class != self.wanted {
            next.unsure = self.unsure_numbers();
            (next.wanted, next.from, next.done) = (class, self.numbers, 0);
        }
        let wanted = numbers(materials, class);
        let texture = materials.table[usize::from(class)].texture;
        if !self.was_rendered {
            (next.done, next.numbers, next.was_rendered) = (OVER, wanted, true);
            next.takes(&texture, materials.cell_mm, FADE);
            return vec![next];
        }
        next.done = (next.done + 1).min(OVER);
        let share = f64::from(next.done.min(CHANGE)) / f64::from(CHANGE);
        next.numbers = std::array::from_fn(|i| next.from[i] + (wanted[i] - next.from[i]) * share);
        next.fades(&texture, materials.cell_mm)
    }

    /// Fades the old texture out, then the new one in.
    fn fades(mut self, wanted: &Texture, cell_mm: f32) -> Vec<Self> {
        if self.texture == *wanted {
            self.parts = (self.parts + 1).min(FADE);
            return vec![self];
        }
        let is_even = self.texture.pattern == Texture::NONE.pattern;
        let left = self.parts.saturating_sub(1);
        if left > 0 && !is_even {
            self.parts = left;
            return vec![self];
        }
        let mut other = self.clone();
        other.takes(wanted, cell_mm, 0);
        if is_even || self.parts == 0 {
            return vec![other];
        }
        // By rounding of its share, the old texture may have another tick with a share of zero.
        self.parts = 0;
        vec![other, self]
    }

    fn takes(&mut self, texture: &Texture, cell_mm: f32, parts: u32) {
        if self.texture != *texture {
            self.judge = judge(texture, cell_mm);
        }
        (self.texture, self.parts) = (*texture, parts);
    }
}

/// Returns the numbers of a material, with the stiffness scaled to the scene's.
fn numbers(materials: &Materials, class: u8) -> Numbers {
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
fn judge(texture: &Texture, cell_mm: f32) -> Option<TextureOracle> {
    let is_some = texture.pattern != Texture::NONE.pattern;
    is_some.then(|| {
        TextureOracle::new(Texture {
            amplitude_mm: texture.amplitude_mm / cell_mm,
            wavelength_mm: texture.wavelength_mm / cell_mm,
            ..*texture
        })
    })
}
