//! Texture: the rendered height and the force along the surface, and the documented formulas.

use std::f64::consts::TAU;

use hapterra_core::force::{SurfaceParams, Texture};

use super::effect::Effect;
use super::effect_tick::EffectTick;
use super::relief::height_and_slopes;
use super::replay::render;
use super::row::{Error, Origin};
use super::vector::{Vector, dot, length, minus, plus};
use crate::compare::Effort;
use crate::grid::Grid;
use crate::path;

/// Cells a tick, rendered in full and half faded; then a depth at which neither the height nor the
/// slope is limited by the depth.
const STEPS: [(&str, f64); 2] = [("slide 0.05", 0.05), ("slide 0.18", 0.18)];
const DEPTH: f64 = 0.3;
/// Bound, percent of the amplitude: the product's sine is off by 0.05, and positions are rounded.
const MAX_HEIGHT_PERCENT: f64 = 0.06;
/// Bound, percent of the steepest slope's force, as in the stress test's oracle.
const MAX_TANGENTIAL_PERCENT: f64 = 1.0;
/// Share of an earlier, higher speed that remains after a tick of 1 ms.
const SPEED_DECAY: f64 = 0.9;

pub(super) fn measure(grid: &Grid, effort: Effort) -> Vec<Error> {
    let mut errors = Vec::new();
    for (name, step) in STEPS {
        let slide = path::slide_at(grid, name, [step, DEPTH], effort.ticks);
        for effect in [Effect::Grain, Effect::Grating] {
            let params = effect.params();
            let deviation = deviation_percent(&params, &render(grid, params, &slide.hips));
            let origin = Origin(&grid.name, name, effect.name());
            let [high, along] =
                [0, 1].map(|i| deviation.iter().map(|deviation| deviation[i]).collect());
            errors.extend(origin.error(
                ("rendered height off", "% of A"),
                MAX_HEIGHT_PERCENT,
                high,
            ));
            let what = ("force along the surface off", "% of the steepest");
            errors.extend(origin.error(what, MAX_TANGENTIAL_PERCENT, along));
        }
    }
    errors
}

/// Returns the difference of the force from the formula in each tick: along the untextured force,
/// percent of the amplitude, and across it, percent of the steepest slope's force.
fn deviation_percent(params: &SurfaceParams, rendered: &[EffectTick]) -> Vec<[f64; 2]> {
    let texture = &params.texture;
    let (amplitude, stiffness) = (
        f64::from(texture.amplitude_mm),
        f64::from(params.stiffness_n_per_mm),
    );
    let mut fade = Fade::new(f64::from(texture.wavelength_mm));
    // The proxy has a speed in the air as well.
    let shares = rendered
        .iter()
        .map(|record| (record, fade.share(record.proxy)));
    let whole = shares.filter(|(rendered, _)| rendered.whole);
    let deviation = whole.map(|(rendered, share)| {
        let spring = rendered.spring();
        let depth = length(spring);
        let added = minus(rendered.force_n.map(|x| x / stiffness), spring);
        let deviation = minus(
            added,
            expected_addition(texture, rendered.proxy, spring, share),
        );
        let normal = spring.map(|x| x / depth);
        let high = dot(deviation, normal);
        let steepest = TAU * amplitude / f64::from(texture.wavelength_mm);
        let along =
            length(plus(deviation, normal, -high)) / (steepest * depth.min(max_depth_mm(texture)));
        [high.abs() / amplitude, along].map(|part| 100.0 * part)
    });
    deviation.collect()
}

/// Returns the depth from which the force along the surface is constant, mm.
fn max_depth_mm(texture: &Texture) -> f64 {
    f64::from(texture.wavelength_mm).powi(2) / (48.0 * f64::from(texture.amplitude_mm))
}

