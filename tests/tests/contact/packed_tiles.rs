//! Every tile of real terrain arrives unchanged: its bits are the file's heights in cells, computed
//! here; interpolated heights are rounded as documented. Tiles are half as long as with a float for
//! each sample.

use std::path::Path;

use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain, TileBuffer};
use hapterra_core::grid::Cell;
use hapterra_core::terrain::{TILE_CELLS, TILE_SAMPLES, Tile, TileKey};
use hapterra_core::wire::message::{Heights, TileMessage};
use hapterra_firmware::link::fill_tile;
use hapterra_tests::shared;
use heightfield::{OpenOptions, Raster, RasterError};

/// Bytes of a tile's samples as floats.
const FLOATS: usize = 4 * TILE_SAMPLES * TILE_SAMPLES;

#[test]
fn tiles_of_real_terrain_are_lossless_and_smaller() {
    let Some(folder) = shared("dem/real") else {
        return;
    };
    let files = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<_> = files.map(|file| file.expect("a file").path()).collect();
    paths.sort();
    for path in paths {
        let raster = match Raster::open(&path, &OpenOptions::default()) {
            Ok(raster) => raster,
            // NumPy archives are not read, and some formats need libgdal.
            Err(error)
                if path.extension().is_some_and(|end| end == "npz")
                    || matches!(error.fault(), RasterError::NeedsGdal { .. }) =>
            {
                println!("skipped: {error}");
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        let grid = HapticGrid::new(&raster, HapticCells::Square);
        let scale = grid.true_scale(1.0).expect("a scale");
        let mean = checked(&path, &grid, scale, 0);
        println!("{}: {mean} bytes a tile", path.display());
        assert!(mean <= FLOATS / 2, "{}: {mean}", path.display());
        for (cell_mm, times, level) in [(0.37, -7.3, 1), (2.0, 0.031, 0), (1.0, 1.0, 3)] {
            let height = scale.height_mm_per_unit() * cell_mm * times;
            let scale = Scale::new(cell_mm, height).expect("a scale");
            if i32::try_from(grid.columns().min(grid.rows()) >> level).is_ok_and(|left| left > 1) {
                checked(&path, &grid, scale, level);
            }
        }
    }
}

/// Checks all tiles against the file. Returns the mean bytes of those that are not a single number.
fn checked(path: &Path, grid: &HapticGrid<'_>, scale: Scale, level: u8) -> usize {
    let terrain = Terrain::over(*grid, scale, level).expect("terrain");
    let last = terrain.size().map(|cells| (cells - 1) / TILE_CELLS as i32);
    let mut buffer = TileBuffer::default();
    let mut tile = Box::new(Tile::VACANT);
    let (mut sum, mut tiles) = (0, 0);
    for (row, col) in (0..=last[1]).flat_map(|row| (0..=last[0]).map(move |col| (row, col))) {
        let key = TileKey::new(level, col, row);
        let (heights, _) = terrain.tile(key, &mut buffer).expect("there is one");
        // One number for the whole tile, also off the field, where no force is rendered.
        let flat = matches!(heights, Heights::Flat { .. });
        if let Heights::Samples { bytes, .. } | Heights::Packed { bytes, .. } = heights {
            (sum, tiles) = (sum + bytes.len(), tiles + 1);
        }
        let message = TileMessage {
            epoch: 0,
            key,
            heights,
        };
        fill_tile(&mut tile, &message).expect("heights of a tile");
        assert_eq!(tile.key(), Some(key));
        let context = || format!("{} {key:?} {scale:?}", path.display());
        let rendered = flat.then_some(terrain.size());
        assert_held(&tile, grid, &scale, rendered, &context);
    }
    sum / tiles.max(1)
}

/// Checks the samples against the file; if `rendered` has a size, only those within it.
fn assert_held(
    tile: &Tile,
    grid: &HapticGrid<'_>,
    scale: &Scale,
    rendered: Option<[i32; 2]>,
    context: &dyn Fn() -> String,
) {
    let key = tile.key().expect("a tile");
    for row in 0..TILE_SAMPLES as u32 {
        for col in 0..TILE_SAMPLES as u32 {
            let place = [key.index.col, key.index.row].map(|i| i.unsigned_abs() * 32);
            let (x, y) = (place[0] + col, place[1] + row);
            let is_off = |[columns, rows]: [i32; 2]| x as i32 > columns || y as i32 > rows;
            if rendered.is_some_and(is_off) {
                continue;
            }
            let file = grid.height_of_level(key.level, x, y);
            let level_mm = scale.cell_mm() * f64::from(1 << key.level);
            let mut cells = file * scale.height_mm_per_unit() / level_mm;
            if grid.is_resampled() {
                cells = (cells * 131_072.0).round() / 131_072.0;
            }
            let expected = (cells - f64::from(tile.base())) as f32;
            // The last row and column are corners of the patches before them.
            let (u, v) = (col.min(31), row.min(31));
            let corner = (col - u) + 2 * (row - v);
            let held = tile.corners(Cell::new(u as i32, v as i32))[corner as usize];
            let same = held.to_bits() == expected.to_bits() || held.is_nan() && expected.is_nan();
            assert!(same, "{}: {col} {row}: {held:e} {expected:e}", context());
        }
    }
}
