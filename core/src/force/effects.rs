//! What a scene adds to the force of the spring.

use glam::Vec3;

use super::{Damper, ForceLaw, Shader};
use crate::contact::Contact;
use crate::rate::TickRate;
use crate::terrain::{TileIndex, Window};

/// The effects of a scene that has some.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effects {
    shader: Option<Shader>,
    pub(crate) damper: Option<Damper>,
}

impl Effects {
    /// Of a scene that is felt with an arm, or with points.
    #[inline(never)]
    pub(crate) fn of(law: &ForceLaw, rate: TickRate, with_arm: bool) -> Option<Self> {
        let shader = Shader::of(law.shading);
        let damper = Damper::of(law, rate, with_arm);
        (shader.is_some() || damper.is_some()).then_some(Self { shader, damper })
    }

    /// What the spring stretches by after a tick of the contact, cells.
    pub(crate) fn displacement<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        contact: &Contact,
    ) -> Vec3 {
        match &mut self.shader {
            Some(shader) => shader.shade(window, contact),
            None => contact.output().displacement,
        }
    }

    /// A tile without which the last displacement is not that of the whole terrain.
    pub(crate) fn missing(&self) -> Option<TileIndex> {
        self.shader.as_ref().and_then(Shader::missing)
    }
}
