//! All effects at once: the surface pushes, within the sum of its parts' bounds.

use hapterra_core::force::SurfaceParams;

use super::arm::{Arm, MeasureError};
use super::effect::Effect;
use super::effect_tick::EffectTick;
use super::row::{Error, Origin};
use super::vector::{degrees, length};
use crate::compare::Effort;
use crate::grid::Grid;

/// Largest angle between a force that does not pull and the spring, degrees.
const MAX_ANGLE_DEG: f64 = 90.0;
/// The bound, percent.
const MAX_SHARE: f64 = 100.0;

pub(super) fn measure(grid: &Grid, effort: Effort) -> Result<Vec<Error>, MeasureError> {
    let arm = Arm::over(grid);
    let params = Effect::All.params();
    let mut errors = Vec::new();
    for path in [arm.slide(effort.ticks)?, arm.tap(effort.ticks)?] {
        let rendered = arm.render(params, &path)?;
        let origin = Origin(&grid.name, path.name, Effect::All.name());
        let turn = ("force off the spring's direction", "°");
        errors.extend(origin.error(turn, MAX_ANGLE_DEG, deviation_degrees(&rendered)));
        let share = ("size of the force", "% of its bound");
        errors.extend(origin.error(share, MAX_SHARE, shares(&params, &rendered)));
    }
    Ok(errors)
}

/// Returns the angles between force and displacement; below 90° no force pulls.
fn deviation_degrees(rendered: &[EffectTick]) -> Vec<f64> {
    let rendered = rendered.iter().filter(|record| record.whole);
    let rendered = rendered.filter(|record| length(record.force_n) > 0.0);
    rendered
        .map(|record| degrees(record.force_n, record.spring()))
        .collect()
}

/// Returns each force as a percentage of its bound.
fn shares(params: &SurfaceParams, rendered: &[EffectTick]) -> Vec<f64> {
    let rendered = rendered.iter().filter(|record| record.whole);
    let share =
        rendered.map(|record| length(record.force_n) / max_n(params, length(record.spring())));
    share.map(|share| 100.0 * share).collect()
}

/// Returns the bound: shading keeps the size; texture adds its height along the force and at most
/// λ/7.6 across it; damping and controller at most double the result.
fn max_n(params: &SurfaceParams, depth_mm: f64) -> f64 {
    let [amplitude, wavelength] =
        [params.texture.amplitude_mm, params.texture.wavelength_mm].map(f64::from);
    let deep = depth_mm + amplitude.min(depth_mm);
    let textured_n = f64::from(params.stiffness_n_per_mm) * deep.hypot(wavelength / 7.6);
    (2.0 * textured_n).min(f64::from(params.max_force_n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulling_or_excessive_force_is_detected() {
        let params = Effect::All.params();
        let rendered = |force_n| EffectTick {
            hip: [0.0; 3],
            proxy: [0.0, 0.0, 1.0],
            force_n,
            whole: true,
        };
        let checked = |force_n| {
            let rendered = [rendered(force_n)];
            (
                deviation_degrees(&rendered)[0],
                shares(&params, &rendered)[0],
            )
        };
        let (turn, share) = checked([0.1, 0.0, 0.5]);
        assert!(turn < MAX_ANGLE_DEG && share < MAX_SHARE);
        assert!(checked([0.1, 0.0, -0.01]).0 > MAX_ANGLE_DEG);
        assert!(checked([0.0, 0.0, 1.2]).1 > MAX_SHARE);
    }
}
