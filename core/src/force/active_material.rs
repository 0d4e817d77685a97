//! The active material, and the transition from one material to the next.
//!
//! The target is the material of the sample nearest to the proxy. The rendered parameters reach it
//! within [`MATERIAL_CHANGE_S`]: stiffness, damping and friction change by the same amount in each
//! tick, and a texture by its share: the old one fades out in the first half, the new one fades in
//! during the second. A proxy that touches the ground from the air starts with its material at
//! once, because no force was rendered before.

use super::material::{MATERIAL_CHANGE_S, Material, MaterialTable};
use super::{SurfaceParams, Texture, Texturer};
use crate::contact::{Contact, ContactState, Friction};
use crate::rate::TickRate;
use crate::terrain::Window;

/// The rendered material.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ActiveMaterial {
    /// Index of the target material.
    index: u8,
    /// Material when the change began, and the completed share of the change.
    from: Material,
    progress: f32,
    /// Share of a change in one tick.
    step: f32,
    /// Factor on the stiffness.
    scale: f32,
    /// The rendered surface parameters. Their texture is the one that `texture_share` refers to.
    params: SurfaceParams,
    /// Rendered share of that texture.
    texture_share: f32,
    cell_mm: f32,
    rate: TickRate,
    /// True if the proxy touched in the last tick.
    was_rendered: bool,
}

impl ActiveMaterial {
    /// Creates the default material, before anything is rendered.
    pub(crate) fn of(
        table: &MaterialTable,
        params: &SurfaceParams,
        cell_mm: f32,
        rate: TickRate,
    ) -> Option<Self> {
        let scale = table.stiffness_scale(params);
        let default = scaled(table.at(0)?, scale);
        let mut material = Self {
            index: 0,
            from: default,
            progress: 1.0,
            step: rate.tick_s() / MATERIAL_CHANGE_S,
            scale,
            params: *params,
            texture_share: 1.0,
            cell_mm,
            rate,
            was_rendered: false,
        };
        material.set_material(&default);
        material.params.texture = default.texture;
        Some(material)
    }

    /// Returns the rendered surface parameters.
    pub(crate) const fn params(&self) -> &SurfaceParams {
        &self.params
    }

    /// Returns the friction from the next tick on.
    pub(crate) const fn friction(&self) -> Friction {
        self.params.friction
    }

    /// Returns the rendered share of the texture.
    pub(crate) const fn texture_share(&self) -> f32 {
        self.texture_share
    }

    /// Returns a texturer for the rendered texture.
    pub(crate) fn texturer(&self) -> Option<Texturer> {
        Texturer::of(&self.params.texture, self.cell_mm, self.rate)
    }

    /// Advances by one completed tick of a contact. Returns true if another texture is rendered
    /// from now on.
    ///
    /// The material stays the same while the tile of the proxy is missing.
    pub(crate) fn advance<const D: usize>(
        &mut self,
        table: &MaterialTable,
        window: &Window<'_, D>,
        contact: &Contact,
    ) -> bool {
        match contact.output().state {
            ContactState::Touching => {}
            // A contact that fades out keeps its material.
            ContactState::Releasing => return false,
            ContactState::Unseeded | ContactState::Free => {
                self.was_rendered = false;
                return false;
            }
        }
        let there = contact
            .patch()
            .and_then(|patch| window.material_near(patch, &contact.output().proxy));
        if let Some(index) = there
            && index != self.index
        {
            (self.from, self.progress, self.index) = (Material::of(&self.params), 0.0, index);
        }
        let Some(target) = table.at(self.index) else {
            return false;
        };
        let target = &scaled(target, self.scale);
        if core::mem::replace(&mut self.was_rendered, true) {
            self.blend_toward(target)
        } else {
            self.progress = 1.0;
            self.set_material(target);
            self.texture_share = 1.0;
            self.set_texture(&target.texture)
        }
    }

    fn blend_toward(&mut self, target: &Material) -> bool {
        if self.progress < 1.0 {
            self.progress += self.step;
            if self.progress < 1.0 {
                self.set_material(&self.blended_with(target));
            } else {
                self.progress = 1.0;
                self.set_material(target);
            }
        }
        // Fade-out takes half of the time, and fade-in the other half.
        let step = 2.0 * self.step;
        if self.params.texture == target.texture {
            self.texture_share = (self.texture_share + step).min(1.0);
            return false;
        }
        // A surface without texture has nothing to fade out.
        let share = self.texture_share - step;
        if share > 0.0 && !self.params.texture.is_none() {
            self.texture_share = share;
            return false;
        }
        self.texture_share = 0.0;
        self.set_texture(&target.texture)
    }

    /// Returns the material between the start of the change and the target.
    fn blended_with(&self, target: &Material) -> Material {
        let mix = |from: f32, to: f32| from + (to - from) * self.progress;
        let (from, to) = (&self.from, target);
        let dynamic_mu = mix(from.friction.dynamic_mu, to.friction.dynamic_mu);
        let static_mu = mix(from.friction.static_mu, to.friction.static_mu);
        Material {
            stiffness_n_per_mm: mix(from.stiffness_n_per_mm, to.stiffness_n_per_mm),
            friction: Friction {
                // Because of rounding it might be smaller.
                static_mu: static_mu.max(dynamic_mu),
                dynamic_mu,
                viscous_s: mix(from.friction.viscous_s, to.friction.viscous_s),
            },
            damping_ns_per_m: mix(from.damping_ns_per_m, to.damping_ns_per_m),
            texture: to.texture,
        }
    }

    /// Renders all of a material except its texture.
    fn set_material(&mut self, material: &Material) {
        self.params = SurfaceParams {
            texture: self.params.texture,
            ..material.params(&self.params)
        };
    }

    fn set_texture(&mut self, texture: &Texture) -> bool {
        let is_other = self.params.texture != *texture;
        self.params.texture = *texture;
        is_other
    }
}

/// Returns a material of the table, scaled to the stiffness of the scene.
fn scaled(material: &Material, scale: f32) -> Material {
    Material {
        stiffness_n_per_mm: material.stiffness_n_per_mm * scale,
        ..*material
    }
}
