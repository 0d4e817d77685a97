//! Friction: the ratio of tangential to normal force of a proxy that slides, and the drift of one
//! that sticks.

use super::effect::{Effect, FRICTION};
use super::effect_tick::EffectTick;
use super::replay::render;
use super::row::{Error, Origin};
use super::vector::{Vector, dot, length, minus, normal, plus};
use crate::compare::Effort;
use crate::grid::Grid;
use crate::path::{self, Random};
use crate::variant::Hip;

/// Cells a tick (10 mm/s at 1 kHz), and depth.
const STEP_CELLS: f64 = 0.01;
const DEPTH: f64 = 0.3;
/// Error for that speed in docs/explanation/effects.md, percent of the coefficient.
const MAX_ABOVE_PERCENT: f64 = 3.1;
const MAX_BELOW_PERCENT: f64 = 5.0;
/// Points where the tip is held, and ticks at each.
const POINTS: usize = 40;
const HELD_TICKS: usize = 200;
/// Ticks after which a proxy that has slid sticks: more than 20 ms.
const SETTLING_TICKS: usize = 30;
/// Depth, and amplitude of the HIP's tremor in each axis: within the cone of a static coefficient
/// of 0.5, whose radius is 0.05 there.
const HELD_DEPTH_CELLS: f64 = 0.1;
const TREMOR: f64 = 0.025;

pub(super) fn measure(grid: &Grid, effort: Effort) -> Vec<Error> {
    let params = Effect::Friction.params();
    let slide = path::slide_at(grid, "slide 0.01", [STEP_CELLS, DEPTH], effort.ticks);
    let slid = render(grid, params, &slide.hips);
    let deviation = deviation_percent(
        grid,
        f64::from(FRICTION.dynamic_mu),
        &slid[slide.approach..],
    );
    let part = |sign: f64| {
        deviation
            .iter()
            .map(|deviation| (sign * deviation).max(0.0))
            .collect()
    };
    let (hips, from) = held_points(grid);
    let stuck = render(grid, params, &hips);
    let drifts = from
        .iter()
        .filter_map(|from| drift(&stuck[*from..][..HELD_TICKS]));
    let sliding = Origin(&grid.name, slide.name, Effect::Friction.name());
    let held = Origin(&grid.name, "held", Effect::Friction.name());
    let rows = [
        sliding.error(
            ("force ratio above the dynamic coefficient", "%"),
            MAX_ABOVE_PERCENT,
            part(1.0),
        ),
        sliding.error(
            ("force ratio below the dynamic coefficient", "%"),
            MAX_BELOW_PERCENT,
            part(-1.0),
        ),
        held.error(
            ("drift of a proxy that sticks", "cell"),
            0.0,
            drifts.collect(),
        ),
    ];
    rows.into_iter().flatten().collect()
}

/// Returns the difference of the ratio of tangential to normal force from a coefficient, percent of
/// it, in each tick in which the proxy slid within a patch.
fn deviation_percent(grid: &Grid, mu: f64, rendered: &[EffectTick]) -> Vec<f64> {
    let slid = rendered.windows(2).filter(|pair| {
        let both = pair[0].whole && pair[1].whole;
        both && pair[0].proxy != pair[1].proxy
    });
    let deviation = slid.filter_map(|pair| {
        let normal = normal(pair[1].slopes(grid)?);
        let force = pair[1].force_n;
        let normal_n = dot(force, normal);
        let tangential_n = length(plus(force, normal, -normal_n));
        Some(100.0 * (tangential_n / (mu * normal_n) - 1.0))
    });
    deviation.collect()
}

/// Returns the largest distance of a proxy from its first position; `None` if it was not rendered.
fn drift(rendered: &[EffectTick]) -> Option<f64> {
    let first = rendered.first()?.proxy;
    let is_rendered = rendered.iter().all(|record| record.whole);
    let distances = rendered
        .iter()
        .map(|record| length(minus(record.proxy, first)));
    is_rendered.then(|| distances.fold(0.0, f64::max))
}

