//! A terrain as it lies in the reach of a device's arm.

use hapterra_core::force::SurfaceParams;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;

use super::devices::OneDevice;
use crate::cli::failure::Failure;
use crate::cli::options::placing::Asked;
use crate::cli::terminal::waiting::shown_reading;
use crate::phantom::PlacedTerrain;
use crate::place::Placement;
use crate::terrain::Terrain;

/// What lies where in front of an arm.
pub(super) struct InReach<'r> {
    view: Placement,
    terrain: Terrain<'r>,
    arm: Calibration,
}

impl<'r> InReach<'r> {
    /// Lays what is asked for into the reach of an arm.
    ///
    /// # Errors
    /// Heights that the arm does not reach.
    pub(super) fn of(asked: &Asked<'r>, arm: Calibration) -> Result<Self, Failure> {
        let view = asked.view(&arm)?;
        let terrain = view.terrain(asked.grid)?;
        Ok(Self { view, terrain, arm })
    }
}

/// The same, how it feels, and how an arm that is virtual moves over it.
pub(super) struct Placed<'t> {
    pub(super) terrain: &'t Terrain<'t>,
    pub(super) view: Placement,
    pub(super) scene: Scene,
    /// Of the arm that feels it.
    pub(super) arm: Calibration,
    pub(super) tour: Option<PlacedTerrain<'t>>,
}

impl<'t> Placed<'t> {
    /// With the tour of a virtual arm, where the device has one; `name` is the terrain's.
    ///
    /// # Errors
    /// No place that a virtual arm could tour.
    pub(super) fn new(
        device: &OneDevice,
        (name, laid): (&str, &'t InReach<'t>),
        params: SurfaceParams,
    ) -> Result<Self, Failure> {
        let (view, terrain) = (laid.view, &laid.terrain);
        let tour = match device.is_scripted() {
            true => Some(shown_reading(name, terrain.raster(), || {
                PlacedTerrain::in_view(terrain, view.home_mm, params)
            })?),
            false => None,
        };
        Ok(Self {
            terrain,
            view,
            scene: view.scene(terrain, params)?,
            arm: laid.arm,
            tour,
        })
    }
}
