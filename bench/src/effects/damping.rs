//! Damping: the force compared with the documented formula, with the velocity from FOAW in f64 and
//! with the tip's own; also a check that it never pulls.

use hapterra::phantom::{ArmFrame, kinematics};
use hapterra_core::force::SurfaceParams;

use super::arm::{Arm, NotMeasured, Place, Way};
use super::effect::Effect;
use super::effect_tick::EffectTick;
use super::foaw;
use super::row::{self, Error};
use super::vector::{Vector, dot, length, minus};
use crate::compare::Effort;
use crate::grid::Grid;

/// Ticks a second.
const HZ: f64 = 1000.0;
/// Readings in FOAW's window.
const READINGS: usize = 16;
/// Tolerance of rounding, mN.
const ROUNDING: f64 = 0.01;

pub(super) fn measure(grid: &Grid, effort: Effort) -> Result<Vec<Error>, NotMeasured> {
    let arm = Arm::over(grid);
    let params = Effect::Damping.params();
    let mut errors = Vec::new();
    for way in [arm.slide(effort.ticks)?, arm.tap(effort.ticks)?] {
        let rendered = arm.render(params, &way)?;
        let place = row::Place(&grid.name, way.name, Effect::Damping.name());
        let own = off_mn(&params, &rendered, |tick| by_foaw(&arm, &way, tick));
        let path = off_mn(&params, &rendered, |tick| vec![by_path(&way, tick)]);
        errors.extend(place.error(("force off that by FOAW in f64", "mN"), ROUNDING, own));
        errors.extend(place.error(("force off that by the path's velocity", "mN"), None, path));
        errors.extend(place.error(("pull of the surface", "mN"), 0.0, pulls_mn(&rendered)));
    }
    Ok(errors)
}

/// Returns the difference of each force from the documented one, mN, with the nearest of some
/// velocities.
fn off_mn(
    params: &SurfaceParams,
    rendered: &[EffectTick],
    velocities_mm_s: impl Fn(usize) -> Vec<Vector>,
) -> Vec<f64> {
    let rendered = rendered.iter().enumerate().skip(READINGS);
    let off = rendered
        .filter(|(_, rendered)| rendered.whole)
        .map(|(tick, rendered)| {
            let off = velocities_mm_s(tick).into_iter().map(|velocity| {
                let wanted = damped_n(params, rendered.spring(), velocity);
                1e3 * length(minus(rendered.force_n, wanted))
            });
            off.fold(f64::INFINITY, f64::min)
        });
    off.collect()
}

/// Returns F' = F − b (v·f) f, where b |v·f| is limited to |F|.
fn damped_n(params: &SurfaceParams, spring_mm: Vector, velocity_mm_s: Vector) -> Vector {
    let deep = length(spring_mm);
    if deep == 0.0 {
        return [0.0; 3];
    }
    let along = spring_mm.map(|x| x / deep);
    let most = f64::from(params.max_force_n);
    let spring_n = (f64::from(params.stiffness_n_per_mm) * deep).min(most);
    let damping = 1e-3 * f64::from(params.damping.ns_per_m) * dot(velocity_mm_s, along);
    let force_n = (spring_n - damping.clamp(-spring_n, spring_n)).min(most);
    along.map(|x| x * force_n)
}

/// Returns the pull of each force at the tip, mN.
fn pulls_mn(rendered: &[EffectTick]) -> Vec<f64> {
    let whole = rendered.iter().filter(|record| record.whole);
    let pulls = whole.map(|record| {
        let along =
            dot(record.force_n, record.spring()) / length(record.spring()).max(f64::MIN_POSITIVE);
        (-1e3 * along).max(0.0)
    });
    pulls.collect()
}

/// Returns the tip's velocity in the last tick, mm/s.
fn by_path(way: &Way, tick: usize) -> Vector {
    let [from, to] = [tick - 1, tick].map(|tick| way.there[tick].tip_mm);
    minus(to, from).map(|mm| mm * HZ)
}

/// Returns the tip's velocity from the encoders alone, mm/s, for each way to break ties.
fn by_foaw(arm: &Arm<'_>, way: &Way, tick: usize) -> Vec<Vector> {
    let readings: &[Place] = &way.there[tick + 1 - READINGS..=tick];
    let counts = readings[READINGS - 1].counts;
    let angles = [0, 1, 2].map(|axis| arm.encoder(axis).angle_rad(counts[axis]));
    let jacobian = kinematics::jacobian(&arm.model, angles);
    let slopes = [0, 1, 2].map(|axis| {
        let one = arm.encoder(axis).angle_rad(1);
        let counts: Vec<f64> = readings
            .iter()
            .map(|at| f64::from(at.counts[axis]))
            .collect();
        foaw::slopes(&counts).map(|counts| counts * one * HZ)
    });
    let velocity = |tie: usize| {
        let rates = [0, 1, 2].map(|axis| slopes[axis][(tie >> axis) & 1]);
        ArmFrame::turn_to_terrain(jacobian.map(|row| 1e3 * dot(row, rates)))
    };
    (0..8).map(velocity).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tick_states::terrain;

    fn worst(errors: Vec<f64>) -> f64 {
        errors.into_iter().fold(0.0, f64::max)
    }

    #[test]
    fn damping_check_detects_wrong_late_and_pulling_forces() {
        let grid = terrain();
        let arm = Arm::over(&grid);
        let way = arm.tap(2000).expect("in reach");
        let params = Effect::Damping.params();
        let rendered = arm.render(params, &way).expect("rendered");
        let off = |params: &SurfaceParams, rendered: &[EffectTick]| {
            worst(off_mn(params, rendered, |tick| by_foaw(&arm, &way, tick)))
        };
        assert!(off(&params, &rendered) < ROUNDING && worst(pulls_mn(&rendered)) == 0.0);
        // Five percent more damping.
        let mut more = params;
        more.damping.ns_per_m *= 1.05;
        assert!(off(&more, &rendered) > 10.0 * ROUNDING);
        // The velocity of the previous tick.
        let late = off_mn(&params, &rendered, |tick| by_foaw(&arm, &way, tick - 1));
        assert!(worst(late) > 10.0 * ROUNDING);
        // A damper without the spring's force as its limit.
        let mut pulling = rendered.clone();
        for (tick, rendered) in pulling.iter_mut().enumerate().skip(1) {
            let (spring, deep) = (rendered.spring(), length(rendered.spring()));
            let speed = dot(by_path(&way, tick), spring) / deep.max(1e-9);
            rendered.force_n = spring.map(|x| x * (0.5 - 2e-3 * speed / deep.max(1e-9)));
        }
        assert!(worst(pulls_mn(&pulling)) > 1.0 && off(&params, &pulling) > 1.0);
    }
}
