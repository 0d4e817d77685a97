//! `cargo bench`: a tick in each state, by the product and by the plain algorithm of the paper.

use divan::{Bencher, counter::ItemsCount};
use hapterra_lab::baseline::{Paper, Start};
use hapterra_lab::grid::Grid;
use hapterra_lab::path::{self, Flight, Path};
use hapterra_lab::product::{self, Product, SIDE};
use hapterra_lab::variant::Haptics;

const TICKS: usize = 4000;
const PATHS: [&str; 6] = [
    "slide 0.01",
    "slide 0.5",
    "tapping",
    "unmoved",
    "fly low",
    "fly high",
];

fn main() {
    divan::main();
}

fn terrain() -> Grid {
    Grid::fractal("1250 × 1250", [1250, 1250], 2, 1.0)
}

fn path(grid: &Grid, name: &'static str) -> Path {
    match name {
        "slide 0.01" => path::slide(grid, name, 0.01, TICKS),
        "slide 0.5" => path::slide(grid, name, 0.5, TICKS),
        "tapping" => path::tapping(grid, TICKS),
        "unmoved" => path::resting(grid, TICKS),
        "fly low" => path::flight(grid, name, Flight::Low, TICKS),
        _ => path::flight(grid, name, Flight::High, TICKS),
    }
}

/// The time shown is for the whole path; the items are ticks.
fn run(bencher: Bencher<'_, '_>, path: &Path, variant: &mut dyn Haptics) {
    bencher
        .counter(ItemsCount::new(path.hips.len()))
        .bench_local(|| variant.time(&path.hips));
}

#[divan::bench(args = PATHS)]
fn swept(bencher: Bencher<'_, '_>, name: &'static str) {
    let grid = terrain();
    let mut buffers = product::buffers::<SIDE>();
    let window = product::window::<SIDE>(&grid, &mut buffers);
    run(bencher, &path(&grid, name), &mut Product::new(&window));
}

#[divan::bench(args = PATHS)]
fn plain(bencher: Bencher<'_, '_>, name: &'static str) {
    let grid = terrain();
    let mut paper = Paper::<_, f32>::new(&grid, Start::LastPoint, 10);
    run(bencher, &path(&grid, name), &mut paper);
}
