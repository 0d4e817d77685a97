//! The parts alone: the closest point of one patch with every solver setting, and the ray's
//! quadratic with every square root.

use std::hint::black_box;

use hapterra_core::contact::closest_point::nearest_downhill;
use hapterra_core::contact::surface::patch::Patch;
use num_traits::Float;

use crate::baseline::newton;
use crate::clock::Stopwatch;
use crate::compare::{Effort, Error, Family, Label, Row};
use crate::grid::Grid;
use crate::oracle::{self, Deviation};
use crate::path::Random;
use crate::stats::{interleave, timing};

/// Patches, or rays, in one measurement.
const CASES: usize = 2000;
/// Steepest slopes and twists of the patches, one table each.
const SLOPES: [f64; 4] = [0.3, 1.0, 10.0, 100.0];

/// One patch and a HIP below it.
struct Case {
    grid: Grid,
    corners: [f32; 4],
    hip: [f64; 3],
    /// Result of the last tick, for a HIP 0.01 cell away.
    last: (f32, f32),
}

impl Case {
    fn random(random: &mut Random, slope: f64) -> Self {
        let corners: [f32; 4] = std::array::from_fn(|_| random.between(0.0, slope) as f32);
        let grid = Grid::from_fn("patch", [1, 1], |x, y| corners[2 * y + x]);
        let (x, y) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
        // Depths from 0.01 to 1 cell.
        let depth = 10_f64.powf(random.between(-2.0, 0.0));
        let single = |x: f64| f64::from(x as f32);
        let hip = [single(x), single(y), single(grid.height(x, y) - depth)];
        let turn = random.between(0.0, std::f64::consts::TAU);
        let previous = [
            hip[0] + 0.01 * turn.cos(),
            hip[1] + 0.01 * turn.sin(),
            hip[2],
        ];
        let last = oracle::closest(&grid, &previous, [x, y]).unwrap_or(hip);
        Self {
            corners,
            hip,
            last: (last[0] as f32, last[1] as f32),
            grid,
        }
    }

    fn converge(&self, start: (f32, f32)) -> (f64, f64) {
        let z = self.hip[2] as f32;
        let patch = Patch::new(self.corners.map(|h| h - z));
        let hip = (self.hip[0] as f32, self.hip[1] as f32);
        let found = nearest_downhill(&patch, hip, start);
        (f64::from(found.u), f64::from(found.v))
    }

    fn newton_single(&self, iterations: u32) -> (f64, f64) {
        let (u, v) = newton(self.corners, self.hip.map(|x| x as f32), iterations);
        (f64::from(u), f64::from(v))
    }

    fn newton_double(&self, iterations: u32) -> (f64, f64) {
        newton(self.corners.map(f64::from), self.hip, iterations)
    }

    /// Returns the errors of a point compared with the local closest point below it.
    fn deviation(&self, (u, v): (f64, f64)) -> Option<Deviation> {
        // The upper borders belong to this patch, as there is no other.
        let inside = |x: f64| x.clamp(0.0, 1.0 - f64::EPSILON);
        let from = [inside(u), inside(v)];
        let exact = oracle::closest(&self.grid, &self.hip, from)?;
        let displacement = [
            u - self.hip[0],
            v - self.hip[1],
            self.grid.height(u, v) - self.hip[2],
        ];
        let force = [0, 1, 2].map(|i| exact[i] - self.hip[i]);
        let off = [0, 1, 2].map(|i| displacement[i] - force[i]);
        Some(Deviation {
            error: oracle::length(&off),
            angle: oracle::angle(&displacement, &force),
        })
    }
}

