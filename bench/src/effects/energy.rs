//! The passivity controller: the energy that a surface adds to a hand that taps on it, in a closed
//! loop with a virtual arm.

use crate::stability::grasp::Grasp;
use hapterra::phantom::{ArmFrame, HeldPhantom, PhantomModel, Script};
use hapterra_core::force::SurfaceParams;

use super::arm::{Arm, MeasureError};
use super::effect::Effect;
use super::replay;
use super::row::{Error, Origin};
use super::vector::{Vector, dot, minus};
use crate::grid::Grid;

/// Largest stiffness for which docs/explanation/stability.md states the energy of a tap, N/mm.
const STIFFNESS: f32 = 1.5;
/// Most energy of a tap there, mJ: zero to within a hundredth.
const MAX_GAIN_MJ: f64 = 0.01;
/// Speed of the hand, mm/s, and its height above and depth below the surface, mm.
const SPEEDS_MM_S: [f64; 3] = [100.0, 200.0, 500.0];
const START_HEIGHT_MM: f64 = 30.0;
const TARGET_DEPTH_MM: f64 = 25.0;
const TAPS: usize = 3;
/// Height of the tip between two taps above which they count as separate, mm.
const SEPARATE_HEIGHT_MM: f64 = 10.0;
/// Height of the home pose over the surface, mm.
const HOME_HEIGHT_MM: f64 = 4.0;
/// A tick, and the delay from the encoders to the amplifiers, s.
const TICK_S: f64 = 1e-3;
const DELAY_S: f64 = 0.08e-3;

pub(super) fn measure(grid: &Grid) -> Result<Vec<Error>, MeasureError> {
    let mut rows = Vec::new();
    for (effect, bound) in [
        (Effect::None, None),
        (Effect::Controller, Some(MAX_GAIN_MJ)),
    ] {
        let params = SurfaceParams {
            stiffness_n_per_mm: STIFFNESS,
            ..effect.params()
        };
        let mut gained = Vec::new();
        for speed in SPEEDS_MM_S {
            for grasp in Grasp::ALL {
                gained.extend(gained_mj(&run_taps(grid, params, grasp, speed)?));
            }
        }
        let origin = Origin(&grid.name, "a hand taps", effect.name());
        rows.extend(origin.error(("energy added in a tap", "mJ"), bound, gained));
    }
    Ok(rows)
}

/// A part of a tick: the surface's force, and the height and motion of the tip.
#[derive(Clone, Copy, Debug)]
struct SubTick {
    force_n: Vector,
    displacement_mm: Vector,
    above_mm: f64,
}

/// Returns the work of the force between moments high above the surface, mJ.
fn gained_mj(parts: &[SubTick]) -> Vec<f64> {
    let (mut taps, mut gained) = (Vec::new(), 0.0);
    for part in parts {
        gained += dot(part.force_n, part.displacement_mm);
        if part.above_mm > SEPARATE_HEIGHT_MM && gained != 0.0 {
            taps.push(gained);
            gained = 0.0;
        }
    }
    taps
}

/// Taps with a hand on the middle of a terrain.
fn run_taps(
    grid: &Grid,
    params: SurfaceParams,
    grasp: Grasp,
    speed_mm_s: f64,
) -> Result<Vec<SubTick>, MeasureError> {
    let mut arm = Arm::over(grid);
    let [x, y, _] = arm.placement.home_mm;
    let ground = grid.height(x, y);
    arm.placement = ArmFrame {
        home_mm: [x, y, ground + HOME_HEIGHT_MM],
    };
    let mut script = Script::start([x, y, ground + START_HEIGHT_MM]);
    for _ in 0..TAPS {
        for above in [-TARGET_DEPTH_MM, START_HEIGHT_MM] {
            script = script.line_to([x, y, ground + above], speed_mm_s);
        }
    }
    let arm_and_hand = HeldPhantom::new(
        PhantomModel::premium_1_5(),
        grasp.hand(),
        arm.placement,
        script.wait(0.2),
    );
    let mut arm_and_hand = arm_and_hand
        .map_err(|why| MeasureError(why.to_string()))?
        .arming();
    let mut tiles = replay::tiles();
    let mut haptics = arm.open(params, &mut tiles)?;
    let ticks = ((HeldPhantom::ARMED_S + arm_and_hand.script_s()) / TICK_S) as usize;
    let tip = |arm_and_hand: &HeldPhantom| {
        let plant = arm_and_hand.plant();
        arm.placement.to_terrain_mm(plant.model(), plant.tip_m())
    };
    let (mut before, mut parts) = (([0.0; 3], [0.0; 3]), Vec::with_capacity(2 * ticks));
    for _ in 0..ticks {
        let outcome = haptics.tick(&arm_and_hand.guard_inputs(), true);
        let to_f64 = |v: hapterra_core::Vec3| v.to_array().map(f64::from);
        let now = (
            to_f64(outcome.drive.currents_a),
            to_f64(outcome.sample.force_n),
        );
        for ((currents_a, force_n), duration_s) in [(before, DELAY_S), (now, TICK_S - DELAY_S)] {
            let from = tip(&arm_and_hand);
            arm_and_hand.step(currents_a, duration_s);
            let to = tip(&arm_and_hand);
            parts.push(SubTick {
                force_n,
                displacement_mm: minus(to, from),
                above_mm: to[2] - ground,
            });
        }
        before = now;
    }
    match haptics.report().fault {
        Some(fault) => Err(MeasureError(format!("the guard switched off: {fault:?}"))),
        None => Ok(parts),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::force::Controller;

    use crate::tick_states::terrain;

    /// Returns a spring that is pushed in and out, with `more` additional stiffness when pulled.
    fn spring(more: f64) -> Vec<SubTick> {
        let height = |tick: i32| 12.0 * (f64::from(tick) * 0.01).cos();
        let part = |tick: i32| {
            let [from, to] = [height(tick), height(tick + 1)];
            let stiffness = if to > from { 1.0 + more } else { 1.0 };
            SubTick {
                force_n: [0.0, 0.0, stiffness * (-0.5 * (from + to)).max(0.0)],
                displacement_mm: [0.0, 0.0, to - from],
                above_mm: to,
            }
        };
        (0..700).map(part).collect()
    }

    #[test]
    fn surface_that_adds_energy_is_detected() {
        let max = |more: f64| {
            gained_mj(&spring(more))
                .into_iter()
                .fold(f64::MIN, f64::max)
        };
        assert!(max(0.0).abs() < 0.005, "{}", max(0.0));
        // 72 mJ are stored; a two-thousandth more is returned.
        assert!(max(0.0005) > MAX_GAIN_MJ, "{}", max(0.0005));
        assert!(max(-0.0005) < 0.0);
    }

    #[test]
    fn tap_gains_energy_only_without_passivity_controller() {
        let params = |controller| {
            let mut params = Effect::None.params();
            params.stiffness_n_per_mm = STIFFNESS;
            params.damping.controller = controller;
            params
        };
        let max = |controller| {
            let parts = run_taps(&terrain(), params(controller), Grasp::Normal, 200.0);
            let gained = gained_mj(&parts.expect("in reach"));
            assert_eq!(gained.len(), TAPS);
            gained.into_iter().fold(f64::MIN, f64::max)
        };
        assert!(max(Controller::Off) > 10.0 * MAX_GAIN_MJ);
        assert!(max(Controller::On) <= MAX_GAIN_MJ);
    }
}