/// Returns HIPs that descend along the normal at points inside patches and tremble there, and the
/// start of each.
fn held_points(grid: &Grid) -> (Vec<Hip>, Vec<usize>) {
    let mut random = Random(23);
    let sky = f64::from(grid.top()) + 2.0;
    let (mut hips, mut from) = (Vec::new(), Vec::new());
    for _ in 0..POINTS {
        let inside = |random: &mut Random, side: usize| {
            random.between(4.0, side as f64 - 4.0).floor() + random.between(0.2, 0.8)
        };
        let [x, y] = [
            inside(&mut random, grid.columns),
            inside(&mut random, grid.rows),
        ];
        let (place, up) = surface_point(grid, [x, y]);
        let above = plus(place, up, 0.5);
        hips.push(Hip::at([above[0], above[1], sky]));
        let down = (0..=10).map(|i| plus(above, up, -0.05 * f64::from(i)));
        hips.extend(down.map(Hip::at));
        let pressed = Hip::at(plus(place, up, -HELD_DEPTH_CELLS));
        hips.extend(std::iter::repeat_n(pressed, SETTLING_TICKS));
        from.push(hips.len());
        let mut tremor = || {
            let offset = [0, 1, 2].map(|_| random.between(-TREMOR, TREMOR));
            plus(offset, up, -dot(offset, up) - HELD_DEPTH_CELLS)
        };
        hips.extend((0..HELD_TICKS).map(|_| Hip::at(plus(place, tremor(), 1.0))));
        hips.extend([above, [above[0], above[1], sky]].map(Hip::at));
    }
    (hips, from)
}

/// Returns a point of the surface, and its normal.
fn surface_point(grid: &Grid, [x, y]: [f64; 2]) -> (Vector, Vector) {
    const STEP_CELLS: f64 = 1e-3;
    let slope = |east: f64, north: f64| {
        let ahead = grid.height(x + east, y + north);
        (ahead - grid.height(x - east, y - north)) / (2.0 * STEP_CELLS)
    };
    let normal = normal([slope(STEP_CELLS, 0.0), slope(0.0, STEP_CELLS)]);
    ([x, y, grid.height(x, y)], normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tick_states::terrain;

    #[test]
    fn friction_error_of_five_percent_is_detected() {
        let (grid, mut params) = (terrain(), Effect::Friction.params());
        let slide = path::slide_at(&grid, "", [STEP_CELLS, DEPTH], 2000);
        let mut worst = |mu: f32| {
            params.friction.dynamic_mu = mu;
            let rendered = render(&grid, params, &slide.hips);
            let deviation = deviation_percent(&grid, 0.3, &rendered[slide.approach..]);
            let above = deviation.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (
                above,
                -deviation.iter().copied().fold(f64::INFINITY, f64::min),
            )
        };
        let (above, below) = worst(0.3);
        assert!(
            above < MAX_ABOVE_PERCENT && below < MAX_BELOW_PERCENT,
            "{above} {below}"
        );
        assert!(worst(0.3 * 1.05).0 > MAX_ABOVE_PERCENT);
        assert!(worst(0.3 * 0.95).1 > MAX_BELOW_PERCENT);
    }

    #[test]
    fn proxy_creep_is_measured_as_drift() {
        let rendered = EffectTick {
            hip: [0.0; 3],
            proxy: [0.0, 0.0, 0.1],
            force_n: [0.0, 0.0, 0.05],
            whole: true,
        };
        let mut crept = rendered;
        crept.proxy[0] = 1e-6;
        assert_eq!(drift(&[rendered; 3]), Some(0.0));
        assert_eq!(drift(&[rendered, rendered, crept]), Some(1e-6));
        crept.whole = false;
        assert_eq!(drift(&[rendered, rendered, crept]), None);
    }

    /// A proxy without friction slips where friction would hold.
    #[test]
    fn frictionless_proxy_drifts() {
        let grid = terrain();
        let (hips, from) = held_points(&grid);
        let rendered = render(&grid, Effect::None.params(), &hips);
        let drift = drift(&rendered[from[0]..][..HELD_TICKS]);
        assert!(drift.is_some_and(|drift| drift > 0.01), "{drift:?}");
    }
}
