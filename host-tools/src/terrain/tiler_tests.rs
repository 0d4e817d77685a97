//! Tests that compare tiles with their raster.

use hapterra_core::grid::Cell;
use hapterra_core::terrain::Tile;
use hapterra_core::wire::message::TileMessage;
use hapterra_firmware::link::fill_tile;

use super::*;

fn key(level: u8, col: i32, row: i32) -> TileKey {
    TileKey::new(level, col, row)
}

fn unit() -> Scale {
    Scale::new(1.0, 1.0).expect("valid")
}

/// Returns the samples of a tile as a device stores them, in cells.
fn samples(terrain: &Terrain<'_>, key: TileKey) -> Vec<f64> {
    let mut buffer = TileBuffer::default();
    let (heights, _) = terrain.tile(key, &mut buffer).expect("a tile");
    sent(key, heights)
}

/// Returns the samples of a sent tile as a device stores them, in cells.
pub(in crate::terrain) fn sent(key: TileKey, heights: Heights<'_>) -> Vec<f64> {
    let mut tile = Box::new(Tile::VACANT);
    let message = TileMessage {
        epoch: 0,
        key,
        heights,
    };
    fill_tile(&mut tile, &message).expect("heights of a tile");
    let base = f64::from(tile.base());
    let held = held(&tile);
    held.into_iter().map(|h| base + f64::from(h)).collect()
}

/// Returns the samples of a stored tile, in cells above its base.
fn held(tile: &Tile) -> Vec<f32> {
    let sample = |i: usize| {
        // The last row and column are corners of the patches before them.
        let (col, row) = (i % TILE_SAMPLES, i / TILE_SAMPLES);
        let (u, v) = (col.min(TILE_CELLS - 1), row.min(TILE_CELLS - 1));
        let corners = tile.corners(Cell::new(u as i32, v as i32));
        corners[(col - u) + 2 * (row - v)]
    };
    (0..TILE_SAMPLES * TILE_SAMPLES).map(sample).collect()
}

#[test]
fn tiles_contain_the_raster_samples_at_every_level() {
    let raster = Raster::from_fn(100, 70, |x, y| (x * 1000 + y) as f32 / 8.0).expect("raster");
    let scale = Scale::new(0.5, 0.25).expect("valid");
    for level in 0..3 {
        let terrain = Terrain::new(&raster, scale, level).expect("terrain");
        let per_unit = 0.25 / (0.5 * f64::from(1 << level));
        for (col, row) in [(0, 0), (1, 0), (0, 1)] {
            if !terrain.has(key(level, col, row)) {
                continue;
            }
            let tile = samples(&terrain, key(level, col, row));
            for (i, got) in tile.into_iter().enumerate() {
                let x = (col as u32 * 32 + (i % TILE_SAMPLES) as u32) << level;
                let y = (row as u32 * 32 + (i / TILE_SAMPLES) as u32) << level;
                let inside = x <= (terrain.size()[0] as u32) << level
                    && y <= (terrain.size()[1] as u32) << level;
                if inside {
                    let expected = raster.height(x, y) * per_unit;
                    assert!((got - expected).abs() < 1e-3, "{x} {y}: {got} {expected}");
                }
            }
        }
    }
}

#[test]
fn constant_tile_is_one_number_even_at_the_border() {
    let raster = Raster::from_fn(40, 40, |_, _| 7.25).expect("raster");
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    let mut buffer = TileBuffer::default();
    for (col, row) in [(0, 0), (1, 1)] {
        assert_eq!(
            terrain.tile(key(0, col, row), &mut buffer),
            Some((
                Heights::Flat {
                    base: 7,
                    height: 0.25
                },
                ReadStatus::Complete
            ))
        );
    }
    for (col, row) in [(2, 0), (0, 2), (-1, 0)] {
        assert_eq!(terrain.tile(key(0, col, row), &mut buffer), None);
    }
    assert_eq!(terrain.tile(key(1, 0, 0), &mut buffer), None);
}

