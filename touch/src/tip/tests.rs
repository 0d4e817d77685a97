//! Centres of balls, compared with a search that shares no code with them: the bilinear surface and
//! the ball, position by position, in `f64`.

use std::vec::Vec;

use super::*;

/// Returns the height of the bilinear surface of a block at a position; `None` if a corner has no
/// data.
fn surface(block: &Samples, [u, v]: [f64; 2]) -> Option<f64> {
    let cell = |at: f64, samples: usize| {
        let inside = (0.0..=(samples - 1) as f64).contains(&at);
        let cell = (at.floor() as usize).min(samples - 2);
        inside.then_some((cell, at - cell as f64))
    };
    let ((x, s), (y, t)) = (cell(u, block.columns)?, cell(v, block.rows)?);
    let at = |dx: usize, dy: usize| block.heights[(y + dy) * block.columns + x + dx];
    let [south, north] = [0, 1].map(|dy| at(0, dy) * (1.0 - s) + at(1, dy) * s);
    let height = south * (1.0 - t) + north * t;
    // Also if the corner without data has weight zero.
    let known = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)]
        .iter()
        .all(|h| !h.is_nan());
    known.then_some(height)
}

/// Returns the height of a ball's centre over a position: the maximum on a fine grid, and then on
/// finer ones around its best positions.
fn centre(block: &Samples, [u, v]: [f64; 2], radius: f64) -> f64 {
    let ball = |place: [f64; 2]| {
        let squared = radius * radius - (place[0] - u).powi(2) - (place[1] - v).powi(2);
        // On a grid line the patches on both sides count.
        let near = [
            [1e-12, 1e-12],
            [-1e-12, 1e-12],
            [1e-12, -1e-12],
            [-1e-12, -1e-12],
        ];
        let heights = near
            .iter()
            .filter_map(|d| surface(block, [place[0] + d[0], place[1] + d[1]]));
        let height = heights.fold(f64::NEG_INFINITY, f64::max);
        if squared < 0.0 {
            f64::NEG_INFINITY
        } else {
            height + squared.sqrt()
        }
    };
    let steps = 40 + 8 * radius.ceil() as i32;
    let mut step = radius / f64::from(steps);
    let mut places = Vec::new();
    for y in -steps..=steps {
        for x in -steps..=steps {
            let place = [u + f64::from(x) * step, v + f64::from(y) * step];
            places.push((ball(place), place));
        }
    }
    // Also samples and grid lines themselves.
    for column in 0..block.columns {
        for row in 0..block.rows {
            let at = [column as f64, row as f64];
            for part in 0..8 {
                let on = f64::from(part) / 8.0;
                for place in [[at[0] + on, at[1]], [at[0], at[1] + on]] {
                    places.push((ball(place), place));
                }
            }
        }
    }
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    places.truncate(32);
    for _ in 0..35 {
        step *= 0.7;
        for best in &mut places {
            let from = best.1;
            for y in -1..=1 {
                for x in -1..=1 {
                    let place = [from[0] + f64::from(x) * step, from[1] + f64::from(y) * step];
                    let height = ball(place);
                    if height > best.0 {
                        *best = (height, place);
                    }
                }
            }
        }
    }
    places
        .iter()
        .map(|best| best.0)
        .fold(f64::NEG_INFINITY, f64::max)
}

/// A ball over heights by column and row, rendered from the node on the sample at zero.
struct BallOnHeights {
    /// Haptic cells along the side of a cell.
    parts: usize,
    /// Samples around that node.
    halo: usize,
    /// The samples, in cells.
    block: Samples,
    /// Nodes along a side, and the centres over them, in cells.
    side: usize,
    centres: Vec<f64>,
}

impl BallOnHeights {
    /// Creates a ball of a radius in cells of a millimetre, over `cells` cells in each direction.
    fn new(radius: f64, cells: usize, height: impl Fn(i32, i32) -> f64) -> Self {
        let ball = Ball::of(radius, 1.0);
        let parts = ball.parts() as usize;
        let side = cells * parts + 1;
        let (first, samples, nodes) = ball.samples_for([0, 0], side);
        let place = |at: usize| at as i32 + first[0] as i32;
        let all = (0..samples * samples).map(|at| height(place(at % samples), place(at / samples)));
        let block = |scale: f64, heights: &[f64]| Samples {
            columns: samples,
            rows: samples,
            heights: heights.iter().map(|height| height * scale).collect(),
        };
        let heights: Vec<_> = all.collect();
        let haptic = f64::from(ball.parts());
        let centres = ball.centres(&block(haptic, &heights), nodes);
        Self {
            parts,
            halo: ball.halo(),
            block: block(1.0, &heights),
            side,
            centres: centres.iter().map(|centre| centre / haptic).collect(),
        }
    }

    /// Returns the centre over a node by column and row.
    fn centre(&self, [column, row]: [usize; 2]) -> f64 {
        self.centres[row * self.side + column]
    }

    /// Returns the position of a node, in cells from the sample at zero.
    fn place(&self, node: [usize; 2]) -> [f64; 2] {
        node.map(|node| node as f64 / self.parts as f64)
    }

    /// Returns the position of a node, in cells from the block's first sample.
    fn in_block(&self, node: [usize; 2]) -> [f64; 2] {
        self.place(node).map(|place| place + self.halo as f64)
    }

