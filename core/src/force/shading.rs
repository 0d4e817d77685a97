//! Force shading: the force turns gradually from patch to patch, while the proxy stays where it is
//! (Morgenbesser and Srinivasan 1996).
//!
//! The whole force is turned, from the contact's normal to the normal of the smoothed slopes
//! (`slopes`), and keeps its size. Without friction it then points along the smoothed normal; the
//! friction part is turned with it.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::slopes::{Slopes, SlopesAt};
use crate::contact::{Contact, ContactState};
use crate::scalar::one_over_root;
use crate::terrain::{TileIndex, Window};

/// Choice of the normals that the force follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(rename_all = "lowercase")]
pub enum Shading {
    /// Normals of the patches: an edge between patches is rendered as an edge.
    #[default]
    None,
    /// Normals that turn gradually over the edges between patches.
    Smooth,
}

impl Shading {
    /// Returns true if there is no shading.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }
}

/// The shading of a scene: the turn of the force, and a missing tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shader {
    /// Turn of the last contact; a force that fades out where the surface ends keeps it.
    turn: Turn,
    /// The missing tile without which the last tick's turn may be wrong.
    missing: Option<TileIndex>,
}

impl Shader {
    /// Creates the shader of a scene; `None` without shading.
    #[must_use]
    pub fn of(shading: Shading) -> Option<Self> {
        (shading == Shading::Smooth).then(Self::default)
    }

    /// Returns the displacement of the contact's last tick in cells, turned; its length stays the
    /// same within rounding.
    ///
    /// ```
    /// use hapterra_core::Vec3;
    /// use hapterra_core::contact::{Contact, ContactSettings};
    /// use hapterra_core::force::{Shader, Shading};
    /// use hapterra_core::grid::GridPoint;
    /// use hapterra_core::terrain::{FieldSize, TileArena};
    ///
    /// // A valley of two slopes that meet in column 20.
    /// let size = FieldSize::new(40, 40);
    /// let mut field = TileArena::<2>::from_fn(size, |x, _| 0.5 * (x - 20).abs() as f32)?;
    /// let window = field.window();
    /// let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    /// let mut shader = Shader::of(Shading::Smooth).expect("smooth");
    /// for height in [1.0, 0.0] {
    ///     contact.step(&window, &GridPoint::new([20, 20, 0], Vec3::new(0.1, 0.5, height)));
    /// }
    /// // A tenth of a cell east of the bottom, the west component is less than a fifth of the
    /// // plain one.
    /// let (plain, shaded) = (contact.output().displacement, shader.shade(&window, &contact));
    /// assert!((shaded.length() - plain.length()).abs() < 1e-6);
    /// assert!(shaded.x.abs() < 0.2 * plain.x.abs());
    /// # Ok::<(), hapterra_core::terrain::FieldError>(())
    /// ```
    pub fn shade<const D: usize>(&mut self, window: &Window<'_, D>, contact: &Contact) -> Vec3 {
        let output = contact.output();
        self.missing = None;
        if output.state == ContactState::Touching
            && let Some(slopes) = SlopesAt::point(window, &output.proxy)
        {
            let normal = output.displacement - contact.friction_displacement();
            self.turn = Turn::between(slopes_facing(&slopes, normal), slopes.smoothed);
            self.missing = slopes.missing;
        }
        self.turn.of(output.displacement)
    }

    /// Returns a missing tile without which the last turn may be wrong.
    #[must_use]
    pub const fn missing(&self) -> Option<TileIndex> {
        self.missing
    }
}

/// Returns the slopes whose normal a force points along: those of the patch, or between those of
/// the patches that meet.
fn slopes_facing(slopes: &SlopesAt, force: Vec3) -> Slopes {
    let SlopesAt { east, north, .. } = slopes;
    // Upward, or nearly level.
    let up = if force.z > 0.0 {
        force.z
    } else {
        f32::MIN_POSITIVE
    };
    // Not `f32::clamp`, which may panic.
    let along = |component: f32, [min, max]: [f32; 2]| match -component / up {
        slope if slope < min => min,
        slope if slope > max => max,
        slope => slope,
    };
    [along(force.x, *east), along(force.y, *north)]
}

/// Cosine and sine of the maximum turn of a force: 60°. A bend of 120° is rendered smoothly.
const MAX_COS: f32 = 0.5;
const MAX_SIN: f32 = 0.866_025_4;

/// The shortest turn from one direction to another: `cos` of its angle, and the axis times
/// its `sin`.
#[derive(Clone, Copy, Debug)]
struct Turn {
    cos: f32,
    axis: Vec3,
}

impl Default for Turn {
    fn default() -> Self {
        let (cos, axis) = (1.0, Vec3::ZERO);
        Self { cos, axis }
    }
}

impl Turn {
    /// Creates the turn from the normal of some slopes to that of others, 60° at most: beyond a
    /// right angle the force would pull.
    fn between(from: Slopes, to: Slopes) -> Self {
        if from == to {
            return Self::default();
        }
        let (from, to) = (normal(from), normal(to));
        let (cos, axis) = (from.dot(to), from.cross(to));
        if cos >= MAX_COS {
            return Self { cos, axis };
        }
        let squared = axis.length_squared();
        // Beside spikes, where the two normals are nearly opposite.
        if !squared.is_normal() {
            return Self::default();
        }
        Self {
            cos: MAX_COS,
            axis: axis * (MAX_SIN * one_over_root(squared)),
        }
    }

    /// Returns a vector, turned.
    fn of(&self, v: Vec3) -> Vec3 {
        let along = self.axis.dot(v) / (1.0 + self.cos);
        v * self.cos + self.axis.cross(v) + self.axis * along
    }
}

/// Returns the upward normal, of length 1.
fn normal([east, north]: Slopes) -> Vec3 {
    let up = one_over_root(1.0 + east * east + north * north);
    Vec3::new(-east * up, -north * up, up)
}

#[cfg(test)]
#[path = "shading_tests.rs"]
mod tests;
