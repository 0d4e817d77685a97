//! Tests of the fallback tiles that a device stores.

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::Source;

use super::*;
use crate::terrain::Scale;
use crate::terrain::tiler::tests::sent;
use heightfield::Raster;

/// Returns 2000 × 1500 cells of a millimetre, with no-data.
fn hills() -> Raster {
    let height = |x: u32, y: u32| match (x, y) {
        (1000, 760) => f32::NAN,
        _ => {
            let (u, v) = (x as f32 / 61.0, y as f32 / 47.0);
            30.0 * (u.sin() + v.cos()) + ((x * 7919 + y * 104_729) % 101) as f32 / 50.0
        }
    };
    Raster::from_fn(2001, 1501, height).expect("raster")
}

fn fallback(terrain: &Terrain<'_>, home: [i32; 2], reach_mm: [f64; 4]) -> (Scene, Fallback) {
    let home = GridPoint::new([home[0], home[1], 100], hapterra_core::Vec3::ZERO);
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home);
    let scene = terrain.with_fallback(scene, reach_mm);
    let fallback = scene.fallback.expect("a fallback");
    (scene, fallback)
}

/// The heights of a fallback tile as its device stores it.
struct DeviceTile(CoarseTile, Vec<f64>);

impl DeviceTile {
    fn of(terrain: &Terrain<'_>, scene: &Scene, place: CoarseTile) -> Self {
        let key = place.key(scene.level);
        let mut buffer = TileBuffer::default();
        let (heights, _) = terrain.tile_of(scene, key, &mut buffer).expect("a tile");
        Self(place, sent(key, heights))
    }

    fn at(&self, x: i32, y: i32) -> f64 {
        let along = |at: i32, first: i32| {
            let off = at - first;
            let cell = (off / self.0.spacing()).clamp(0, 31);
            let share = f64::from(off - cell * self.0.spacing()) / f64::from(self.0.spacing());
            (cell as usize, share)
        };
        let ((col, u), (row, v)) = (along(x, self.0.first.x), along(y, self.0.first.y));
        let sample = |right: usize, up: usize| self.1[(row + up) * TILE_SAMPLES + col + right];
        let south = sample(0, 0) * (1.0 - u) + sample(1, 0) * u;
        let north = sample(0, 1) * (1.0 - u) + sample(1, 1) * u;
        south * (1.0 - v) + north * v
    }
}

#[test]
fn near_tile_surrounds_home_and_lies_within_the_wide_tile() {
    let raster = hills();
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("valid"), 0).expect("terrain");
    let reach_mm = [-500.0, -300.0, 500.0, 400.0];
    for home in [[1000, 800], [1003, 777], [0, 0], [2000, 1500], [400, 1480]] {
        let (_, Fallback { wide, near }) = fallback(&terrain, home, reach_mm);
        let near = near.expect("a finer one");
        assert_eq!(near.shift + NEAR_SHIFT, wide.shift);
        let side = |tile: &CoarseTile| 32 * tile.spacing();
        for (home, near_first, wide_first) in [
            (home[0], near.first.x, wide.first.x),
            (home[1], near.first.y, wide.first.y),
        ] {
            assert_eq!((near_first - wide_first) % near.spacing(), 0);
            let room = wide_first..=wide_first + side(&wide);
            assert!(room.contains(&near_first) && room.contains(&(near_first + side(&near))));
            // The home position is as near to its middle as possible.
            let off = home - near_first - side(&near) / 2;
            let is_at_the_rim =
                near_first == wide_first || near_first + side(&near) == wide_first + side(&wide);
            assert!((0..near.spacing()).contains(&off) || is_at_the_rim, "{off}");
        }
    }
}

#[test]
fn surface_is_continuous_across_the_near_tile_border() {
    let raster = hills();
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("valid"), 0).expect("terrain");
    let (scene, Fallback { wide, near }) =
        fallback(&terrain, [1003, 777], [-500.0, -300.0, 500.0, 400.0]);
    let near = near.expect("a finer one");
    let [wide, within] = [wide, near].map(|tile| DeviceTile::of(&terrain, &scene, tile));
    let side = 32 * near.spacing();
    for along in 0..=side {
        let Cell { x, y } = near.first;
        for (x, y) in [
            (x + along, y),
            (x + along, y + side),
            (x, y + along),
            (x + side, y + along),
        ] {
            let (outside, inside) = (wide.at(x, y), within.at(x, y));
            assert!(
                (outside - inside).abs() < 1e-4,
                "{x} {y}: {outside} {inside}"
            );
        }
    }
    // Inside the tile, its samples are those of the terrain.
    let [x, y] = [
        near.first.x + 5 * near.spacing(),
        near.first.y + 9 * near.spacing(),
    ];
    let height = raster.height(x as u32, y as u32);
    assert!((within.at(x, y) - height).abs() < 1e-4);
}

#[test]
fn near_tile_border_is_exact_where_wide_tile_has_no_data() {
    // A sample of the wide tile is no-data, and the near tile's border passes it.
    let hole = [1024, 384];
    let height = |x: u32, y: u32| match [x, y] == hole {
        true => f32::NAN,
        false => 5.0,
    };
    let raster = Raster::from_fn(2049, 2049, height).expect("raster");
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("valid"), 0).expect("terrain");
    let (scene, Fallback { wide, near }) =
        fallback(&terrain, [1024, 640], [-1024.0, -640.0, 1024.0, 1408.0]);
    let near = near.expect("a finer one");
    assert_eq!((wide.first, wide.shift), (Cell::new(0, 0), 6));
    assert_eq!((near.first, near.shift), (Cell::new(768, 384), 4));
    let within = DeviceTile::of(&terrain, &scene, near);
    let holes = within.1.iter().filter(|height| height.is_nan()).count();
    assert_eq!(holes, 1);
    assert!(within.at(1024, 384).is_nan());
}

#[test]
fn coarse_keys_outside_the_fallback_have_no_tile() {
    let raster = hills();
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("valid"), 0).expect("terrain");
    let (scene, fallback) = fallback(&terrain, [1000, 700], [-500.0, -300.0, 500.0, 400.0]);
    let has = |key: TileKey| {
        let mut buffer = TileBuffer::default();
        terrain.tile_of(&scene, key, &mut buffer).is_some()
    };
    assert_eq!(fallback.keys(0).map(|key| key.is_some_and(has)), [true; 2]);
    let wide = fallback.wide.key(0);
    for level in 1..wide.level + 3 {
        let named = fallback.keys(0).contains(&Some(TileKey::new(level, 0, 0)));
        assert_eq!(has(TileKey::new(level, 0, 0)), named, "{level}");
        assert!(!has(TileKey::new(level, 1, 0)));
    }
    assert!(has(TileKey::new(0, 1, 0)));
}
