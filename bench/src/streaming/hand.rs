//! The arm that moves along a path: encoder counts for positions of the HIP.

use hapterra::phantom::{ArmFrame, Encoder, PhantomModel};
use hapterra::place::Reach;
use hapterra::terrain::Terrain;
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::GuardInputs;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, Source};

use super::hip_path::HipPaths;
use super::{CELL_MM, MeasureError};

/// Depth of the HIP below the surface, cells: half a millimetre of the tip.
const DEPTH: f64 = 10.0;
/// Height of the HIP above the surface before the first contact, cells.
const ABOVE: f64 = 30.0;

/// Replacement for a late tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LateTile {
    /// None: it is no-data.
    NoData,
    /// The fallback of the whole reach of the arm.
    Fallback,
}

/// A Premium 1.5 whose tip moves exactly along a path.
pub(super) struct Hand {
    model: PhantomModel,
    placement: ArmFrame,
    encoders: [Encoder; 3],
}

impl Hand {
    /// Creates an arm whose tip in the home pose is at the middle of the paths.
    pub(super) fn over(paths: &HipPaths) -> Self {
        let model = PhantomModel::premium_1_5();
        let encoders = std::array::from_fn(|joint| Encoder::new(&model.drive[joint]));
        Self {
            model,
            placement: ArmFrame {
                home_mm: paths.middle().map(|cells| cells * CELL_MM),
            },
            encoders,
        }
    }

    /// Returns the scene of a terrain under this arm.
    ///
    /// # Errors
    /// If the home is beyond the range of positions.
    pub(super) fn scene(
        &self,
        terrain: &Terrain<'_>,
        late_tile: LateTile,
    ) -> Result<Scene, MeasureError> {
        let home = terrain.scale().to_grid(self.placement.home_mm);
        let home = home.ok_or_else(|| MeasureError("it is farther than positions reach".into()))?;
        let scene = Scene {
            hold_clock: false,
            materials: None,
            ..terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home)
        };
        Ok(match late_tile {
            LateTile::NoData => scene,
            LateTile::Fallback => {
                let reach = Reach::of(&Calibration::PREMIUM_1_5);
                terrain.with_fallback(scene, reach.sides_mm())
            }
        })
    }

    /// Returns the inputs with the HIP below a point of the surface.
    ///
    /// # Errors
    /// If the arm does not reach it.
    pub(super) fn below(&self, place: [f64; 3]) -> Result<GuardInputs, MeasureError> {
        self.inputs(place, -DEPTH)
    }

    /// Returns the inputs with the HIP above a point of the surface.
    ///
    /// # Errors
    /// If the arm does not reach it.
    pub(super) fn above(&self, place: [f64; 3]) -> Result<GuardInputs, MeasureError> {
        self.inputs(place, ABOVE)
    }

    fn inputs(
        &self,
        [east, north, height]: [f64; 3],
        up: f64,
    ) -> Result<GuardInputs, MeasureError> {
        let at_mm = [east, north, height + up].map(|cells| cells * CELL_MM);
        let joints = self.placement.joints_at(&self.model, at_mm);
        let joints = joints.map_err(|error| MeasureError(error.to_string()))?;
        Ok(GuardInputs {
            counts: std::array::from_fn(|joint| self.encoders[joint].counts(joints[joint])),
            ..GuardInputs::default()
        })
    }
}
