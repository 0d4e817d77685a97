//! One tick as the oracle sees it, and the tolerances of the checks.

use hapterra_core::Vec3;
use hapterra_core::contact::{ContactOutput, ContactState};
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;

use super::surface::{distance, patches_at};
use crate::scene::terrain::Terrain;
use crate::whole_field::position;

/// Error that is always allowed, cells (docs/explanation/contact.md).
pub const ERROR: f64 = 2e-6;
/// Stretches shorter than this, in cells, tell nothing about a fade.
const SHORT: f64 = 1e-3;
/// The surface parameters that turn displacements into forces; [`CELLS_MM`] are the cell sizes.
pub const PARAMS: SurfaceParams = SurfaceParams::PREMIUM;
/// Millimetres of a cell.
pub const CELLS_MM: [f32; 3] = [1e-3, 1.0, 1e3];

/// One tick as the judge sees it.
#[derive(Clone, Copy, Debug)]
pub struct ObservedTick {
    /// The HIP.
    pub hip: [f64; 3],
    /// The answer.
    pub output: ContactOutput,
    /// The displacement as shading turns it, where there is shading.
    pub shaded: Option<Shaded>,
    /// The same, or the plain displacement, as texture changes it, where there is texture.
    pub textured: Option<Vec3>,
    /// The proxy, where the terrain was made.
    pub proxy: [f64; 3],
    /// The force that the product's surface parameters gives for it, N, by [`CELLS_MM`].
    pub force_n: [[f64; 3]; CELLS_MM.len()],
}

/// Displacement after shading.
#[derive(Clone, Copy, Debug)]
pub struct Shaded {
    /// The displacement, turned.
    pub displacement: Vec3,
    /// True if every sample that it takes was here.
    pub is_whole: bool,
}

/// A place, where the terrain was made.
#[must_use]
pub fn unshifted(point: &GridPoint, shift: [i32; 3]) -> [f64; 3] {
    let at = position(point);
    [0, 1, 2].map(|i| at[i] - f64::from(shift[i]))
}

impl ObservedTick {
    /// A tick over a terrain that lies `shift` cells away.
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

    /// Returns true if the proxy has stayed on the ground where it was in the tick before.
    pub(super) fn stays(&self, before: &Self) -> bool {
        self.is_touching() && before.is_touching() && self.output.proxy == before.output.proxy
    }

    /// Returns the rendered share of the spring; `None` if the spring is too short.
    pub(super) fn edge_fade(&self) -> Option<f64> {
        let whole = distance(self.proxy, self.hip);
        let output = self.output.displacement.as_dvec3().length();
        (self.is_touching() && whole > SHORT).then(|| output / whole)
    }

    /// Error allowed where the height is not in question: the bound, or four
    /// units in the last place of the largest coordinate of the HIP in the
    /// proxy's patch.
    #[must_use]
    pub fn allowed(&self) -> f64 {
        let reach = (0..3).map(|i| (self.proxy[i] - self.hip[i]).abs());
        let largest = reach.fold(1.0, f64::max) + 1.0;
        ERROR.max(4.0 * f64::from(f32::EPSILON) * largest)
    }

    /// Returns the four units in the last place of the corners of the proxy's patches, as height
    /// above the HIP: they are coordinates, too.
    pub(super) fn rounding_of_corners(&self, terrain: &Terrain) -> f64 {
        let [x, y, _] = self.proxy;
        let corners = patches_at(terrain, x, y).flat_map(|patch| patch.corners());
        let highest = corners.fold(0.0, |most, h| (h - self.hip[2]).abs().max(most));
        4.0 * f64::from(f32::EPSILON) * highest
    }

    /// Error allowed in space.
    pub(super) fn allowed_in_space(&self, terrain: &Terrain) -> f64 {
        self.allowed().max(self.rounding_of_corners(terrain))
    }
}
