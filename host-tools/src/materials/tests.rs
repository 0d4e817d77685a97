//! Tests of the classes' positions on a terrain.

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::Source;
use hapterra_core::terrain::{Tile, TileKey};

use super::*;
use crate::terrain::in_file::in_file;
use crate::terrain::{HapticCells, Scale, Terrain};
use crate::timeouts::wait_until;
use heightfield::{GroundTransform, OpenOptions, Wait};

/// Returns a raster with its south-west sample at `origin` and a given step, in the reference
/// system of an EPSG code.
fn raster(
    (columns, rows): (u32, u32),
    origin: [f64; 2],
    step: f64,
    epsg: Option<u16>,
    value: impl Fn(u32, u32) -> f32,
) -> Raster {
    let raster = Raster::from_fn(columns, rows, value).expect("raster");
    let ground = GroundTransform::new(origin, [step, 0.0], [0.0, step]).expect("a map");
    raster.with_ground(ground, epsg)
}

fn class_materials(classes: &[i64]) -> ClassMaterials {
    let default = Material::of(&SurfaceParams::PREMIUM);
    let class = |class: &i64| ClassMaterial {
        class: *class,
        name: (*class == 10).then(|| "trees".to_owned()),
        material: default,
    };
    ClassMaterials {
        default,
        class: classes.iter().map(class).collect(),
    }
}

fn over(
    terrain: &Raster,
    classes: Raster,
    class_materials: ClassMaterials,
) -> Result<Materials, GroundError> {
    Materials::over(("t.tif", terrain), ("c.tif", classes), class_materials)
}

/// Returns the index of the material at a point, which is in memory.
fn index_at(materials: &Materials, terrain: &Raster, ground: [f64; 2]) -> u8 {
    let grid = HapticGrid::new(terrain, HapticCells::Stored);
    let (index, status) = materials.index_at(&grid, ground);
    assert!(status.is_complete());
    index
}

#[test]
fn point_has_the_class_of_its_pixel() {
    let utm = Some(32632);
    let terrain = raster((61, 61), [500_000.0, 5_000_000.0], 10.0, utm, |_, _| 1.0);
    // Pixels of 37 m; the centre of the first lies 3 m west and 5 m south of the terrain.
    let class = |column, row| if (column + row) % 2 == 0 { 10.0 } else { 20.0 };
    let classes = raster((9, 9), [499_997.0, 4_999_995.0], 37.0, utm, class);
    let materials = over(&terrain, classes, class_materials(&[20, 10])).expect("they overlap");
    for (x, y) in [
        (0.0, 0.0),
        (15.0, 4.0),
        (15.6, 13.4),
        (140.0, 201.0),
        (310.0, 310.0),
    ] {
        let pixel = |off: f64| ((off / 37.0 + 0.5).floor()) as u32;
        let (column, row) = (pixel(x + 3.0), pixel(y + 5.0));
        let expected = if column < 9 && row < 9 {
            if (column + row) % 2 == 0 { 2 } else { 1 }
        } else {
            0
        };
        let index = index_at(&materials, &terrain, [500_000.0 + x, 5_000_000.0 + y]);
        assert_eq!(index, expected, "{x} {y}");
    }
    // The default applies beyond the pixels and in no-data.
    assert_eq!(index_at(&materials, &terrain, [500_400.0, 5_000_100.0]), 0);
    let holes = raster((9, 9), [500_000.0, 5_000_000.0], 37.0, utm, |column, _| {
        if column == 4 { f32::NAN } else { 30.0 }
    });
    let materials = over(&terrain, holes, class_materials(&[10, 30])).expect("they overlap");
    let at = |x: f64| index_at(&materials, &terrain, [500_000.0 + x, 5_000_100.0]);
    assert_eq!([at(100.0), at(148.0), at(190.0)], [2, 0, 2]);
}

#[test]
fn classes_in_another_reference_system_are_converted() {
    // The border is a meridian: 9° east is the middle of zone 32.
    let terrain = raster(
        (101, 101),
        [499_500.0, 5_000_000.0],
        10.0,
        Some(32632),
        |_, _| 0.0,
    );
    // Pixels of 0.0001°, 7.9 m, with a border between two of them at 9°.
    let origin = [8.990_05, 45.145];
    let classes = raster((200, 200), origin, 1e-4, Some(4326), |column, _| {
        if column < 100 { 10.0 } else { 20.0 }
    });
    let materials = over(&terrain, classes, class_materials(&[10, 20])).expect("they overlap");
    let at = |x: f64| index_at(&materials, &terrain, [x, 5_000_400.0]);
    assert_eq!([at(499_999.0), at(500_001.0)], [1, 2]);
    assert_eq!([at(499_900.0), at(500_100.0)], [1, 2]);
    let grid = HapticGrid::new(&terrain, HapticCells::Square).with_materials(Some(&materials));
    let reported = materials.describe(&grid);
    assert!(
        reported.contains("trees") && reported.contains("class 20"),
        "{reported}"
    );
}

