//! All variants on one terrain along all paths, interleaved in one run.

use hapterra_core::terrain::Window;

use crate::baseline::{GodObject, Paper, Parry, Project, ProxyGraph, Start};
use crate::grid::Grid;
use crate::oracle::{self, Deviation};
use crate::path::{self, Path};
use crate::product::{self, Copy, Product, SIDE};
use crate::stats::{interleave, part, quantiles, timing};
use crate::variant::{ContactResult, Haptics};

/// Effort of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Ticks of a path.
    pub ticks: usize,
    /// Times that every variant runs every path.
    pub rounds: usize,
    /// Most results of a path that are compared with the oracle.
    pub compared: usize,
}

impl Effort {
    /// For figures that are quoted.
    pub const FULL: Self = Self {
        ticks: 20_000,
        rounds: 15,
        compared: 4000,
    };
    /// For a quick check.
    pub const QUICK: Self = Self {
        ticks: 4000,
        rounds: 5,
        compared: 800,
    };
}

/// Origin of a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The product.
    Ours,
    /// The paper's algorithm as published.
    Paper,
    /// Any method on triangles.
    Triangles,
    /// No contact at all: a bound.
    Bound,
}

/// Name of a variant, and the size of its data.
#[derive(Clone, Copy, Debug)]
pub struct Label {
    /// Name in tables and pictures.
    pub name: &'static str,
    /// Its origin.
    pub family: Family,
    /// Bytes of a sample besides the `f32` height itself.
    pub extra_bytes: f64,
}

/// The variant with which the others are compared: the plain algorithm of the paper.
pub const PLAIN: &str = "paper f32";

/// One variant along one path.
#[derive(Clone, Debug)]
pub struct Row {
    /// The terrain's name.
    pub terrain: String,
    /// The path's name.
    pub path: &'static str,
    /// The variant.
    pub label: Label,
    /// Nanoseconds a tick: lower quartile, median, upper quartile.
    pub ns: [f64; 3],
    /// Median over the rounds of the ratio of its time to that of [`PLAIN`].
    pub ratio: f64,
    /// Errors of the results; `None` if no force was rendered.
    pub error: Option<Error>,
    /// Largest change of the displacement from one tick to the next, cells.
    pub jump: f64,
    /// Share of the ticks below the surface that had no force.
    pub missed: f64,
    /// Share of the ticks that did not converge.
    pub unconverged: f64,
}

/// Errors compared with the oracle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// Mean distance from the exact closest point, cells.
    pub mean: f64,
    /// 99th percentile of this distance, cells.
    pub p99: f64,
    /// Largest distance, cells.
    pub max: f64,
    /// Mean angle between the forces, degrees.
    pub angle_mean: f64,
    /// 99th percentile of this angle, degrees.
    pub angle_p99: f64,
}

impl Error {
    /// Computes the errors; `None` without results.
    #[must_use]
    pub fn of(deviations: &[Deviation]) -> Option<Self> {
        if deviations.is_empty() {
            return None;
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let errors: Vec<f64> = deviations.iter().map(|deviation| deviation.error).collect();
        let angles: Vec<f64> = deviations.iter().map(|deviation| deviation.angle).collect();
        let (mean, angle_mean) = (mean(&errors), mean(&angles));
        let [p99, max] = quantiles(errors, [0.99, 1.0]);
        let [angle_p99] = quantiles(angles, [0.99]);
        Some(Self {
            mean,
            p99,
            max,
            angle_mean,
            angle_p99,
        })
    }
}

pub(crate) type Entry<'a> = (Label, Box<dyn Haptics + 'a>);

/// Measures every variant on one terrain. `progress` receives the name of each path.
pub fn compare(grid: &Grid, effort: Effort, mut progress: impl FnMut(&str)) -> Vec<Row> {
    let mut buffers = product::buffers::<SIDE>();
    let window = product::window::<SIDE>(grid, &mut buffers);
    let mut entries = entries_of(&window);
    entries.extend(opponents(grid));
    let mut rows = Vec::new();
    for path in path::all(grid, effort.ticks) {
        progress(path.name);
        rows.extend(compare_on_path(grid, &path, &mut entries, effort));
    }
    rows
}

/// The product's default.
pub const DEFAULT_VARIANT: Label = Label {
    name: "hapterra swept",
    family: Family::Ours,
    // 21 maxima a tile and 8 bytes of pyramid, over 32 × 32 samples.
    extra_bytes: (21.0 * 4.0 + 8.0) / 1024.0,
};