/// A solver of a case: its name, its origin, and its function.
type Solver<Case, Found> = (&'static str, Family, fn(&Case) -> Found);

const SOLVERS: [Solver<Case, (f64, f64)>; 11] = [
    ("Newton f32, 10", Family::Paper, |case| {
        case.newton_single(10)
    }),
    ("Newton f32, 1", Family::Paper, |case| case.newton_single(1)),
    ("Newton f32, 2", Family::Paper, |case| case.newton_single(2)),
    ("Newton f32, 3", Family::Paper, |case| case.newton_single(3)),
    ("Newton f32, 5", Family::Paper, |case| case.newton_single(5)),
    ("Newton f32, 50", Family::Paper, |case| {
        case.newton_single(50)
    }),
    ("Newton f64, 3", Family::Paper, |case| case.newton_double(3)),
    ("Newton f64, 10", Family::Paper, |case| {
        case.newton_double(10)
    }),
    ("Newton f64, 50", Family::Paper, |case| {
        case.newton_double(50)
    }),
    ("hapterra, from the centre", Family::Ours, |case| {
        case.converge((0.5, 0.5))
    }),
    ("hapterra, from the last", Family::Ours, |case| {
        case.converge(case.last)
    }),
];

/// Measures the closest point of one patch, by solver and slope.
#[must_use]
pub fn patches(effort: Effort) -> Vec<Row> {
    let rows = |slope: f64| {
        let mut random = Random(21);
        let cases: Vec<Case> = (0..CASES)
            .map(|_| Case::random(&mut random, slope))
            .collect();
        let terrain = format!("one patch, slope {slope}");
        let (first, rest) = cases.split_at(effort.compared.min(CASES));
        measure(
            (&terrain, "closest"),
            &SOLVERS,
            [first, rest],
            effort,
            Case::deviation,
        )
    };
    SLOPES.into_iter().flat_map(rows).collect()
}

/// Times every solver over all cases, in turn, and checks it on the first of them.
fn measure<Case, Found>(
    (terrain, path): (&str, &'static str),
    solvers: &[Solver<Case, Found>],
    [compared, rest]: [&[Case]; 2],
    effort: Effort,
    deviation: impl Fn(&Case, Found) -> Option<Deviation>,
) -> Vec<Row> {
    let times = interleave(solvers.len(), effort.rounds, |index| {
        let watch = Stopwatch::start();
        for case in compared.iter().chain(rest) {
            black_box(solvers[index].2(black_box(case)));
        }
        watch.elapsed().as_secs_f64() * 1e9 / CASES as f64
    });
    let rows = solvers
        .iter()
        .zip(&times)
        .map(|((name, family, solve), own)| {
            let deviations = compared
                .iter()
                .filter_map(|case| deviation(case, solve(case)));
            let (ns, ratio) = timing(own, &times[0]);
            Row {
                terrain: terrain.to_owned(),
                path,
                label: Label {
                    name,
                    family: *family,
                    extra_bytes: 0.0,
                },
                ns,
                ratio,
                error: Error::of(&deviations.collect::<Vec<_>>()),
                jump: 0.0,
                missed: 0.0,
                unconverged: 0.0,
            }
        });
    rows.collect()
}

/// Bernstein coefficients of a height gap that has a crossing.
type Gap = [f32; 3];

/// Returns the first root as [`hapterra_core::contact::crossing`] does, with any square root: the
/// only place where a tick in contact or in the air needs one.
#[inline]
fn root<R: Float>([start, middle, end]: [R; 3], sqrt: impl Fn(R) -> R) -> R {
    let root = sqrt(middle * middle - start * end);
    if middle >= R::zero() {
        start / (start - (middle + root))
    } else {
        let t = root - middle;
        t / (t + end)
    }
}

const ROOTS: [Solver<Gap, f32>; 3] = [
    ("libm", Family::Ours, |gap| root(*gap, libm::sqrtf)),
    ("processor", Family::Ours, |gap| root(*gap, f32::sqrt)),
    ("micromath", Family::Paper, |gap| {
        root(*gap, micromath::F32Ext::sqrt)
    }),
];

/// Measures the ray's quadratic, by square root. Errors are fractions of the ray.
#[must_use]
pub fn roots(effort: Effort) -> Vec<Row> {
    let mut random = Random(22);
    let mut gap = || {
        let middle = random.between(-1.0, 1.0);
        [-random.between(0.0, 1.0), middle, random.between(0.0, 1.0)].map(|x| x as f32)
    };
    let gaps: Vec<Gap> = (0..CASES).map(|_| gap()).collect();
    let deviation = |gap: &Gap, found: f32| {
        let exact = root(gap.map(f64::from), f64::sqrt);
        Some(Deviation {
            error: (f64::from(found) - exact).abs(),
            angle: 0.0,
        })
    };
    let place = ("ray quadratic", "square root");
    measure(place, &ROOTS, [&gaps, &[]], effort, deviation)
}
