//! A proxy passes no crest of its patch, for any motion of the HIP in a tick.

use std::vec;

use glam::Vec3;

use super::test_random::Random;
use super::{Contact, ContactSettings, ContactState};
use crate::cases::cases;
use crate::grid::GridPoint;
use crate::terrain::FieldSize;
use crate::terrain::testing::{Field, buffers};

/// A single patch, in the cell (1, 1) of a field of no-data.
#[derive(Clone, Copy, Debug)]
struct Single([f32; 4]);

impl Single {
    fn height(&self, u: f64, v: f64) -> f64 {
        let [sw, se, nw, ne] = self.0.map(f64::from);
        (sw * (1.0 - u) + se * u) * (1.0 - v) + (nw * (1.0 - u) + ne * u) * v
    }

    /// The proxies for the last two of these HIPs, in the patch; `None` unless both touch.
    fn proxies(&self, hips: &[[f64; 3]]) -> Option<[[f64; 3]; 2]> {
        let mut tiles = buffers::<1>();
        let corners = self.0;
        let field = Field::<1>::filled(&mut tiles, FieldSize::new(3, 3), move |x, y| {
            let is_corner = (1..=2).contains(&x) && (1..=2).contains(&y);
            let corner = (x - 1) + 2 * (y - 1);
            if is_corner {
                corners[corner as usize]
            } else {
                f32::NAN
            }
        });
        let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
        let mut rendered = vec![];
        for hip in hips {
            let hip = GridPoint::new([1, 1, 0], Vec3::from_array(hip.map(|c| c as f32)));
            while !contact.step(&field.window, &hip).converged {}
            let output = contact.output();
            let proxy = GridPoint::new([1, 1, 0], Vec3::ZERO).to(&output.proxy);
            let touches = output.state == ContactState::Touching;
            rendered.push(touches.then(|| proxy.to_array().map(f64::from)));
        }
        let last = rendered.last_chunk::<2>()?;
        Some([last[0]?, last[1]?])
    }

    /// Returns true if two places are joined by columns whose ground, or air over it, is no farther
    /// from the HIP than `reach`.
    fn joins(&self, hip: [f64; 3], [from, to]: [[f64; 3]; 2], reach: f64) -> bool {
        const SIDE: usize = 200;
        let column = |at: [f64; 3]| [at[0], at[1]].map(|c| (c * SIDE as f64).round() as usize);
        let is_open = |[i, j]: [usize; 2]| {
            let [u, v] = [i, j].map(|c| c as f64 / SIDE as f64);
            let up = reach * reach - (u - hip[0]).powi(2) - (v - hip[1]).powi(2);
            up >= 0.0 && self.height(u, v) - hip[2] <= up.sqrt()
        };
        let (start, end) = (column(from), column(to));
        let mut reached = vec![false; (SIDE + 1) * (SIDE + 1)];
        let mut edge = vec![start];
        while let Some([i, j]) = edge.pop() {
            if i.abs_diff(end[0]).max(j.abs_diff(end[1])) <= 1 {
                return true;
            }
            let beside = [
                (i.wrapping_sub(1), j),
                (i + 1, j),
                (i, j.wrapping_sub(1)),
                (i, j + 1),
            ];
            for (i, j) in beside {
                if i <= SIDE && j <= SIDE && is_open([i, j]) {
                    let was_reached = core::mem::replace(&mut reached[j * (SIDE + 1) + i], true);
                    if !was_reached {
                        edge.push([i, j]);
                    }
                }
            }
        }
        false
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// One in 150 such moves ended on the other side of the patch's crest.
#[test]
fn proxy_passes_no_crest_of_a_twisted_patch() {
    let mut random = Random(39);
    let (mut tried, mut wrong) = (0, 0);
    while tried < cases(4_000, 40) {
        let single = Single([0; 4].map(|_| random.between(-8.0, 8.0) as f32));
        let from = [random.between(0.0, 1.0), random.between(0.0, 1.0)];
        let ground = single.height(from[0], from[1]);
        let (turn, rise) = (
            random.between(0.0, core::f64::consts::TAU),
            random.between(-1.2, 1.2),
        );
        let first = [from[0], from[1], ground - random.between(0.0, 1.5)];
        let along = 0.8 * libm::cos(rise);
        let hip = [
            first[0] + along * libm::cos(turn),
            first[1] + along * libm::sin(turn),
            first[2] + 0.8 * libm::sin(rise),
        ];
        let is_inside = (0.0..=1.0).contains(&hip[0]) && (0.0..=1.0).contains(&hip[1]);
        if !is_inside || single.height(hip[0], hip[1]) < hip[2] {
            continue;
        }
        let above = [from[0], from[1], ground + 0.5];
        let Some(proxies) = single.proxies(&[above, first, hip]) else {
            continue;
        };
        tried += 1;
        let reach = distance(proxies[0], hip) + 0.01;
        wrong += u32::from(!single.joins(hip, proxies, reach));
    }
    assert_eq!(wrong, 0, "of {tried}");
}

/// Corners, the last two HIPs, and the right place of the proxy.
#[test]
fn proxy_ends_in_its_basin_after_a_move_of_0_8_cell() {
    let cases = [
        (
            [-2.03125, 3.109_375, 4.0, -1.65625],
            [
                [0.309_997_558, 0.161_788_940, -1.102_337_002],
                [0.010_604_858, 0.872_009_277, -0.887_985_468],
            ],
            [0.0, 0.2078, -0.7779],
        ),
        (
            [3.78125, -7.125, -3.4375, 5.359_375],
            [
                [0.505_920_410, 0.203_802_109, -2.394_594_669],
                [0.865_554_809, 0.896_827_698, -2.568_895_578],
            ],
            [1.0, 0.3683, -2.5266],
        ),
        (
            [-5.546_875, 6.5625, 4.234_375, -4.765_625],
            [
                [0.563_574_553, 0.842_498_779, -1.949_535_131],
                [0.904_815_674, 0.188_018_799, -2.258_121_252],
            ],
            [1.0, 0.7741, -2.2064],
        ),
    ];
    for (corners, [first, hip], right) in cases {
        let above = [first[0], first[1], 9.0];
        let [_, proxy] = Single(corners)
            .proxies(&[above, first, hip])
            .expect("both touch");
        assert!(distance(proxy, right) < 1e-3, "{proxy:?} for {right:?}");
    }
}
