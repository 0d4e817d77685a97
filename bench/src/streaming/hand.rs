//! The arm that is moved along a way: encoder counts for places of the HIP.

use hapterra::phantom::{Encoder, PhantomModel, Placement};
use hapterra_core::guard::Sense;

use super::way::Ways;
use super::{CELL_MM, NotMeasured};

/// Depth of the HIP below the surface, cells: half a millimetre of the tip.
const DEPTH: f64 = 10.0;
/// Height of the HIP above the surface before the first contact, cells.
const ABOVE: f64 = 30.0;

/// A Premium 1.5 whose tip is led exactly where it is to be.
pub(super) struct Hand {
    model: PhantomModel,
    placement: Placement,
    encoders: [Encoder; 3],
}

impl Hand {
    /// An arm with the middle of the ways at the tip in its home pose.
    pub(super) fn over(ways: &Ways) -> Self {
        let model = PhantomModel::premium_1_5();
        let encoders = std::array::from_fn(|joint| Encoder::new(&model.drive[joint]));
        Self {
            model,
            placement: Placement {
                home_mm: ways.middle().map(|cells| cells * CELL_MM),
            },
            encoders,
        }
    }

    /// Where the tip is in the home pose, mm of the terrain.
    pub(super) const fn home_mm(&self) -> [f64; 3] {
        self.placement.home_mm
    }

    /// What the encoders read with the HIP below a place on the surface.
    ///
    /// # Errors
    /// When the arm does not reach it.
    pub(super) fn below(&self, place: [f64; 3]) -> Result<Sense, NotMeasured> {
        self.sense(place, -DEPTH)
    }

    /// The same above it.
    ///
    /// # Errors
    /// When the arm does not reach it.
    pub(super) fn above(&self, place: [f64; 3]) -> Result<Sense, NotMeasured> {
        self.sense(place, ABOVE)
    }

    fn sense(&self, [east, north, height]: [f64; 3], up: f64) -> Result<Sense, NotMeasured> {
        let at_mm = [east, north, height + up].map(|cells| cells * CELL_MM);
        let joints = self.placement.joints_at(&self.model, at_mm);
        let joints = joints.map_err(|error| NotMeasured(error.to_string()))?;
        Ok(Sense {
            counts: std::array::from_fn(|joint| self.encoders[joint].counts(joints[joint])),
            ..Sense::default()
        })
    }
}
