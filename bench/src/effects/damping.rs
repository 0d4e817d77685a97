//! Damping: the force compared with the documented formula, with the velocity from FOAW in f64 and
//! with the tip's own; also a check that it never pulls.

use hapterra::phantom::{ArmFrame, kinematics};
use hapterra_core::force::SurfaceParams;

use super::arm::{Arm, MeasureError, TipPath, TipPosition};
use super::effect::Effect;
use super::effect_tick::EffectTick;
use super::foaw;
use super::row::{self, Error};
use super::vector::{Vector, dot, length, minus};
use crate::compare::Effort;
use crate::grid::Grid;

/// Ticks a second.
const TICK_HZ: f64 = 1000.0;
/// Readings in FOAW's window.
const FOAW_WINDOW: usize = 16;
/// Tolerance of rounding, mN.
const ROUNDING_MN: f64 = 0.01;

pub(super) fn measure(grid: &Grid, effort: Effort) -> Result<Vec<Error>, MeasureError> {
    let arm = Arm::over(grid);
    let params = Effect::Damping.params();
    let mut errors = Vec::new();
    for path in [arm.slide(effort.ticks)?, arm.tap(effort.ticks)?] {
        let rendered = arm.render(params, &path)?;
        let origin = row::Origin(&grid.name, path.name, Effect::Damping.name());
        let own = deviation_mn(&params, &rendered, |tick| {
            foaw_velocities(&arm, &path, tick)
        });
        let against_path =
            deviation_mn(&params, &rendered, |tick| vec![path_velocity(&path, tick)]);
        errors.extend(origin.error(("force off that by FOAW in f64", "mN"), ROUNDING_MN, own));
        errors.extend(origin.error(
            ("force off that by the path's velocity", "mN"),
            None,
            against_path,
        ));
        errors.extend(origin.error(("pull of the surface", "mN"), 0.0, pulling_mn(&rendered)));
    }
    Ok(errors)
}

/// Returns the difference of each force from the documented one, mN, with the nearest of some
/// velocities.
fn deviation_mn(
    params: &SurfaceParams,
    rendered: &[EffectTick],
    velocities_mm_s: impl Fn(usize) -> Vec<Vector>,
) -> Vec<f64> {
    let rendered = rendered.iter().enumerate().skip(FOAW_WINDOW);
    let deviation = rendered
        .filter(|(_, rendered)| rendered.whole)
        .map(|(tick, rendered)| {
            let deviation = velocities_mm_s(tick).into_iter().map(|velocity| {
                let expected = damped_n(params, rendered.spring(), velocity);
                1e3 * length(minus(rendered.force_n, expected))
            });
            deviation.fold(f64::INFINITY, f64::min)
        });
    deviation.collect()
}

/// Returns F' = F − b (v·f) f, where b |v·f| is limited to |F|.
fn damped_n(params: &SurfaceParams, spring_mm: Vector, velocity_mm_s: Vector) -> Vector {
    let deep = length(spring_mm);
    if deep == 0.0 {
        return [0.0; 3];
    }
    let along = spring_mm.map(|x| x / deep);
    let max = f64::from(params.max_force_n);
    let spring_n = (f64::from(params.stiffness_n_per_mm) * deep).min(max);
    let damping = 1e-3 * f64::from(params.damping.ns_per_m) * dot(velocity_mm_s, along);
    let force_n = (spring_n - damping.clamp(-spring_n, spring_n)).min(max);
    along.map(|x| x * force_n)
}

/// Returns the pull of each force at the tip, mN.
fn pulling_mn(rendered: &[EffectTick]) -> Vec<f64> {
    let whole = rendered.iter().filter(|record| record.whole);
    let pulling = whole.map(|record| {
        let along =
            dot(record.force_n, record.spring()) / length(record.spring()).max(f64::MIN_POSITIVE);
        (-1e3 * along).max(0.0)
    });
    pulling.collect()
}

/// Returns the tip's velocity in the last tick, mm/s.
fn path_velocity(path: &TipPath, tick: usize) -> Vector {
    let [from, to] = [tick - 1, tick].map(|tick| path.over_ground[tick].tip_mm);
    minus(to, from).map(|mm| mm * TICK_HZ)
}

/// Returns the tip's velocity from the encoders alone, mm/s, for each rule for ties.
fn foaw_velocities(arm: &Arm<'_>, path: &TipPath, tick: usize) -> Vec<Vector> {
    let readings: &[TipPosition] = &path.over_ground[tick + 1 - FOAW_WINDOW..=tick];
    let counts = readings[FOAW_WINDOW - 1].counts;
    let angles = [0, 1, 2].map(|axis| arm.encoder(axis).angle_rad(counts[axis]));
    let jacobian = kinematics::jacobian(&arm.model, angles);
    let slopes = [0, 1, 2].map(|axis| {
        let one = arm.encoder(axis).angle_rad(1);
        let counts: Vec<f64> = readings
            .iter()
            .map(|at| f64::from(at.counts[axis]))
            .collect();
        foaw::slopes(&counts).map(|counts| counts * one * TICK_HZ)
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
        let path = arm.tap(2000).expect("in reach");
        let params = Effect::Damping.params();
        let rendered = arm.render(params, &path).expect("rendered");
        let deviation = |params: &SurfaceParams, rendered: &[EffectTick]| {
            worst(deviation_mn(params, rendered, |tick| {
                foaw_velocities(&arm, &path, tick)
            }))
        };
        assert!(deviation(&params, &rendered) < ROUNDING_MN && worst(pulling_mn(&rendered)) == 0.0);
        // Five percent more damping.
        let mut more = params;
        more.damping.ns_per_m *= 1.05;
        assert!(deviation(&more, &rendered) > 10.0 * ROUNDING_MN);
        // The velocity of the previous tick.
        let late = deviation_mn(&params, &rendered, |tick| {
            foaw_velocities(&arm, &path, tick - 1)
        });
        assert!(worst(late) > 10.0 * ROUNDING_MN);
        // A damper without the spring's force as its limit.
        let mut pulling = rendered.clone();
        for (tick, rendered) in pulling.iter_mut().enumerate().skip(1) {
            let (spring, deep) = (rendered.spring(), length(rendered.spring()));
            let speed = dot(path_velocity(&path, tick), spring) / deep.max(1e-9);
            rendered.force_n = spring.map(|x| x * (0.5 - 2e-3 * speed / deep.max(1e-9)));
        }
        assert!(worst(pulling_mn(&pulling)) > 1.0 && deviation(&params, &pulling) > 1.0);
    }
}
