//! One HIP in contact with one terrain.

use alloc::vec::Vec;

use hapterra_core::contact::ContactState;
use hapterra_core::force::MaterialTable;
use hapterra_core::grid::{GridPoint, MAX_CELL};
use hapterra_core::guard::Limits;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::terrain::FieldSize;

use crate::checks::TerrainError;
use crate::heights::Unread;
use crate::surface_params::{Surface, SurfaceError};
use crate::terrain::Terrain;
use crate::tick_loop::TickLoop;
use crate::tile_cutter::CutError;

/// Maximum number of ticks in which a force ramps up after a change, at every rate.
const MAX_SETTLING: u32 = 4_096;

/// A haptic interface point (HIP) and its proxy over a terrain: millimetres in, newtons out.
///
/// It runs the device's own loop, fed by points, as `hapterra replay` does: the same path has the
/// same forces, bit for bit. One step is one tick, so speeds (for damping and viscous friction)
/// depend on the tick rate, 1 kHz unless it is set by [`Contact::at_rate`].
///
/// A contact uses 1.5 MB for its window of tiles, for any size of terrain. It can be sent to
/// another thread.
#[doc(alias = "god object")]
#[doc(alias = "god-object")]
#[doc(alias = "virtual proxy")]
#[doc(alias = "haptic rendering")]
pub struct Contact {
    terrain: Terrain,
    tick_loop: TickLoop,
    scene: Scene,
    materials: usize,
    /// Position of the HIP in the last step.
    last: Option<GridPoint>,
}

/// Result of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The force on the hand: east, north, up, N.
    pub force_n: [f32; 3],
    /// The proxy, mm: on the surface during contact, else at the HIP.
    pub proxy_mm: [f64; 3],
    /// State of the proxy.
    pub state: State,
}

/// State of a proxy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum State {
    /// The HIP is in the air, and so is the proxy: no force.
    Free,
    /// The proxy is on the surface, and the HIP below it.
    Touching,
    /// The surface under the proxy has ended, and the last force ramps down.
    Releasing,
    /// The HIP is below the surface and has not been above it yet, so its side is unknown: no force
    /// until it has been above `surface_mm`. A path may begin here, or continue here after a
    /// no-data area or from outside.
    BelowGround {
        /// The height of the surface over the HIP, mm.
        surface_mm: f64,
    },
    /// The HIP is in a no-data area or outside the terrain, and has not been above the surface yet:
    /// no force.
    Outside,
}

/// Reason why a contact cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// The surface does not suit this terrain.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The terrain's heights are invalid.
    #[error(transparent)]
    Terrain(#[from] TerrainError),
    /// The terrain has a material that the surface does not have.
    #[error(
        "the terrain has material {found}, and the surface only {count}, counted from 0: add materials to the surface"
    )]
    Material {
        /// The largest material of the terrain.
        found: u8,
        /// Materials of the surface.
        count: usize,
    },
    /// The loop does not support this tick rate.
    #[error("{0} ticks a second: use 1,000 to 10,000, in whole thousands")]
    Rate(u32),
    /// The loop refuses the scene.
    #[error("the loop refuses the surface on this terrain: report it as a fault of hapterra")]
    Refused,
}

/// Error of a step; the contact is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StepError {
    /// The position is not a number, or too far away.
    #[error("the HIP is at {hip_mm:?} mm: use numbers within {MAX_CELL} cells of {cell_mm} mm")]
    Place {
        /// The position, mm.
        hip_mm: [f64; 3],
        /// Millimetres a cell.
        cell_mm: f64,
    },
    /// Heights could not be read.
    #[error(transparent)]
    Unread(#[from] Unread),
    /// Heights that were read are too steep.
    #[error(
        "neighbouring samples near {east_mm} mm east, {north_mm} mm north differ by more than 10,000 cells: scale the heights down, or make them NaN"
    )]
    Steep {
        /// The HIP, mm east.
        east_mm: f64,
        /// The HIP, mm north.
        north_mm: f64,
    },
    /// The position is too far from the last one.
    #[error("the path to {hip_mm:?} mm requires too many ticks: use smaller steps")]
    Far {
        /// The position, mm.
        hip_mm: [f64; 3],
    },
}

/// A step of a path that was not possible, and the steps before it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("point {} of the path: {why}", done.len())]
pub struct RunError {
    /// The steps before it.
    pub done: Vec<Step>,
    /// The reason.
    pub why: StepError,
}

impl Contact {
    /// Creates a contact at 1,000 steps a second. The first position should be above the terrain.
    ///
    /// # Errors
    /// [`ContactError`] if surface and terrain do not match.
    pub fn new(terrain: Terrain, surface: Surface) -> Result<Self, ContactError> {
        Self::at_rate(terrain, surface, TickRate::DEFAULT.hz())
    }

