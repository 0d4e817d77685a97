//! The passivity controller: the energy that a surface gives to a hand that taps on it, in a closed
//! loop with a virtual arm.

use crate::stability::grasp::Grasp;
use hapterra::phantom::{ArmFrame, HeldPhantom, PhantomModel, Script};
use hapterra_core::force::SurfaceParams;

use super::arm::{Arm, NotMeasured};
use super::effect::Effect;
use super::replay;
use super::row::{Error, Place};
use super::vector::{Vector, dot, minus};
use crate::grid::Grid;

/// Largest stiffness for which docs/explanation/stability.md states the energy of a tap, N/mm.
const STIFFNESS: f32 = 1.5;
/// Most energy of a tap there, mJ: zero to within a hundredth.
const MAX_MJ: f64 = 0.01;
/// Speed of the hand, mm/s, and its height above and depth below the surface, mm.
const SPEEDS: [f64; 3] = [100.0, 200.0, 500.0];
const ABOVE: f64 = 30.0;
const BELOW: f64 = 25.0;
const TAPS: usize = 3;
/// Height of the tip between two taps above which they count as separate, mm.
const APART: f64 = 10.0;
/// Height of the home pose over the surface, mm.
const HOME: f64 = 4.0;
/// A tick, and the delay from the encoders to the amplifiers, s.
const TICK_S: f64 = 1e-3;
const LATE_S: f64 = 0.08e-3;

pub(super) fn measure(grid: &Grid) -> Result<Vec<Error>, NotMeasured> {
    let mut rows = Vec::new();
    for (effect, bound) in [(Effect::None, None), (Effect::Controller, Some(MAX_MJ))] {
        let params = SurfaceParams {
            stiffness_n_per_mm: STIFFNESS,
            ..effect.params()
        };
        let mut given = Vec::new();
        for speed in SPEEDS {
            for grasp in Grasp::ALL {
                given.extend(given_mj(&tapped(grid, params, grasp, speed)?));
            }
        }
        let place = Place(&grid.name, "a hand taps", effect.name());
        rows.extend(place.error(("energy that a tap gives", "mJ"), bound, given));
    }
    Ok(rows)
}

/// A part of a tick: the surface's force, and the height and motion of the tip.
#[derive(Clone, Copy, Debug)]
struct Part {
    force_n: Vector,
    went_mm: Vector,
    above_mm: f64,
}

/// Returns the work of the force between moments high above the surface, mJ.
fn given_mj(parts: &[Part]) -> Vec<f64> {
    let (mut taps, mut given) = (Vec::new(), 0.0);
    for part in parts {
        given += dot(part.force_n, part.went_mm);
        if part.above_mm > APART && given != 0.0 {
            taps.push(given);
            given = 0.0;
        }
    }
    taps
}

/// Taps with a hand on the middle of a terrain.
fn tapped(
    grid: &Grid,
    params: SurfaceParams,
    grasp: Grasp,
    speed_mm_s: f64,
) -> Result<Vec<Part>, NotMeasured> {
    let mut arm = Arm::over(grid);
    let [x, y, _] = arm.placement.home_mm;
    let ground = grid.height(x, y);
    arm.placement = ArmFrame {
        home_mm: [x, y, ground + HOME],
    };
    let mut script = Script::start([x, y, ground + ABOVE]);
    for _ in 0..TAPS {
        for above in [-BELOW, ABOVE] {
            script = script.line_to([x, y, ground + above], speed_mm_s);
        }
    }
    let held = HeldPhantom::new(
        PhantomModel::premium_1_5(),
        grasp.hand(),
        arm.placement,
        script.wait(0.2),
    );
    let mut held = held.map_err(|why| NotMeasured(why.to_string()))?.arming();
    let mut tiles = replay::tiles();
    let mut haptics = arm.open(params, &mut tiles)?;
    let ticks = ((HeldPhantom::ARMED_S + held.script_s()) / TICK_S) as usize;
    let tip = |held: &HeldPhantom| {
        let plant = held.plant();
        arm.placement.to_terrain_mm(plant.model(), plant.tip_m())
    };
    let (mut before, mut parts) = (([0.0; 3], [0.0; 3]), Vec::with_capacity(2 * ticks));
    for _ in 0..ticks {
        let outcome = haptics.tick(&held.guard_inputs(), true);
        let wide = |v: hapterra_core::Vec3| v.to_array().map(f64::from);
        let now = (wide(outcome.drive.currents_a), wide(outcome.sample.force_n));
        for ((currents_a, force_n), for_s) in [(before, LATE_S), (now, TICK_S - LATE_S)] {
            let from = tip(&held);
            held.step(currents_a, for_s);
            let to = tip(&held);
            parts.push(Part {
                force_n,
                went_mm: minus(to, from),
                above_mm: to[2] - ground,
            });
        }
        before = now;
    }
    match haptics.report().fault {
        Some(fault) => Err(NotMeasured(format!("the guard switched off: {fault:?}"))),
        None => Ok(parts),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::force::Controller;

    use crate::tick_states::terrain;

    /// Returns a spring that is pushed in and out, with `more` additional stiffness on the way out.
    fn spring(more: f64) -> Vec<Part> {
        let height = |tick: i32| 12.0 * (f64::from(tick) * 0.01).cos();
        let part = |tick: i32| {
            let [from, to] = [height(tick), height(tick + 1)];
            let stiffness = if to > from { 1.0 + more } else { 1.0 };
            Part {
                force_n: [0.0, 0.0, stiffness * (-0.5 * (from + to)).max(0.0)],
                went_mm: [0.0, 0.0, to - from],
                above_mm: to,
            }
        };
        (0..700).map(part).collect()
    }

    #[test]
    fn surface_that_adds_energy_is_detected() {
        let most = |more: f64| given_mj(&spring(more)).into_iter().fold(f64::MIN, f64::max);
        assert!(most(0.0).abs() < 0.005, "{}", most(0.0));
        // 72 mJ are stored; a two-thousandth more is returned.
        assert!(most(0.0005) > MAX_MJ, "{}", most(0.0005));
        assert!(most(-0.0005) < 0.0);
    }

    #[test]
    fn tap_gains_energy_only_without_passivity_controller() {
        let params = |controller| {
            let mut params = Effect::None.params();
            params.stiffness_n_per_mm = STIFFNESS;
            params.damping.controller = controller;
            params
        };
        let most = |controller| {
            let parts = tapped(&terrain(), params(controller), Grasp::Normal, 200.0);
            let given = given_mj(&parts.expect("in reach"));
            assert_eq!(given.len(), TAPS);
            given.into_iter().fold(f64::MIN, f64::max)
        };
        assert!(most(Controller::Off) > 10.0 * MAX_MJ);
        assert!(most(Controller::On) <= MAX_MJ);
    }
}