/// Returns the product's variants on a stored field.
pub(crate) fn entries_of<'w, const D: usize>(window: &'w Window<'_, D>) -> Vec<Entry<'w>> {
    vec![(DEFAULT_VARIANT, Box::new(Product::new(window)))]
}

pub(crate) fn opponents(grid: &Grid) -> Vec<Entry<'_>> {
    use Family::{Bound, Triangles};
    let single = |start, newton_steps| Box::new(Paper::<_, f32>::new(grid, start, newton_steps));
    let (last, centre) = (Start::LastPoint, Start::Centre);
    let double = Box::new(Paper::<_, f64>::new(grid, last, 20));
    let parry = |project| Box::new(Parry::new(grid, project));
    // parry has its own copy of the heights and a status byte for each cell.
    let entries: [(&'static str, Family, f64, Box<dyn Haptics + '_>); 10] = [
        (PLAIN, Family::Paper, 0.0, single(last, 10)),
        ("paper f64", Family::Paper, 0.0, double),
        (
            "paper f32, centre, 10",
            Family::Paper,
            0.0,
            single(centre, 10),
        ),
        (
            "paper f32, centre, 3",
            Family::Paper,
            0.0,
            single(centre, 3),
        ),
        (
            "paper f32, last point, 1",
            Family::Paper,
            0.0,
            single(last, 1),
        ),
        ("god-object", Triangles, 0.0, Box::new(GodObject::new(grid))),
        (
            "proxy graph",
            Triangles,
            0.0,
            Box::new(ProxyGraph::new(grid)),
        ),
        ("parry within", Triangles, 5.0, parry(Project::Within)),
        ("parry", Triangles, 5.0, parry(Project::Anywhere)),
        (
            "copy of the last answer",
            Bound,
            0.0,
            Box::new(Copy::default()),
        ),
    ];
    let labelled = entries.map(|(name, family, extra_bytes, variant)| {
        let label = Label {
            name,
            family,
            extra_bytes,
        };
        (label, variant)
    });
    labelled.into()
}

fn compare_on_path(
    grid: &Grid,
    path: &Path,
    entries: &mut [Entry<'_>],
    effort: Effort,
) -> Vec<Row> {
    let is_bound = |label: &Label| label.family == Family::Bound && path.name != "unmoved";
    let times = interleave(entries.len(), effort.rounds, |index| {
        let elapsed = entries[index].1.time(&path.hips);
        elapsed.as_secs_f64() * 1e9 / path.hips.len() as f64
    });
    let plain = entries.iter().position(|(label, _)| label.name == PLAIN);
    let plain = times[plain.unwrap_or(0)].clone();
    let rows = entries
        .iter_mut()
        .zip(&times)
        .map(|((label, variant), times)| {
            let results = variant.results(&path.hips);
            let (ns, ratio) = timing(times, &plain);
            Row {
                terrain: grid.name.clone(),
                path: path.name,
                label: *label,
                ns,
                ratio,
                error: error(grid, path, &results, effort.compared),
                jump: largest_jump(&results[path.approach.saturating_sub(1)..]),
                missed: missed(grid, path, &results),
                unconverged: part(results.iter().map(|result| !result.converged)),
            }
        });
    rows.filter(|row| !is_bound(&row.label)).collect()
}

fn error(grid: &Grid, path: &Path, results: &[ContactResult], compared: usize) -> Option<Error> {
    let every = results.len().div_ceil(compared.max(1));
    let deviations = path
        .hips
        .iter()
        .zip(results)
        .step_by(every)
        .filter(|(_, result)| result.touching)
        .filter_map(|(hip, result)| oracle::deviation(grid, hip, result));
    Error::of(&deviations.collect::<Vec<_>>())
}

fn largest_jump(results: &[ContactResult]) -> f64 {
    let changes = results.windows(2).map(|pair| pair[0].change(&pair[1]));
    changes.fold(0.0, f64::max)
}

/// Returns the share of missed ticks: any HIP below the surface, after the first, has a force.
fn missed(grid: &Grid, path: &Path, results: &[ContactResult]) -> f64 {
    let below = path.hips.iter().zip(results).filter(|(hip, _)| {
        let [x, y, z] = hip.wide;
        grid.height(x, y) - z > 1e-3
    });
    part(below.map(|(_, result)| !result.touching))
}
