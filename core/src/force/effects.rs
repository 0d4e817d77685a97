//! Effects that a scene adds to the force of the spring.

use glam::Vec3;

use super::active_material::ActiveMaterial;
use super::{Damper, EffectContext, MaterialTable, Shader, SurfaceParams, Texturer};
use crate::contact::{Contact, Friction};
use crate::scalar::root;
use crate::terrain::{TileIndex, Window};

/// The effects of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effects {
    shader: Option<Shader>,
    texturer: Option<Texturer>,
    pub(crate) damper: Option<Damper>,
    material: Option<ActiveMaterial>,
    cell_mm: f32,
}

impl Effects {
    /// Creates the effects of a scene without materials; `None` if it has no effects.
    #[inline(never)]
    pub(crate) fn of(params: &SurfaceParams, context: &EffectContext) -> Option<Self> {
        let shader = Shader::of(params.shading);
        let texturer = Texturer::of(&params.texture, context.cell_mm, context.rate);
        let damper = Damper::of(params, context);
        let has_any = shader.is_some() || texturer.is_some() || damper.is_some();
        has_any.then_some(Self {
            shader,
            texturer,
            damper,
            material: None,
            cell_mm: context.cell_mm,
        })
    }

    /// Creates the effects of a scene with materials.
    #[inline(never)]
    pub(crate) fn with_materials(
        table: &MaterialTable,
        params: &SurfaceParams,
        context: &EffectContext,
    ) -> Option<Self> {
        let material = ActiveMaterial::of(table, params, context.cell_mm, context.rate)?;
        let mut damper = Damper::of(&table.hardest(params), context);
        if let Some(damper) = &mut damper {
            damper.set_params(material.params());
        }
        Some(Self {
            shader: Shader::of(params.shading),
            texturer: material.texturer(),
            damper,
            material: Some(material),
            cell_mm: context.cell_mm,
        })
    }

    /// Returns the displacement of the spring after a tick of the contact, cells.
    pub(crate) fn displacement<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        contact: &Contact,
        table: &MaterialTable,
    ) -> Vec3 {
        let displacement = self.shaded(window, contact);
        if self.material.is_some() {
            return self.on_material(window, contact, table, displacement);
        }
        match &mut self.texturer {
            Some(texturer) => texturer.add(displacement, &contact.output().proxy),
            None => displacement,
        }
    }

    /// Returns the contact's displacement, turned by shading as far as the passivity controller
    /// allows.
    fn shaded<const D: usize>(&mut self, window: &Window<'_, D>, contact: &Contact) -> Vec3 {
        let plain = contact.output().displacement;
        let Some(shader) = &mut self.shader else {
            return plain;
        };
        let shaded = shader.shade(window, contact);
        let Some(damper) = self.damper.as_ref().filter(|it| it.created_mj() > 0.0) else {
            return shaded;
        };
        let size = plain.length_squared();
        let share = damper.turn_share(root(size) * self.cell_mm, self.cell_mm);
        if share >= 1.0 {
            return shaded;
        }
        let between = plain + (shaded - plain) * share;
        let squared = between.length_squared();
        // The two are at most 60° apart, so `between` is at least half as long as they are.
        if squared.is_normal() {
            between * root(size / squared)
        } else {
            plain
        }
    }

    /// Returns the displacement on a material, which may have changed since the last tick.
    // Not inlined: scenes without materials do not need it.
    #[cold]
    #[inline(never)]
    fn on_material<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        contact: &Contact,
        table: &MaterialTable,
        displacement: Vec3,
    ) -> Vec3 {
        let Some(material) = &mut self.material else {
            return displacement;
        };
        if material.advance(table, window, contact) {
            self.texturer = material.texturer();
        }
        if let Some(damper) = &mut self.damper {
            damper.set_params(material.params());
        }
        let (proxy, share) = (&contact.output().proxy, material.texture_share());
        match &mut self.texturer {
            Some(texturer) => texturer.add_part(displacement, proxy, share),
            None => displacement,
        }
    }

    /// Returns the rendered surface parameters: the material's, otherwise the scene's.
    pub(crate) fn params<'l>(&'l self, of_scene: &'l SurfaceParams) -> &'l SurfaceParams {
        self.material
            .as_ref()
            .map_or(of_scene, ActiveMaterial::params)
    }

    /// Returns the friction from the next tick on, in a scene with materials.
    pub(crate) fn friction(&self) -> Option<Friction> {
        self.material.as_ref().map(ActiveMaterial::friction)
    }

    /// Returns a tile that was missing for the last displacement, if any.
    pub(crate) fn missing(&self) -> Option<TileIndex> {
        self.shader.as_ref().and_then(Shader::missing)
    }
}

#[cfg(test)]
#[path = "effects_tests.rs"]
mod tests;
