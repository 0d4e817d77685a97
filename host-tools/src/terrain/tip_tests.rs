//! Centres of balls against a search that shares nothing with them: the bilinear surface and the
//! ball, place by place, in `f64`.

use super::*;

/// Where the bilinear surface of a block is at a place; none where a corner has no data.
fn surface(block: &Block, [u, v]: [f64; 2]) -> Option<f64> {
    let cell = |at: f64, samples: usize| {
        let inside = (0.0..=(samples - 1) as f64).contains(&at);
        let cell = (at.floor() as usize).min(samples - 2);
        inside.then_some((cell, at - cell as f64))
    };
    let ((x, s), (y, t)) = (cell(u, block.columns)?, cell(v, block.rows)?);
    let at = |dx: usize, dy: usize| block.heights[(y + dy) * block.columns + x + dx];
    let [south, north] = [0, 1].map(|dy| at(0, dy) * (1.0 - s) + at(1, dy) * s);
    let height = south * (1.0 - t) + north * t;
    // Also where the corner without data has no weight.
    let known = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)]
        .iter()
        .all(|h| !h.is_nan());
    known.then_some(height)
}

/// The height of a ball's centre over a place: the best of a fine grid, and then of finer ones
/// around the best places of that.
fn centre(block: &Block, [u, v]: [f64; 2], radius: f64) -> f64 {
    let ball = |place: [f64; 2]| {
        let squared = radius * radius - (place[0] - u).powi(2) - (place[1] - v).powi(2);
        // On a grid line the patches on either side count.
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
    // Samples and grid lines themselves, too.
    for column in 0..block.columns {
        for row in 0..block.rows {
            let place = [column as f64, row as f64];
            places.push((ball(place), place));
        }
    }
    places.sort_by(|a, b| b.0.total_cmp(&a.0));
    places.truncate(16);
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

/// A block of `side` samples within a halo, from heights by column and row of its middle.
fn block(radius: f64, side: usize, height: impl Fn(i32, i32) -> f64) -> (Ball, Block) {
    let ball = Ball::new(radius);
    let samples = side + 2 * ball.halo();
    let place = |at: usize| at as i32 - ball.halo() as i32;
    let all = (0..samples * samples).map(|at| height(place(at % samples), place(at / samples)));
    let heights = all.collect();
    let block = Block {
        columns: samples,
        rows: samples,
        heights,
    };
    (ball, block)
}

const RADII: [f64; 7] = [0.3, 1.0, 1.7, 2.5, 4.0, 6.3, 8.0];

/// Random heights in -1 to 1 by column and row.
fn noise(column: i32, row: i32) -> f64 {
    let mut x = (column as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (row as u64).wrapping_mul(0xd6e8_feb8_6659_fd93);
    x = (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 32)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x >> 11) as f64 / (1u64 << 53) as f64) * 2.0 - 1.0
}

#[test]
fn a_ball_on_a_plane_is_its_radius_off_it() {
    for radius in RADII {
        for [east, north] in [[0.0, 0.0], [0.5, 0.0], [0.0, -2.0], [1.0, 1.0], [-3.0, 4.0]] {
            let plane = |x: i32, y: i32| east * f64::from(x) + north * f64::from(y);
            let (ball, block) = block(radius, 3, plane);
            let steep = (1.0f64 + east * east + north * north).sqrt();
            for (at, centre) in ball.centres(&block).heights.iter().enumerate() {
                let off = centre - plane(at as i32 % 3, at as i32 / 3);
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
fn a_ball_rests_on_poles_walls_and_pits_as_a_search_finds() {
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
            let (ball, block) = block(radius, 3, shape);
            let centres = ball.centres(&block);
            for (at, found) in centres.heights.iter().enumerate() {
                let place = [at % 3, at / 3].map(|at| (at + ball.halo()) as f64);
                // Not higher than the ball, and nothing is nearer than 1 % less than the radius.
                let sought = centre(&block, place, radius);
                let smaller = centre(&block, place, 0.99 * radius);
                let is_right = *found < sought + 1e-6 * radius && *found > smaller;
                assert!(
                    is_right,
                    "{name}, radius {radius}, node {at}: {found} between {smaller} and {sought}"
                );
            }
        }
    }
}

#[test]
fn samples_without_data_stay_without_and_bear_nothing() {
    let hole = |x: i32, y: i32| match (x, y) {
        (1, 1) => f64::NAN,
        _ if x > 3 => f64::NAN,
        _ => f64::from(x),
    };
    let (ball, block) = block(2.0, 6, hole);
    let centres = ball.centres(&block);
    for (at, centre) in centres.heights.iter().enumerate() {
        let (x, y) = (at as i32 % 6, at as i32 / 6);
        assert_eq!(centre.is_nan(), hole(x, y).is_nan(), "{x} {y}");
        assert!(
            centre.is_nan() || *centre >= hole(x, y) + 2.0,
            "{x} {y}: {centre}"
        );
    }
    // A sample of no whole patch bears the ball over itself alone.
    let lone = |x: i32, y: i32| match (x, y) {
        (1, 1) => 50.0,
        (0..=2, 0..=2) => f64::NAN,
        _ => 0.0,
    };
    let (ball, block) = self::block(3.0, 5, lone);
    let centres = ball.centres(&block);
    assert_eq!(centres.heights[5 + 3], 3.0);
    assert_eq!(centres.heights[5 + 1], 53.0);
}