/// Returns the addition of a texture to the spring's displacement at a proxy, mm.
fn expected_addition(texture: &Texture, proxy: Vector, spring: Vector, share: f64) -> Vector {
    let amplitude = f64::from(texture.amplitude_mm);
    let (height, [east, north]) = height_and_slopes(texture, [proxy[0], proxy[1]]);
    let depth = length(spring);
    let normal = spring.map(|x| x / depth);
    let slope = [east * amplitude, north * amplitude, 0.0];
    let across = plus(slope, normal, -dot(slope, normal));
    let high = spring.map(|x| x * share * amplitude * height / depth.max(amplitude));
    plus(high, across, -share * depth.min(max_depth_mm(texture)))
}

/// Rendered share of a texture, from the proxy's path over the map.
struct Fade {
    wavelength: f64,
    /// Wavelengths a tick, decaying.
    speed: f64,
    previous: Option<Vector>,
}

impl Fade {
    const fn new(wavelength: f64) -> Self {
        Self {
            wavelength,
            speed: 0.0,
            previous: None,
        }
    }

    fn share(&mut self, proxy: Vector) -> f64 {
        // The first position counts as a jump.
        let now = self.previous.map_or(1.0, |previous| {
            let displacement = minus(proxy, previous);
            (displacement[0].hypot(displacement[1]) / self.wavelength).min(1.0)
        });
        self.previous = Some(proxy);
        self.speed = if now > self.speed {
            now
        } else {
            now + (self.speed - now) * SPEED_DECAY
        };
        let s = ((0.25 - self.speed) / 0.125).clamp(0.0, 1.0);
        s * s * (3.0 - 2.0 * s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tick_states::terrain;

    fn worst(params: &SurfaceParams, rendered: &[EffectTick]) -> [f64; 2] {
        let deviation = deviation_percent(params, rendered);
        [0, 1].map(|i| {
            deviation
                .iter()
                .map(|deviation| deviation[i])
                .fold(0.0, f64::max)
        })
    }

    #[test]
    fn texture_error_in_position_or_parameters_is_detected() {
        let grid = terrain();
        let slide = path::slide_at(&grid, "", [0.05, DEPTH], 2000);
        for effect in [Effect::Grain, Effect::Grating] {
            let params = effect.params();
            let rendered = render(&grid, params, &slide.hips);
            let [high, along] = worst(&params, &rendered);
            assert!(
                high < MAX_HEIGHT_PERCENT && along < MAX_TANGENTIAL_PERCENT,
                "{high} {along}"
            );
            let wrong: [fn(&mut Texture); 3] = [
                |texture| texture.seed += 1,
                |texture| texture.amplitude_mm *= 1.01,
                |texture| texture.wavelength_mm *= 1.01,
            ];
            for change in wrong {
                let mut other = params;
                change(&mut other.texture);
                let [high, _] = worst(&other, &rendered);
                assert!(high > 10.0 * MAX_HEIGHT_PERCENT, "{other:?}: {high}");
            }
            // A hundredth of a wave to the east.
            let mut shifted = rendered.clone();
            for rendered in &mut shifted {
                rendered.hip[0] += 0.01;
                rendered.proxy[0] += 0.01;
            }
            assert!(worst(&params, &shifted)[0] > 10.0 * MAX_HEIGHT_PERCENT);
            // Valleys in place of ridges.
            let mut inverse = rendered.clone();
            for rendered in &mut inverse {
                rendered.force_n = minus(rendered.spring(), rendered.force_n);
            }
            assert!(worst(&params, &inverse)[0] > 100.0);
        }
    }

    #[test]
    fn missing_texture_fade_is_detected() {
        let grid = terrain();
        let slide = path::slide_at(&grid, "", [0.18, DEPTH], 2000);
        let params = Effect::Grating.params();
        let mut rendered = render(&grid, params, &slide.hips);
        assert!(worst(&params, &rendered)[0] < MAX_HEIGHT_PERCENT);
        for rendered in &mut rendered {
            let added = expected_addition(&params.texture, rendered.proxy, rendered.spring(), 1.0);
            rendered.force_n = plus(rendered.spring(), added, 1.0).map(|x| x * 0.5);
        }
        assert!(worst(&params, &rendered)[0] > 10.0);
    }
}
