//! The parts alone: the closest point of one patch by every solver setting,
//! and the ray's quadratic by every square root.

use std::hint::black_box;

use hapterra_core::contact::closest::nearest_downhill;
use hapterra_core::contact::patch::Patch;

use crate::baseline::newton;
use crate::clock::Stopwatch;
use crate::compare::{Effort, Error, Family, Label, Row};
use crate::grid::Grid;
use crate::path::Dice;
use crate::stats::{interleave, quantiles};
use crate::truth::{self, Verdict};

/// Patches, or rays, in one measurement.
const CASES: usize = 2000;
/// Steepest slopes and twists of the patches, one table each.
const SLOPES: [f64; 4] = [0.3, 1.0, 10.0, 100.0];

/// One patch and a hand below it.
struct Case {
    grid: Grid,
    corners: [f32; 4],
    hand: [f64; 3],
    /// Where the last tick's answer was, for a hand 0.01 cell away.
    last: (f32, f32),
}

impl Case {
    fn random(dice: &mut Dice, slope: f64) -> Self {
        let corners: [f32; 4] = std::array::from_fn(|_| dice.between(0.0, slope) as f32);
        let grid = Grid::from_fn("patch", [1, 1], |x, y| corners[2 * y + x]);
        let (x, y) = (dice.between(0.0, 1.0), dice.between(0.0, 1.0));
        // Depths from 0.01 to 1 cell.
        let depth = 10_f64.powf(dice.between(-2.0, 0.0));
        let single = |x: f64| f64::from(x as f32);
        let hand = [single(x), single(y), single(grid.height(x, y) - depth)];
        let turn = dice.between(0.0, std::f64::consts::TAU);
        let before = [
            hand[0] + 0.01 * turn.cos(),
            hand[1] + 0.01 * turn.sin(),
            hand[2],
        ];
        let last = truth::closest(&grid, &before, [x, y]).unwrap_or(hand);
        Self {
            corners,
            hand,
            last: (last[0] as f32, last[1] as f32),
            grid,
        }
    }

    fn ours(&self, start: (f32, f32)) -> (f64, f64) {
        let z = self.hand[2] as f32;
        let patch = Patch::new(self.corners.map(|h| h - z));
        let hand = (self.hand[0] as f32, self.hand[1] as f32);
        let found = nearest_downhill(&patch, hand, start);
        (f64::from(found.u), f64::from(found.v))
    }

    fn newton_single(&self, iterations: u32) -> (f64, f64) {
        let (u, v) = newton(self.corners, self.hand.map(|x| x as f32), iterations);
        (f64::from(u), f64::from(v))
    }

    fn newton_double(&self, iterations: u32) -> (f64, f64) {
        newton(self.corners.map(f64::from), self.hand, iterations)
    }

    /// How far a place is from the local closest point below it.
    fn judge(&self, (u, v): (f64, f64)) -> Option<Verdict> {
        // The upper borders belong to this patch: there is no other.
        let inside = |x: f64| x.clamp(0.0, 1.0 - f64::EPSILON);
        let from = [inside(u), inside(v)];
        let exact = truth::closest(&self.grid, &self.hand, from)?;
        let stretch = [
            u - self.hand[0],
            v - self.hand[1],
            self.grid.height(u, v) - self.hand[2],
        ];
        let force = [0, 1, 2].map(|i| exact[i] - self.hand[i]);
        let off = [0, 1, 2].map(|i| stretch[i] - force[i]);
        Some(Verdict {
            error: truth::length(&off),
            angle: truth::angle(&stretch, &force),
        })
    }
}

