//! Shading: the direction of the force compared with that of the documented normal, and its turn
//! from one HIP to the next.

use super::effect::Effect;
use super::effect_tick::EffectTick;
use super::replay::render;
use super::row::{Error, Origin};
use super::vector::{Vector, cross, degrees, length, minus, normal, plus, unit};
use crate::compare::Effort;
use crate::grid::Grid;
use crate::path;

/// Cells from one HIP to the next, and depth.
const STEP: f64 = 0.01;
const DEPTH: f64 = 0.02;
/// Tolerance of a direction by rounding, degrees: that of the stress test's oracle.
const ROUNDING: f64 = 0.06;
/// Largest turn of a shaded force where an unshaded one turns by 60°, degrees.
const MAX_TICK_TURN_DEG: f64 = 6.0;
/// Largest motion of the proxy in a tick for which this holds, cells.
const MAX_PROXY_STEP: f64 = 0.05;
/// Largest angle by which a force is turned, degrees.
const MAX_TURN_DEG: f64 = 60.0;

pub(super) fn measure(grid: &Grid, effort: Effort) -> Vec<Error> {
    let slide = path::slide_at(grid, "slide 0.01", [STEP, DEPTH], effort.ticks);
    let rendered =
        |effect: Effect| render(grid, effect.params(), &slide.hips).split_off(slide.approach);
    let (plain, shaded) = (rendered(Effect::None), rendered(Effect::Shading));
    let [none, own] =
        [Effect::None, Effect::Shading].map(|of| Origin(&grid.name, slide.name, of.name()));
    let turn = ("turn of the force from one tick to the next", "°");
    let rows = [
        own.error(
            ("direction off the documented normal", "°"),
            ROUNDING,
            deviation(grid, &shaded),
        ),
        own.error(turn, MAX_TICK_TURN_DEG, turn_angles(&shaded)),
        none.error(turn, None, turn_angles(&plain)),
    ];
    rows.into_iter().flatten().collect()
}

/// Returns the angle of each force to its expected direction, degrees.
fn deviation(grid: &Grid, rendered: &[EffectTick]) -> Vec<f64> {
    let deviation = rendered
        .iter()
        .filter(|record| record.whole)
        .filter_map(|record| {
            let own = normal(record.slopes(grid)?);
            let [x, y, _] = record.proxy;
            let expected = turn_toward(own, normal(smoothed(grid, [x, y])?));
            Some(degrees(record.force_n, expected))
        });
    deviation.collect()
}

/// Returns the angles between successive forces while the proxy moves evenly, degrees: shading does
/// not move a proxy that leaves a ridge.
fn turn_angles(rendered: &[EffectTick]) -> Vec<f64> {
    let step = |pair: &[EffectTick]| length(minus(pair[1].proxy, pair[0].proxy));
    let pairs = rendered.windows(2);
    let pairs = pairs.filter(|pair| pair[0].whole && pair[1].whole && step(pair) <= MAX_PROXY_STEP);
    let turn = |pair: &[EffectTick]| degrees(pair[0].force_n, pair[1].force_n);
    pairs.map(turn).collect()
}

/// Returns a direction, turned toward another.
fn turn_toward(from: Vector, to: Vector) -> Vector {
    if degrees(from, to) <= MAX_TURN_DEG {
        return to;
    }
    let axis = unit(cross(from, to));
    let (sin, cos) = MAX_TURN_DEG.to_radians().sin_cos();
    plus(from.map(|x| x * cos), cross(axis, from), sin)
}

/// Returns the slopes eastward and northward that change gradually from patch to patch; `None` at
/// the border of the field.
fn smoothed(grid: &Grid, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let (column, row) = (x.floor() as usize, y.floor() as usize);
    let is_inside = column > 0 && row > 0 && column + 2 <= grid.columns && row + 2 <= grid.rows;
    if !is_inside {
        return None;
    }
    let (u, v) = (x - x.floor(), y - y.floor());
    let post = |column: usize, row: usize| f64::from(grid.post(column, row));
    let east = |row: usize| edge_slope([0, 1, 2, 3].map(|i| post(column + i - 1, row)), u);
    let north = |column: usize| edge_slope([0, 1, 2, 3].map(|i| post(column, row + i - 1)), v);
    let mixed = |a: f64, b: f64, share: f64| a * (1.0 - share) + b * share;
    Some([
        mixed(east(row), east(row + 1), v),
        mixed(north(column), north(column + 1), u),
    ])
}