    fn nodes(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let side = self.side;
        (0..side * side).map(move |at| [at % side, at / side])
    }
}

const RADII: [f64; 7] = [0.3, 1.0, 1.7, 2.5, 4.0, 6.3, 8.0];

/// Returns random heights in -1 to 1 by column and row.
fn noise(column: i32, row: i32) -> f64 {
    let mut x = (column as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (row as u64).wrapping_mul(0xd6e8_feb8_6659_fd93);
    x = (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 32)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x >> 11) as f64 / (1u64 << 53) as f64) * 2.0 - 1.0
}

#[test]
fn ball_on_a_plane_is_one_radius_away() {
    for radius in RADII {
        for [east, north] in [[0.0, 0.0], [0.5, 0.0], [0.0, -2.0], [1.0, 1.0], [-3.0, 4.0]] {
            let plane = |x: f64, y: f64| east * x + north * y;
            let ball_on = BallOnHeights::new(radius, 1, |x, y| plane(f64::from(x), f64::from(y)));
            let steep = (1.0f64 + east * east + north * north).sqrt();
            for node in ball_on.nodes() {
                let [x, y] = ball_on.place(node);
                let off = ball_on.centre(node) - plane(x, y);
                // Normal to the plane.
                let off = (off / steep - radius) / radius;
                assert!(
                    (-5.1e-3..1e-12).contains(&off),
                    "{radius} {east} {north}: {off}"
                );
            }
        }
    }
}

/// Heights by column and row.
type Shape<'s> = &'s dyn Fn(i32, i32) -> f64;

#[test]
fn ball_height_agrees_with_a_search_on_poles_walls_and_pits() {
    let shapes: [(&str, Shape<'_>); 9] = [
        ("pole", &|x, y| if (x, y) == (2, 1) { 10.0 } else { 0.0 }),
        ("pit", &|x, y| if (x, y) == (2, 1) { -10.0 } else { 0.0 }),
        ("wall", &|x, _| if x >= 2 { 20.0 } else { 0.0 }),
        ("diagonal wall", &|x, y| if x + y >= 3 { 20.0 } else { 0.0 }),
        ("trench", &|_, y| if y == 2 { -6.0 } else { 0.0 }),
        ("checkers", &|x, y| if (x + y) % 2 == 0 { 3.0 } else { 0.0 }),
        ("saddle", &|x, y| 0.3 * f64::from(x * y)),
        ("noise", &|x, y| noise(x, y)),
        ("steep noise", &|x, y| 8.0 * noise(x, y)),
    ];
    for radius in [0.3, 1.0, 2.5, 8.0] {
        for (name, shape) in shapes {
            let ball_on = BallOnHeights::new(radius, 2, shape);
            // On samples and between them.
            let along = [
                0,
                ball_on.parts / 3,
                (17 * ball_on.parts).div_ceil(10),
                2 * ball_on.parts,
            ];
            let nodes = along.map(|row| along.map(|column| [column, row]));
            for node in nodes.into_iter().flatten() {
                let (place, found) = (ball_on.in_block(node), ball_on.centre(node));
                // Not higher than the ball, and no ground is nearer than 99 % of the radius.
                let expected = centre(&ball_on.block, place, radius);
                let smaller = centre(&ball_on.block, place, 0.99 * radius);
                let is_right = found < expected + 1e-6 * radius && found > smaller;
                assert!(
                    is_right,
                    "{name}, radius {radius}, node {node:?}: {found} between {smaller} and {expected}"
                );
            }
        }
    }
}

#[test]
fn no_data_samples_stay_no_data_and_support_nothing() {
    let hole = |x: i32, y: i32| match (x, y) {
        (1, 1) => f64::NAN,
        _ if x > 3 => f64::NAN,
        _ => f64::from(x),
    };
    let ball_on = BallOnHeights::new(2.0, 5, hole);
    for node in ball_on.nodes() {
        let ([x, y], centre) = (ball_on.place(node), ball_on.centre(node));
        // A patch with such a sample has none; its border with a whole patch has one.
        let own = surface(&ball_on.block, ball_on.in_block(node));
        let is_border = [x, y].iter().any(|place| place.fract() == 0.0);
        assert!(own.is_none() || !centre.is_nan(), "{x} {y}");
        assert!(own.is_some() || is_border || centre.is_nan(), "{x} {y}");
        if [x, y].iter().all(|place| place.fract() == 0.0) {
            let sample = hole(x as i32, y as i32);
            assert_eq!(centre.is_nan(), sample.is_nan(), "{x} {y}");
            assert!(
                centre.is_nan() || centre >= sample + 2.0,
                "{x} {y}: {centre}"
            );
        }
    }
    // A sample without a whole patch supports the ball only over itself.
    let lone = |x: i32, y: i32| match (x, y) {
        (1, 1) => 50.0,
        (0..=2, 0..=2) => f64::NAN,
        _ => 0.0,
    };
    let ball_on = BallOnHeights::new(3.0, 4, lone);
    let on = |x: usize, y: usize| ball_on.centre([x, y].map(|place| place * ball_on.parts));
    assert_eq!(on(3, 1), 3.0);
    assert_eq!(on(1, 1), 53.0);
    assert!(ball_on.centre([ball_on.parts + 1, ball_on.parts]).is_nan());
}
