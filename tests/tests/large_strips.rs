//! TIFFs whose samples are all in one strip, larger than the memory of a terrain, or in millions of
//! tiles.

use std::fs::OpenOptions;
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

use hapterra::raster::{self, Raster};
use hapterra_tests::bounded;
use hapterra_tests::tiffs::{DATA, Directory, Values, floats_in_a_strip, placed, tiff};

/// Samples each way: 4.1 GB of single floats.
const SIDE: u32 = 32_000;
/// Where the strip begins.
const FIRST: u32 = 4096;
/// Rows of heights that are written; between them the file has nothing, which reads as zeros.
const EVERY: u32 = 997;

fn height(column: u32, row: u32) -> f32 {
    match row.is_multiple_of(EVERY) && column < 3000 {
        true => (100 + row + column) as f32,
        false => 0.0,
    }
}

fn file() -> (tempfile::TempDir, PathBuf) {
    let mut image = floats_in_a_strip([SIDE; 2], FIRST);
    image.extend(placed([400_000.0, 3_800_000.0], 1.0, 32611));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("strip.tif");
    std::fs::write(&path, tiff(&[], &[image])).expect("written");
    let mut file = OpenOptions::new().write(true).open(&path).expect("there");
    for row in (0..SIDE).step_by(EVERY as usize) {
        let at = u64::from(FIRST) + u64::from(row) * u64::from(SIDE) * 4;
        let heights = (0..3000).flat_map(|column| height(column, row).to_le_bytes());
        file.seek(SeekFrom::Start(at)).expect("a place");
        file.write_all(&heights.collect::<Vec<u8>>())
            .expect("written");
    }
    let bytes = u64::from(FIRST) + u64::from(SIDE) * u64::from(SIDE) * 4;
    file.set_len(bytes).expect("a sparse file");
    (folder, path)
}

/// A mask cannot be read in parts where it is one large strip: then all is in memory, and it says so.
#[test]
fn a_file_whose_mask_is_one_large_strip_is_read_as_a_whole() {
    const WIDE: u32 = 6000;
    const TILE: u32 = 3000;
    let one = |tag: u16, value: u32| (tag, Values::Longs(vec![value]));
    let image = |kind: u32, meaning: u32, chunk: Vec<(u16, Values)>| {
        let mut image = vec![
            one(254, kind),
            one(256, WIDE),
            one(257, WIDE),
            one(258, 8),
            one(259, 1),
            one(262, meaning),
        ];
        image.extend(chunk);
        image
    };
    let bytes = WIDE * WIDE;
    let tiles = vec![
        one(277, 1),
        one(322, TILE),
        one(323, TILE),
        (324, Values::Longs(vec![DATA; 4])),
        (325, Values::Longs(vec![TILE * TILE; 4])),
    ];
    let strip = vec![one(273, DATA), one(277, 1), one(278, WIDE), one(279, bytes)];
    // Tiles and mask have the same bytes: 7 is a height, and no hole.
    let mut data = vec![7; bytes as usize];
    data[0] = 0;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("masked.tif");
    let images = [image(0, 1, tiles), image(4, 4, strip)];
    std::fs::write(&path, tiff(&data, &images)).expect("written");
    let options = raster::OpenOptions {
        most_in_memory_bytes: 0,
        ..raster::OpenOptions::default()
    };
    let raster = Raster::open(&path, &options).expect("opens");
    assert!(raster.samples().is_some(), "it is in memory");
    assert!(
        raster
            .remarks()
            .iter()
            .any(|remark| remark.contains("as a whole"))
    );
    assert_eq!(raster.summary().holes, 1);
    assert!(raster.height(0, WIDE - 1).is_nan());
}

/// A file that was cut: its overview, which is all that is looked at when it opens, ends early.
#[test]
fn of_an_overview_that_ends_early_the_rows_that_are_there_are_felt() {
    const WIDE: u32 = 4000;
    const HALF: u32 = WIDE / 2;
    const THERE: u32 = 600;
    let one = |tag: u16, value: u32| (tag, Values::Longs(vec![value]));
    let image = |kind: u32, side: u32, place: u32| {
        vec![
            one(254, kind),
            one(256, side),
            one(257, side),
            one(258, 8),
            one(259, 1),
            one(262, 1),
            one(273, place),
            one(277, 1),
            one(278, side),
            one(279, side * side),
        ]
    };
    // The directories come before the samples, as in a file that may be cut.
    const SAMPLES: u32 = 4096;
    let coarse = SAMPLES + WIDE * WIDE;
    let mut bytes = tiff(&[], &[image(0, WIDE, SAMPLES), image(1, HALF, coarse)]);
    bytes.resize(SAMPLES as usize, 0);
    bytes.resize(coarse as usize, 7);
    bytes.resize((coarse + HALF * THERE) as usize, 9);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cut.tif");
    std::fs::write(&path, bytes).expect("written");
    let options = raster::OpenOptions {
        most_in_memory_bytes: 0,
        ..raster::OpenOptions::default()
    };
    let raster = Raster::open(&path, &options).expect("all of the full image is there");
    assert_eq!([raster.height(0, 0), raster.height(3999, 3999)], [7.0; 2]);
    let coarse = |row: f64| raster.surface(1, [2000.0, f64::from(WIDE) - row]);
    assert_eq!(coarse(2.0 * f64::from(THERE) - 4.0), 9.0);
    assert!(coarse(2.0 * f64::from(THERE) + 4.0).is_nan());
}

#[test]
fn a_strip_of_4_gb_is_felt_in_the_memory_of_a_terrain() {
    let (_folder, path) = file();
    let output = bounded::info(&path, &[]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    assert!(!told.contains("whole"), "{told}");
    let raster = Raster::open(&path, &raster::OpenOptions::default()).expect("opens");
    for row in [0, EVERY, EVERY + 1, 17 * EVERY, 31_904, SIDE - 1] {
        for column in [0, 1, 2999, 3000, SIDE - 1] {
            let found = raster.height(column, SIDE - 1 - row);
            assert_eq!(found, f64::from(height(column, row)), "{column} {row}");
        }
    }
}

#[test]
fn four_million_tiles_are_felt_in_the_memory_of_a_terrain() {
    const TILE: u32 = 64;
    const ACROSS: u32 = 2025;
    let one = |tag: u16, value: u32| (tag, Values::Longs(vec![value]));
    let tiles = (ACROSS * ACROSS) as usize;
    let image = |kind: u32| {
        vec![
            one(254, kind),
            one(256, ACROSS * TILE),
            one(257, ACROSS * TILE),
            one(258, 8),
            one(259, 1),
            one(262, 1),
            one(277, 1),
            one(322, TILE),
            one(323, TILE),
            (324, Values::Longs(vec![DATA; tiles])),
            (325, Values::Longs(vec![TILE * TILE; tiles])),
        ]
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tiles.tif");
    let data = vec![7; (TILE * TILE) as usize];
    let info = |images: &[Directory]| {
        std::fs::write(&path, tiff(&data, images)).expect("written");
        // All tiles are the same one; the file is as long as if they were not.
        let file = OpenOptions::new().write(true).open(&path).expect("there");
        file.set_len(u64::from(ACROSS * TILE).pow(2))
            .expect("a sparse file");
        let output = bounded::info(&path, &[]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), told)
    };
    let (code, told) = info(&[image(0)]);
    assert_eq!(code, Some(0), "{told}");
    // Five such lists are more than is kept: that is no damage.
    let (code, told) = info(&[0, 1, 1, 1, 1].map(image));
    assert_eq!(code, Some(1), "{told}");
    assert!(told.contains("very many small tiles"), "{told}");
}
