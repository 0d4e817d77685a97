//! An armed arm over the middle of a terrain, and paths of its tip.

use std::fmt;

use hapterra::phantom::{ArmFrame, Encoder, PhantomModel};
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::{GuardInputs, Mode};
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_core::scene::Source;
use hapterra_core::terrain::Tile;
use hapterra_core::tick::{Command, Haptics, Outcome};

use super::effect_tick::EffectTick;
use super::replay::{self, WINDOW};
use super::vector::Vector;
use crate::grid::Grid;
use crate::path::Random;
use crate::variant::Hip;

/// Reason why a terrain cannot be measured: it is too small, or the arm does not reach it.
#[derive(Clone, Debug)]
pub struct MeasureError(pub(crate) String);

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for MeasureError {}

/// Largest distance from home, mm.
const MAX_DISTANCE_MM: f64 = 40.0;
/// Cells kept free at the border of the field.
const MARGIN_CELLS: f64 = 4.0;
/// Height at the start of a path, mm, and ticks of its descent.
const START_HEIGHT_MM: f64 = 2.0;
const DESCENT_TICKS: usize = 50;
/// Ticks after which arming is complete.
const MAX_ARMING_TICKS: usize = 6000;

/// An arm over the middle of a terrain.
pub(super) struct Arm<'g> {
    pub(super) grid: &'g Grid,
    pub(super) model: PhantomModel,
    pub(super) placement: ArmFrame,
}

/// A position of the tip, mm over the terrain, with its encoder counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct TipPosition {
    pub(super) tip_mm: Vector,
    pub(super) counts: [i32; 3],
}

/// A path of the tip that starts and ends above the same point: over the ground, and back.
pub(super) struct TipPath {
    pub(super) name: &'static str,
    pub(super) descent: Vec<TipPosition>,
    /// The compared positions.
    pub(super) over_ground: Vec<TipPosition>,
}

impl<'g> Arm<'g> {
    /// Creates an arm with the home pose close to the surface.
    pub(super) fn over(grid: &'g Grid) -> Self {
        let [x, y] = [grid.columns, grid.rows].map(|side| 0.5 * side as f64);
        Self {
            grid,
            model: PhantomModel::premium_1_5(),
            placement: ArmFrame {
                home_mm: [x, y, grid.height(x, y).floor()],
            },
        }
    }

    /// Returns a slide 0.4 mm deep at 50 mm/s.
    pub(super) fn slide(&self, ticks: usize) -> Result<TipPath, MeasureError> {
        self.there_and_back("arm slides 0.05", 0.05, ticks, |_| -0.4)
    }

    /// Returns taps of half a millimetre every 100 ticks on a slow path.
    pub(super) fn tap(&self, ticks: usize) -> Result<TipPath, MeasureError> {
        let phase = |tick: usize| tick as f64 * (std::f64::consts::TAU / 100.0);
        self.there_and_back("arm taps", 0.02, ticks, |tick| 0.5 * phase(tick).cos())
    }

    /// Returns a path of `step` mm a tick at this height, for half of the ticks, and back.
    fn there_and_back(
        &self,
        name: &'static str,
        step: f64,
        ticks: usize,
        height: impl Fn(usize) -> f64,
    ) -> Result<TipPath, MeasureError> {
        let mut random = Random(21);
        let (mut offset, mut heading) = ([0.0; 2], 0.3_f64);
        let sides = [self.grid.columns, self.grid.rows];
        let reach = sides.map(|side| 0.5 * side as f64 - MARGIN_CELLS);
        let reach = reach.into_iter().fold(MAX_DISTANCE_MM, f64::min);
        let mut over_ground = Vec::with_capacity(ticks);
        for tick in 0..ticks.div_ceil(2) {
            over_ground.push(self.above(offset, height(tick))?);
            heading += random.between(-0.05, 0.05);
            if f64::hypot(offset[0], offset[1]) > reach - 1.0 {
                heading = f64::atan2(-offset[1], -offset[0]);
            }
            offset = [
                offset[0] + step * heading.cos(),
                offset[1] + step * heading.sin(),
            ];
        }
        let begin = height(0);
        let descent = (0..DESCENT_TICKS).map(|i| {
            let part = i as f64 / DESCENT_TICKS as f64;
            self.above([0.0; 2], START_HEIGHT_MM + part * (begin - START_HEIGHT_MM))
        });
        let descent = descent.collect::<Result<_, _>>()?;
        over_ground.extend_from_within(..);
        let half = over_ground.len() / 2;
        over_ground[half..].reverse();
        Ok(TipPath {
            name,
            descent,
            over_ground,
        })
    }

