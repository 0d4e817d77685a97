//! One tick as the oracle receives it, and the tolerances of the checks.

use hapterra_core::Vec3;
use hapterra_core::contact::{ContactOutput, ContactState};
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;

use super::surface::{distance, patches_at};
use crate::scene::terrain::Terrain;
use crate::whole_field::position;

/// Error that is always allowed, cells (docs/explanation/contact.md).
pub const ERROR: f64 = 2e-6;
/// Displacements shorter than this, in cells, are too short to check a fade.
const SHORT: f64 = 1e-3;
/// The surface parameters that turn displacements into forces; [`CELLS_MM`] are the cell sizes.
pub const PARAMS: SurfaceParams = SurfaceParams::PREMIUM;
/// Millimetres a cell.
pub const CELLS_MM: [f32; 3] = [1e-3, 1.0, 1e3];

/// One tick as the oracle receives it.
#[derive(Clone, Copy, Debug)]
pub struct ObservedTick {
    /// The HIP.
    pub hip: [f64; 3],
    /// The contact's output.
    pub output: ContactOutput,
    /// The displacement turned by shading, if there is shading.
    pub shaded: Option<Shaded>,
    /// The shaded or plain displacement with texture, if there is texture.
    pub textured: Option<Vec3>,
    /// The proxy, in the terrain's own coordinates.
    pub proxy: [f64; 3],
    /// The force from the product's surface parameters, N, for each of [`CELLS_MM`].
    pub force_n: [[f64; 3]; CELLS_MM.len()],
}

/// Displacement after shading.
#[derive(Clone, Copy, Debug)]
pub struct Shaded {
    /// The displacement, turned.
    pub displacement: Vec3,
    /// True if all samples that it uses were in the window.
    pub is_whole: bool,
}

/// Returns a point in the terrain's own coordinates.
#[must_use]
pub fn unshifted(point: &GridPoint, shift: [i32; 3]) -> [f64; 3] {
    let at = position(point);
    [0, 1, 2].map(|i| at[i] - f64::from(shift[i]))
}

impl ObservedTick {
    /// Creates a tick over a terrain that is shifted by `shift` cells.
    #[must_use]
    pub fn new(hip: [f64; 3], output: ContactOutput, shift: [i32; 3]) -> Self {
        Self {
            hip,
            output,
            shaded: None,
            textured: None,
            proxy: unshifted(&output.proxy, shift),
            force_n: CELLS_MM.map(|cell_mm| {
                let force = PARAMS.spring().force_n(output.displacement * cell_mm);
                force.as_dvec3().to_array()
            }),
        }
    }

    pub(super) fn is_free(&self) -> bool {
        self.output.state == ContactState::Free && self.output.converged
    }

    pub(super) fn is_touching(&self) -> bool {
        self.output.state == ContactState::Touching
    }

    /// Returns true if the proxy has not moved on the ground since the last tick.
    pub(super) fn stays(&self, before: &Self) -> bool {
        self.is_touching() && before.is_touching() && self.output.proxy == before.output.proxy
    }

    /// Returns the rendered share of the spring; `None` if the spring is too short.
    pub(super) fn edge_fade(&self) -> Option<f64> {
        let whole = distance(self.proxy, self.hip);
        let output = self.output.displacement.as_dvec3().length();
        (self.is_touching() && whole > SHORT).then(|| output / whole)
    }

    /// Returns the allowed error if the height is certain: the bound, or four units in the last
    /// place of the HIP's largest coordinate in the proxy's patch.
    #[must_use]
    pub fn allowed(&self) -> f64 {
        let reach = (0..3).map(|i| (self.proxy[i] - self.hip[i]).abs());
        let largest = reach.fold(1.0, f64::max) + 1.0;
        ERROR.max(4.0 * f64::from(f32::EPSILON) * largest)
    }

    /// Returns four units in the last place of the corner heights of the proxy's patches, above the
    /// HIP: they are coordinates as well.
    pub(super) fn rounding_of_corners(&self, terrain: &Terrain) -> f64 {
        let [x, y, _] = self.proxy;
        let corners = patches_at(terrain, x, y).flat_map(|patch| patch.corners());
        let highest = corners.fold(0.0, |max, h| (h - self.hip[2]).abs().max(max));
        4.0 * f64::from(f32::EPSILON) * highest
    }

    /// Returns the allowed error in space.
    pub(super) fn allowed_in_space(&self, terrain: &Terrain) -> f64 {
        self.allowed().max(self.rounding_of_corners(terrain))
    }
}