    /// Creates a contact at another rate, steps a second: 1,000 to 10,000 in whole thousands.
    ///
    /// # Errors
    /// As [`Self::new`], and [`ContactError::Rate`].
    pub fn at_rate(terrain: Terrain, surface: Surface, rate_hz: u32) -> Result<Self, ContactError> {
        let rate = TickRate::new(rate_hz).ok_or(ContactError::Rate(rate_hz))?;
        let scene = scene(&terrain, &surface)?;
        let mut tick_loop = TickLoop::new(rate);
        let accepted = tick_loop.set_scene(scene, surface.table());
        accepted.map_err(|_| ContactError::Refused)?;
        Ok(Self {
            materials: surface.table().map_or(0, |table| table.materials().len()),
            terrain,
            tick_loop,
            scene,
            last: None,
        })
    }

    /// Makes one step with the HIP at a position: east, north, up from the south-west sample at
    /// height zero.
    ///
    /// # Errors
    /// [`StepError`]; the step was not made then.
    pub fn step(&mut self, hip_mm: [f64; 3]) -> Result<Step, StepError> {
        let scale = self.terrain.haptic_scale();
        let hip = scale.to_grid(hip_mm).ok_or(StepError::Place {
            hip_mm,
            cell_mm: scale.cell_mm(),
        })?;
        let sample = self.sample(hip, hip_mm)?;
        let step = Step {
            force_n: sample.force_n.to_array(),
            proxy_mm: scale.to_mm(&sample.proxy),
            state: self.state(&sample, hip_mm),
        };
        self.last = Some(hip);
        Ok(step)
    }

    /// Makes one step for each position of a path.
    ///
    /// # Errors
    /// [`RunError`] at the first step that is not possible, with the steps before it.
    pub fn run(
        &mut self,
        path_mm: impl IntoIterator<Item = [f64; 3]>,
    ) -> Result<Vec<Step>, RunError> {
        let mut done = Vec::new();
        for hip_mm in path_mm {
            match self.step(hip_mm) {
                Ok(step) => done.push(step),
                Err(why) => return Err(RunError { done, why }),
            }
        }
        Ok(done)
    }

    /// Changes the surface between two steps. A proxy in the air or on the ground stays where it
    /// is, and the next step has the force of the new surface. Friction begins at rest; a force
    /// that ramps down ends.
    ///
    /// # Errors
    /// As [`Self::new`]; the surface is unchanged then.
    pub fn set_surface(&mut self, surface: Surface) -> Result<(), ContactError> {
        let next = scene(&self.terrain, &surface)?;
        let hip = self.last.unwrap_or_default();
        let accepted = self.tick_loop.change_surface(next, surface.table(), hip);
        accepted.map_err(|_| ContactError::Refused)?;
        self.scene = next;
        self.materials = surface.table().map_or(0, |table| table.materials().len());
        // The loop restarts. Points at the HIP's last position either show that the proxy is in the
        // air or ramp the force up again. They need only heights that were read before.
        for _ in 0..MAX_SETTLING {
            match self.last.map(|hip| self.sample(hip, [0.0; 3])) {
                Some(Ok(sample)) if sample.limits.contains(Limits::EDGE_FADING) => {}
                _ => break,
            }
        }
        Ok(())
    }

    /// Returns the terrain.
    #[must_use]
    pub const fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    fn sample(&mut self, hip: GridPoint, hip_mm: [f64; 3]) -> Result<TickRecord, StepError> {
        let [east_mm, north_mm, _] = hip_mm;
        let output = self.tick_loop.step(hip, &self.terrain, self.materials);
        match output {
            Ok(Some(sample)) => Ok(sample),
            Ok(None) => Err(StepError::Far { hip_mm }),
            Err(CutError::Unread(unread)) => Err(unread.into()),
            Err(CutError::Step) => Err(StepError::Steep { east_mm, north_mm }),
        }
    }

    fn state(&self, sample: &TickRecord, [east, north, up]: [f64; 3]) -> State {
        match sample.state {
            ContactState::Free => State::Free,
            ContactState::Touching => State::Touching,
            ContactState::Releasing => State::Releasing,
            ContactState::Unseeded => match self.terrain.height_mm(east, north) {
                Some(surface_mm) if up < surface_mm => State::BelowGround { surface_mm },
                _ => State::Outside,
            },
        }
    }
}

/// Creates the loop's scene for a surface on a terrain.
fn scene(terrain: &Terrain, surface: &Surface) -> Result<Scene, ContactError> {
    let cell_mm = terrain.haptic_scale().cell_mm() as f32;
    terrain.check_heights()?;
    surface.check_cells(cell_mm)?;
    let [east, north] = terrain.size();
    let last = terrain.last_material();
    let count = surface.table().map_or(1, |table| table.materials().len());
    if let Some(found) = last.filter(|found| usize::from(*found) >= count) {
        return Err(ContactError::Material { found, count });
    }
    let table = surface.table().filter(|_| last.is_some());
    Ok(Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(east, north),
        top: terrain.top(),
        fallback: None,
        cell_mm,
        home: GridPoint::default(),
        params: *surface.params(),
        source: Source::Points,
        hold_clock: false,
        materials: table.map(MaterialTable::check_sum),
    })
}