/// Returns the smoothed slope at a point s of the edge between the middle two of four samples.
fn edge_slope(posts: [f64; 4], s: f64) -> f64 {
    let direction = |i: usize| {
        let rise = posts[i + 1] - posts[i];
        let length = rise.hypot(1.0);
        [1.0 / length, rise / length]
    };
    let [before, own, after] = [direction(0), direction(1), direction(2)];
    let share = |neighbour: [f64; 2], from: f64| {
        let bend = (own[0] * neighbour[0] + own[1] * neighbour[1]).clamp(-1.0, 1.0);
        0.5 * (1.0 - from / blend_length(bend)).max(0.0)
    };
    let (start, end) = (share(before, s), share(after, 1.0 - s));
    let [run, rise] =
        [0, 1].map(|i| own[i] + start * (before[i] - own[i]) + end * (after[i] - own[i]));
    rise / run
}

/// Returns the fraction of an edge along which the direction changes, from the cosine of the bend.
fn blend_length(bend: f64) -> f64 {
    let (gentle, sharp) = (45_f64.to_radians().cos(), 75_f64.to_radians().cos());
    let even = (bend - sharp) / (gentle - sharp);
    0.2 + 0.8 * even.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::vector::dot;
    use crate::tick_states::terrain;

    #[test]
    fn shading_error_of_one_degree_or_no_shading_is_detected() {
        let grid = terrain();
        let slide = path::slide_at(&grid, "", [STEP, DEPTH], 2000);
        let worst =
            |rendered: &[EffectTick]| deviation(&grid, rendered).into_iter().fold(0.0, f64::max);
        let shaded = render(&grid, Effect::Shading.params(), &slide.hips);
        assert!(worst(&shaded) < ROUNDING);
        let (sin, cos) = 1_f64.to_radians().sin_cos();
        let mut wrong = shaded.clone();
        for rendered in &mut wrong {
            let [x, y, z] = rendered.force_n;
            rendered.force_n = [x * cos + z * sin, y, z * cos - x * sin];
        }
        // A force along the axis of the turn does not change.
        let min = deviation(&grid, &wrong)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(worst(&wrong) > 0.9 && min > ROUNDING, "{min}");
        let plain = render(&grid, Effect::None.params(), &slide.hips);
        assert!(worst(&plain) > 1.0);
        assert!(turn_angles(&plain).into_iter().fold(0.0, f64::max) > 1.0);
    }

    /// Bends of all sizes, and turns of more than 60°.
    #[test]
    fn shading_on_rough_ground_matches_its_documentation() {
        let mut random = path::Random(3);
        let rough = Grid::from_fn("rough", [64, 64], |_, _| random.between(0.0, 6.0) as f32);
        let slide = path::slide_at(&rough, "", [STEP, DEPTH], 8000);
        let shaded = render(&rough, Effect::Shading.params(), &slide.hips);
        let deviation = deviation(&rough, &shaded);
        let worst = deviation.iter().copied().fold(0.0, f64::max);
        let max = shaded.iter().filter_map(|record| {
            let own = normal(record.slopes(&rough)?);
            Some(degrees(own, record.force_n))
        });
        let max = max.fold(0.0, f64::max);
        assert!(
            deviation.len() > 2000 && max > MAX_TURN_DEG - 1.0,
            "{}: {max}",
            deviation.len()
        );
        assert!(worst < ROUNDING, "{worst}");
    }

    #[test]
    fn slopes_are_blended_at_samples_but_cliffs_stay() {
        // Directions of 0 and 45° are blended at the sample to 22.5°.
        let slope = edge_slope([0.0, 0.0, 1.0, 2.0], 0.0);
        assert!((slope - 22.5_f64.to_radians().tan()).abs() < 1e-12);
        // A wall of 84°: a fifth of an edge from its foot, the ground is level.
        assert!(edge_slope([0.0, 0.0, 0.0, 10.0], 0.799).abs() < 1e-12);
        assert!(edge_slope([0.0, 0.0, 0.0, 10.0], 0.9) > 0.0);
        assert!(length(turn_toward([0.0, 0.0, 1.0], [1.0, 0.0, 0.0])) - 1.0 < 1e-12);
        let max = turn_toward([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        assert!((dot(max, [0.0, 0.0, 1.0]) - 0.5).abs() < 1e-12);
    }
}