#[test]
fn tile_has_the_classes_of_its_level() {
    let terrain = raster((101, 71), [0.0; 2], 1.0, None, |x, y| (x * y) as f32);
    let classes = raster((101, 71), [0.0; 2], 1.0, None, |x, y| {
        ((x / 7 + y / 5) % 3) as f32
    });
    let materials = over(&terrain, classes, class_materials(&[1, 2])).expect("they overlap");
    let mut buffer = MaterialBuffer::default();
    for level in [0, 1] {
        let grid = HapticGrid::new(&terrain, HapticCells::Stored).with_materials(Some(&materials));
        let scale = Scale::new(1.0, 1.0).expect("valid");
        let rendered = Terrain::over(grid, scale, level).expect("terrain");
        let key = TileKey::new(level, 1, 0);
        let (packed, _) = rendered
            .materials_of(key, &mut buffer)
            .expect("it has some");
        let mut tile = Box::new(Tile::VACANT);
        tile.fill(key, 0, |_, _| 0.0).expect("in range");
        packed.fill(&mut tile, 3).expect("of the table");
        let class = |x: u32, y: u32| ((x / 7 + y / 5) % 3) as u8;
        let size = rendered.size();
        let expected: Vec<u8> = (0..SAMPLES)
            .map(|i| {
                let at = |first: i32, i: usize, last: i32| (first + i as i32).min(last) as u32;
                let (column, row) = (
                    at(32, i % TILE_SAMPLES, size[0]),
                    at(0, i / TILE_SAMPLES, size[1]),
                );
                class(column << level, row << level)
            })
            .collect();
        assert_eq!(buffer.indices.as_slice(), expected, "level {level}");
        assert!(
            rendered
                .materials_of(TileKey::new(level, 9, 0), &mut buffer)
                .is_none()
        );
    }
}

#[test]
fn scene_names_its_table_and_its_file_of_classes() {
    let terrain = raster((41, 41), [0.0; 2], 1.0, None, |x, _| x as f32);
    let scene = |materials: Option<&Materials>| {
        let grid = HapticGrid::new(&terrain, HapticCells::Stored).with_materials(materials);
        let rendered =
            Terrain::over(grid, Scale::new(1.0, 1.0).expect("valid"), 0).expect("terrain");
        rendered.scene(SurfaceParams::PREMIUM, Source::Points, GridPoint::default())
    };
    let classes = |value| raster((41, 41), [0.0; 2], 1.0, None, move |_, _| value);
    let one = over(&terrain, classes(1.0), class_materials(&[1])).expect("overlap");
    let other = over(&terrain, classes(2.0), class_materials(&[1])).expect("overlap");
    let [none, one, other] = [scene(None), scene(Some(&one)), scene(Some(&other))];
    assert_eq!((none.materials, one.materials.is_some()), (None, true));
    assert_eq!(one.materials, other.materials);
    assert!(none.epoch != one.epoch && one.epoch != other.epoch);
}

#[test]
fn class_raster_that_does_not_fit_terrain_is_refused() {
    let utm = |origin| raster((9, 9), origin, 10.0, Some(32632), |_, _| 1.0);
    let terrain = utm([500_000.0, 5_000_000.0]);
    let unplaced = Raster::from_fn(9, 9, |_, _| 1.0).expect("raster");
    let no_system = GroundError::NoSystem {
        unplaced: "c.tif".into(),
        placed: "t.tif".into(),
    };
    let bad = over(&terrain, unplaced.clone(), class_materials(&[1])).expect_err("no system");
    assert_eq!(bad, no_system);
    let bad = over(&unplaced, utm([0.0; 2]), class_materials(&[1])).expect_err("no system");
    assert!(matches!(bad, GroundError::NoSystem { unplaced, .. } if unplaced == "t.tif"));
    let elsewhere = over(
        &terrain,
        utm([510_000.0, 5_000_000.0]),
        class_materials(&[1]),
    );
    let reported = elsewhere.expect_err("apart").to_string();
    assert!(
        reported.contains("longitude 9.127") && reported.contains("longitude 8.999"),
        "{reported}"
    );
    // A small raster between the places that are tested first.
    let large = raster((4_001, 3), [0.0; 2], 1.0, None, |_, _| 1.0);
    let small = raster((2, 2), [61.0, 0.2], 0.1, None, |_, _| 1.0);
    assert!(over(&large, small, class_materials(&[1])).is_ok());
    // Neither has a reference system: both are placed by columns and rows.
    assert!(over(&unplaced, unplaced.clone(), class_materials(&[1])).is_ok());
    let many: Vec<i64> = (0..16).collect();
    let bad = over(&unplaced, unplaced.clone(), class_materials(&many));
    assert!(matches!(bad, Err(GroundError::TooMany(16))));
}

