//! The cost of a ball's tiles, as a table: `cargo run -p hapterra-tests --example tip >
//! docs/tip.csv`. Radii from half a cell to 8 cells, over a city with walls or synthetic ground; a
//! link of 1,000 kB/s is the reference (docs/explanation/tiles-and-levels.md).

use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{HapticCells, HapticGrid, Terrain, TileBuffer};
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::message::Heights;
use hapterra_tests::shared;
use heightfield::{OpenOptions, Raster};

/// Tiles that the link carries in a second.
const LINK: f64 = 463.0;
/// Tiles made for a row of the table.
const TILES: usize = 400;

fn main() {
    let file = shared("dem/real/dom1_32_356_5699_1_nw_2020.tif");
    let made = || Synth::new(Kind::Fractal, 1, 100.0).raster(1000, 1000);
    let raster = match file {
        Some(path) => Raster::open(path, &OpenOptions::default()).expect("opens"),
        None => made().expect("a raster"),
    };
    let grid = HapticGrid::new(&raster, HapticCells::default());
    let scale = grid.true_scale(1.0).expect("scale");
    println!("radius_cells,haptic_cells_in_radius,bytes_a_tile,tiles_per_s,times_link");
    for radius in [0.0, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0] {
        let grid = grid.with_tip(radius * scale.cell_mm());
        let terrain = Terrain::over(grid, scale, 0).expect("terrain");
        let (bytes, tiles_per_s) = made_tiles(&terrain);
        let (cells, times) = (terrain.tip_cells(), tiles_per_s / LINK);
        println!("{radius},{cells:.1},{bytes:.0},{tiles_per_s:.0},{times:.1}");
    }
}

/// Returns the processor time of this thread, s (Linux), so that other programs do not count.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    let ran_ns = text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok());
    ran_ns.expect("a number") * 1e-9
}

/// Returns the mean bytes of the tiles' heights, and the tiles made in a second of processor time.
fn made_tiles(terrain: &Terrain<'_>) -> (f64, f64) {
    let mut buffer = TileBuffer::default();
    let first = terrain.size().map(|cells| cells / 64);
    let began_s = processor_s();
    let bytes: usize = (0..TILES as i32)
        .map(|at| {
            let key = TileKey::new(0, first[0] + at % 8, first[1] + at / 8 % 8);
            match terrain.tile(key, &mut buffer).map(|(heights, _)| heights) {
                Some(Heights::Packed { bytes, .. } | Heights::Samples { bytes, .. }) => bytes.len(),
                _ => 0,
            }
        })
        .sum();
    let tiles = TILES as f64;
    (bytes as f64 / tiles, tiles / (processor_s() - began_s))
}
