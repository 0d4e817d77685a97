//! A terrain placed in the workspace of a device's arm.

use hapterra_core::force::SurfaceParams;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;

use super::devices::OneDevice;
use crate::cli::failure::Failure;
use crate::cli::options::placing::TerrainRequest;
use crate::cli::terminal::interrupt;
use crate::cli::terminal::waiting::shown_planning;
use crate::phantom::PlacedTerrain;
use crate::place::Placement;
use crate::terrain::Terrain;

/// Terrain placed in front of an arm.
pub(super) struct InReach<'r> {
    view: Placement,
    terrain: Terrain<'r>,
    arm: Calibration,
}

impl<'r> InReach<'r> {
    /// Places a requested terrain in the workspace of an arm.
    ///
    /// # Errors
    /// The arm cannot reach the heights.
    pub(super) fn of(request: &TerrainRequest<'r>, arm: Calibration) -> Result<Self, Failure> {
        let view = request.view(&arm)?;
        let terrain = view.terrain(request.grid)?;
        Ok(Self { view, terrain, arm })
    }
}

/// A placed terrain, with the arm and the tour of a virtual arm.
pub(super) struct Placed<'t> {
    pub(super) terrain: &'t Terrain<'t>,
    pub(super) view: Placement,
    pub(super) scene: Scene,
    /// Calibration of the arm that touches the terrain.
    pub(super) arm: Calibration,
    pub(super) tour: Option<PlacedTerrain<'t>>,
}

impl<'t> Placed<'t> {
    /// Creates the value, with a tour if the device's arm is virtual; `name` is the terrain's.
    ///
    /// # Errors
    /// No place is suitable for a tour.
    pub(super) fn new(
        device: &OneDevice,
        (name, in_reach): (&str, &'t InReach<'t>),
        params: SurfaceParams,
    ) -> Result<Self, Failure> {
        let (view, terrain) = (in_reach.view, &in_reach.terrain);
        let tour = match device.is_scripted() {
            true => Some(shown_planning(name, terrain.raster(), || {
                PlacedTerrain::in_view(terrain, view.home_mm, params, &|| !interrupt::requested())
            })?),
            false => None,
        };
        Ok(Self {
            terrain,
            view,
            scene: view.scene(terrain, params)?,
            arm: in_reach.arm,
            tour,
        })
    }
}