type Solver = (&'static str, Family, Box<dyn Fn(&Case) -> (f64, f64)>);

fn solvers() -> Vec<Solver> {
    let single = |name, n| -> Solver {
        let solve = move |case: &Case| case.newton_single(n);
        (name, Family::Paper, Box::new(solve))
    };
    let double = |name, n| -> Solver {
        let solve = move |case: &Case| case.newton_double(n);
        (name, Family::Paper, Box::new(solve))
    };
    vec![
        single("Newton f32, 10", 10),
        single("Newton f32, 1", 1),
        single("Newton f32, 2", 2),
        single("Newton f32, 3", 3),
        single("Newton f32, 5", 5),
        single("Newton f32, 50", 50),
        double("Newton f64, 3", 3),
        double("Newton f64, 10", 10),
        double("Newton f64, 50", 50),
        (
            "hapterra, from the centre",
            Family::Ours,
            Box::new(|case| case.ours((0.5, 0.5))),
        ),
        (
            "hapterra, from the last",
            Family::Ours,
            Box::new(|case| case.ours(case.last)),
        ),
    ]
}

/// The closest point of one patch, by solver and slope.
#[must_use]
pub fn patches(effort: Effort) -> Vec<Row> {
    SLOPES
        .iter()
        .flat_map(|slope| patch_rows(*slope, effort))
        .collect()
}

fn patch_rows(slope: f64, effort: Effort) -> Vec<Row> {
    let mut dice = Dice(21);
    let cases: Vec<Case> = (0..CASES).map(|_| Case::random(&mut dice, slope)).collect();
    let solvers = solvers();
    let times = interleave(solvers.len(), effort.rounds, |index| {
        let watch = Stopwatch::start();
        for case in &cases {
            black_box(solvers[index].2(black_box(case)));
        }
        watch.elapsed().as_secs_f64() * 1e9 / CASES as f64
    });
    let rows = solvers
        .iter()
        .zip(&times)
        .map(|((name, family, solve), own)| {
            let judged = cases.iter().take(effort.judged);
            let verdicts: Vec<_> = judged.filter_map(|case| case.judge(solve(case))).collect();
            row(
                format!("one patch, slope {slope}"),
                "closest",
                name,
                *family,
                own,
                &times[0],
                &verdicts,
            )
        });
    rows.collect()
}

fn row(
    terrain: String,
    path: &'static str,
    name: &'static str,
    family: Family,
    own: &[f64],
    first: &[f64],
    verdicts: &[Verdict],
) -> Row {
    let ratios = own.iter().zip(first).map(|(own, first)| own / first);
    Row {
        terrain,
        path,
        label: Label {
            name,
            family,
            extra_bytes: 0.0,
        },
        ns: quantiles(own.to_vec(), [0.25, 0.5, 0.75]),
        ratio: quantiles(ratios.collect(), [0.5])[0],
        error: Error::of(verdicts),
        jump: 0.0,
        missed: 0.0,
        unsettled: 0.0,
    }
}

/// Bernstein coefficients of a height gap that has a crossing.
type Gap = [f32; 3];

/// The first root as in [`hapterra_core::contact::crossing`], by any square
/// root: that is the one place where a tick in contact or in the air needs one.
#[inline]
fn root([start, middle, end]: Gap, sqrt: impl Fn(f32) -> f32) -> f32 {
    let root = sqrt(middle * middle - start * end);
    if middle >= 0.0 {
        start / (start - (middle + root))
    } else {
        let t = root - middle;
        t / (t + end)
    }
}

/// The same in f64.
fn exact_root(gap: Gap) -> f64 {
    let [start, middle, end] = gap.map(f64::from);
    let root = (middle * middle - start * end).sqrt();
    if middle >= 0.0 {
        start / (start - (middle + root))
    } else {
        let t = root - middle;
        t / (t + end)
    }
}

/// The ray's quadratic, by square root. Errors are in parts of the ray.
#[must_use]
pub fn roots(effort: Effort) -> Vec<Row> {
    let mut dice = Dice(22);
    let mut gap = || {
        let middle = dice.between(-1.0, 1.0);
        [-dice.between(0.0, 1.0), middle, dice.between(0.0, 1.0)].map(|x| x as f32)
    };
    let gaps: Vec<Gap> = (0..CASES).map(|_| gap()).collect();
    type Root = (&'static str, Family, Box<dyn Fn(Gap) -> f32>);
    let roots: Vec<Root> = vec![
        ("libm", Family::Ours, Box::new(|gap| root(gap, libm::sqrtf))),
        (
            "processor",
            Family::Ours,
            Box::new(|gap| root(gap, f32::sqrt)),
        ),
        (
            "micromath",
            Family::Paper,
            Box::new(|gap| root(gap, micromath::F32Ext::sqrt)),
        ),
    ];
    let times = interleave(roots.len(), effort.rounds, |index| {
        let watch = Stopwatch::start();
        for gap in &gaps {
            black_box(roots[index].2(black_box(*gap)));
        }
        watch.elapsed().as_secs_f64() * 1e9 / CASES as f64
    });
    let rows = roots
        .iter()
        .zip(&times)
        .map(|((name, family, solve), own)| {
            let verdict = |gap: &Gap| Verdict {
                error: (f64::from(solve(*gap)) - exact_root(*gap)).abs(),
                angle: 0.0,
            };
            let verdicts: Vec<_> = gaps.iter().map(verdict).collect();
            row(
                "ray quadratic".into(),
                "square root",
                name,
                *family,
                own,
                &times[0],
                &verdicts,
            )
        });
    rows.collect()
}
