//! What a scene adds to the force of the spring.

use glam::Vec3;

use super::{Damper, ForceLaw, Shader, Texturer};
use crate::contact::Contact;
use crate::rate::TickRate;
use crate::terrain::{TileIndex, Window};

/// The effects of a scene that has some.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effects {
    shader: Option<Shader>,
    texturer: Option<Texturer>,
    pub(crate) damper: Option<Damper>,
}

impl Effects {
    /// Of a scene with cells of such a size that is felt with an arm, or with points.
    #[inline(never)]
    pub(crate) fn of(
        law: &ForceLaw,
        cell_mm: f32,
        rate: TickRate,
        latency_s: f32,
        with_arm: bool,
    ) -> Option<Self> {
        let shader = Shader::of(law.shading);
        let texturer = Texturer::of(&law.texture, cell_mm, rate);
        let damper = Damper::of(law, rate, latency_s, with_arm);
        let is_there = shader.is_some() || texturer.is_some() || damper.is_some();
        is_there.then_some(Self {
            shader,
            texturer,
            damper,
        })
    }

    /// What the spring stretches by after a tick of the contact, cells.
    pub(crate) fn displacement<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        contact: &Contact,
    ) -> Vec3 {
        let displacement = match &mut self.shader {
            Some(shader) => shader.shade(window, contact),
            None => contact.output().displacement,
        };
        // A tick that is repeated for the same point is no tick of the proxy's way.
        let goes_on = contact.is_in_lock_step() && self.missing().is_some();
        match &mut self.texturer {
            Some(texturer) if contact.is_felt() && !goes_on => {
                texturer.add(displacement, &contact.output().proxy)
            }
            _ => displacement,
        }
    }

    /// A tile without which the last displacement is not that of the whole terrain.
    pub(crate) fn missing(&self) -> Option<TileIndex> {
        self.shader.as_ref().and_then(Shader::missing)
    }
}