/// Returns a raster around the meridian and equator of a geographic system's body.
fn of_body(wkt: &str) -> Raster {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("body.asc");
    let grid = "ncols 3\nnrows 3\nxllcorner -1\nyllcorner -1\ncellsize 1\n1 1 1\n1 1 1\n1 1 1\n";
    std::fs::write(&file, grid).expect("written");
    std::fs::write(folder.path().join("body.prj"), wkt).expect("written");
    Raster::open(&file, &OpenOptions::default()).expect("a raster")
}

#[test]
fn class_raster_of_another_body_is_refused() {
    let system = |name: &str, spheroid: &str, unit: f64| {
        let (meridian, unit) = ("PRIMEM[\"Reference_Meridian\",0.0]", unit.to_radians());
        format!(
            "GEOGCS[\"{name}\",DATUM[\"D_{name}\",SPHEROID[{spheroid}]],{meridian},UNIT[\"of so many radians\",{unit}]]"
        )
    };
    let moon = of_body(&system("Moon_2000", "\"Moon\",1737400.0,0.0", 1.0));
    let earth = of_body(&system(
        "WGS_1984",
        "\"WGS_1984\",6378137.0,298.257223563",
        1.0,
    ));
    let other = GroundError::OtherBody {
        classes: "c.tif".into(),
        terrain: "t.tif".into(),
    };
    let bad = over(&earth, moon.clone(), class_materials(&[1])).expect_err("the Moon's");
    assert_eq!(bad, other);
    let bad = over(&moon, earth.clone(), class_materials(&[1])).expect_err("the Earth's");
    assert_eq!(bad, other);
    assert!(over(&moon, moon.clone(), class_materials(&[1])).is_ok());
    // The same body in a system whose unit is half a degree.
    let halves = of_body(&system("Moon_2000", "\"Moon\",1737400.0,0.0", 0.5));
    assert!(over(&moon, halves, class_materials(&[1])).is_ok());
    assert!(over(&earth, earth.clone(), class_materials(&[1])).is_ok());
}

#[test]
fn url_key_is_in_no_recording_and_no_message() {
    let utm = Some(32632);
    let terrain = raster((61, 61), [500_000.0, 5_000_000.0], 10.0, utm, |_, _| 1.0);
    let at = |x: f64| {
        let classes = raster((9, 9), [x, 5_000_000.0], 37.0, utm, |_, _| 10.0);
        let url = "https://me:PASS@host/c.tif?sig=KEY";
        Materials::over(("t.tif", &terrain), (url, classes), class_materials(&[10]))
    };
    let materials = at(500_000.0).expect("they overlap");
    assert_eq!(materials.file(), "https://host/c.tif");
    // Nothing is fetched to describe the materials.
    let grid = HapticGrid::new(&terrain, HapticCells::Stored);
    assert!(
        materials
            .describe(&grid)
            .contains("read where it is touched")
    );
    let apart = at(900_000.0).expect_err("elsewhere").to_string();
    assert!(
        apart.contains("https://host/c.tif does not overlap"),
        "{apart}"
    );
}

#[test]
fn pending_class_does_not_count_as_default() {
    let folder = tempfile::tempdir().expect("a folder");
    let utm = Some(32632);
    let terrain = raster((600, 600), [0.0, 0.0], 1.0, utm, |_, _| 1.0);
    let metres = GroundTransform::new([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]).expect("a map");
    let classes = in_file(folder.path(), [600, 600], |_, _| 10.0).with_ground(metres, utm);
    let materials = over(&terrain, classes, class_materials(&[10])).expect("they overlap");
    let grid = HapticGrid::new(&terrain, HapticCells::Stored).with_wait(Wait::Never);
    let mut buffer = MaterialBuffer::default();
    let mut tile = |index| {
        let (tile, status) = materials.tile((&grid, [599, 599], 1.0), index, &mut buffer);
        (format!("{tile:?}"), status)
    };
    let [far, near] = [TileIndex::new(15, 0), TileIndex::new(0, 0)];
    assert_eq!(tile(far).1, ReadStatus::Pending);
    let (index, status) = materials.index_at(&grid, [3.0, 3.0]);
    assert_eq!((index, status), (0, ReadStatus::Pending));
    wait_until("the tile", || tile(near).1.is_complete());
    assert_eq!(
        materials.index_at(&grid, [3.0, 3.0]),
        (1, ReadStatus::Complete)
    );
}