#[test]
fn no_data_samples_are_kept_and_empty_tile_is_no_data() {
    let raster = Raster::from_fn(70, 33, |x, y| {
        if x >= 32 || (x, y) == (3, 4) {
            f32::NAN
        } else {
            5.0
        }
    })
    .expect("raster");
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    let tile = samples(&terrain, key(0, 0, 0));
    assert!(tile[4 * TILE_SAMPLES + 3].is_nan() && tile[32].is_nan());
    assert_eq!(tile[4 * TILE_SAMPLES + 4], 5.0);
    let mut buffer = TileBuffer::default();
    let (heights, _) = terrain.tile(key(0, 2, 0), &mut buffer).expect("a tile");
    assert_eq!(heights, Heights::NoData);
    assert_eq!(terrain.height_mm(3.5, 4.5), None);
    assert_eq!(terrain.height_mm(10.5, 4.5), Some(5.0));
    assert_eq!(terrain.height_mm(10.5, 32.1), None);
}

#[test]
fn top_exceeds_every_sample_at_any_height() {
    for (offset, step) in [(0.0f32, 0.37f32), (-1e6, 0.1), (1e6, 0.06), (0.0, 100.0)] {
        let raster = Raster::from_fn(33, 33, |x, y| offset + step * (x * y % 97) as f32);
        let raster = raster.expect("raster");
        let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
        for h in samples(&terrain, key(0, 0, 0)) {
            assert!(h <= f64::from(terrain.top()), "{h} {}", terrain.top());
        }
    }
}

#[test]
fn height_above_limit_is_an_error_and_limit_is_accepted() {
    let raster = Raster::from_fn(4, 4, |_, _| 1.0).expect("raster");
    let limit = f64::from(MAX_CELL);
    let scale = |height| Scale::new(1.0, height).expect("valid");
    let terrain = Terrain::new(&raster, scale(limit), 0).expect("at the limit");
    let tile = samples(&terrain, key(0, 0, 0));
    assert_eq!((tile[0], tile[1]), (limit, limit));
    let error = Terrain::new(&raster, scale(limit * 1.001), 0).err();
    assert!(matches!(error, Some(TerrainError::TooTall { .. })));
}

#[test]
fn scene_epoch_depends_on_heights_scale_and_surface_params() {
    let scene = |bump: f32, cell_mm: f64, stiffness_n_per_mm: f32| {
        let raster = Raster::from_fn(9, 9, |x, y| if (x, y) == (4, 4) { bump } else { 0.0 });
        let raster = raster.expect("raster");
        let scale = Scale::new(cell_mm, 1.0).expect("valid");
        let params = SurfaceParams {
            stiffness_n_per_mm,
            max_force_n: 8.5,
            ..SurfaceParams::PREMIUM
        };
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let home = GridPoint::default();
        terrain.scene(params, Source::Points, home).epoch
    };
    let same = scene(1.0, 1.0, 0.5);
    assert_eq!(same, scene(1.0, 1.0, 0.5));
    for other in [
        scene(1.001, 1.0, 0.5),
        scene(1.0, 1.000_000_000_1, 0.5),
        scene(1.0, 1.0, 0.4),
    ] {
        assert_ne!(same, other);
    }
}

#[test]
fn tile_with_excessive_step_is_no_data() {
    let wall = |height: f32| {
        let raster = Raster::from_fn(64, 9, move |x, _| if x > 40 { height } else { 0.0 });
        raster.expect("raster")
    };
    for (height, is_no_data) in [(9_999.0, false), (10_001.0, true)] {
        let raster = wall(height);
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let mut buffer = TileBuffer::default();
        let (steep, _) = terrain.tile(key(0, 1, 0), &mut buffer).expect("a tile");
        assert_eq!(steep == Heights::NoData, is_no_data, "{height}");
        let (flat, _) = terrain.tile(key(0, 0, 0), &mut buffer).expect("a tile");
        assert_ne!(flat, Heights::NoData);
    }
}