    /// Returns the position at a height above the surface, `offset` mm from home.
    fn above(&self, offset: [f64; 2], height: f64) -> Result<TipPosition, MeasureError> {
        let home = self.placement.home_mm;
        let [x, y] = [home[0] + offset[0], home[1] + offset[1]];
        let tip_mm = [x, y, self.grid.height(x, y) + height];
        let angles = self.placement.joints_at(&self.model, tip_mm);
        let angles = angles.map_err(|why| MeasureError(why.to_string()))?;
        let read = |axis: usize| self.encoder(axis).counts(angles[axis]);
        Ok(TipPosition {
            tip_mm,
            counts: [read(0), read(1), read(2)],
        })
    }

    pub(super) fn encoder(&self, axis: usize) -> Encoder {
        Encoder::new(&self.model.drive[axis])
    }

    /// Creates the loop that drives the arm.
    pub(super) fn open<'t>(
        &self,
        params: SurfaceParams,
        tiles: &'t mut [Tile],
    ) -> Result<Box<Haptics<'t, WINDOW>>, MeasureError> {
        let kinematics = Kinematics::new(&Calibration::PREMIUM_1_5);
        let kinematics = kinematics.map_err(|why| MeasureError(why.to_string()))?;
        let home = Hip::at(self.placement.home_mm).grid;
        let scene = replay::scene(self.grid, params, Source::Encoders, home);
        let mut haptics = replay::open(self.grid, scene, tiles);
        haptics.configure(kinematics);
        for command in [Command::Zero([0; 3]), Command::Arm] {
            let _ = haptics.accept(command);
        }
        Ok(haptics)
    }

    /// Returns the forces along the path with surface parameters, and the compared values.
    pub(super) fn render(
        &self,
        params: SurfaceParams,
        path: &TipPath,
    ) -> Result<Vec<EffectTick>, MeasureError> {
        let mut tiles = replay::tiles();
        let mut driven = Driven::begin(self, params, path, &mut tiles)?;
        for place in &path.descent {
            driven.tick(place);
        }
        let rendered = path.over_ground.iter().map(|place| driven.tick(place));
        let rendered = rendered
            .map(|outcome| EffectTick::of(&outcome.sample))
            .collect();
        driven.is_armed().map(|()| rendered)
    }
}

/// An arm that is armed at the start of a path.
pub(super) struct Driven<'t> {
    haptics: Box<Haptics<'t, WINDOW>>,
}

impl<'t> Driven<'t> {
    pub(super) fn begin(
        arm: &Arm<'_>,
        params: SurfaceParams,
        path: &TipPath,
        tiles: &'t mut [Tile],
    ) -> Result<Self, MeasureError> {
        let haptics = arm.open(params, tiles)?;
        let mut driven = Self { haptics };
        let counts = path.descent.first().map_or([0; 3], |place| place.counts);
        for tick in 0..MAX_ARMING_TICKS {
            let inputs = GuardInputs {
                counts,
                // The switch is pressed after a moment.
                dead_man: tick > 10,
                ..GuardInputs::default()
            };
            driven.haptics.tick(&inputs, true);
            if driven.haptics.report().mode == Mode::Armed {
                break;
            }
        }
        driven.is_armed().map(|()| driven)
    }

    #[inline]
    pub(super) fn tick(&mut self, place: &TipPosition) -> Outcome {
        let inputs = GuardInputs {
            counts: place.counts,
            dead_man: true,
            ..GuardInputs::default()
        };
        self.haptics.tick(&inputs, true)
    }

    pub(super) fn is_armed(&self) -> Result<(), MeasureError> {
        let report = self.haptics.report();
        match report.mode {
            Mode::Armed => Ok(()),
            _ => Err(MeasureError(format!("the arm is not armed: {report:?}"))),
        }
    }
}
