//! TIFFs with all samples in one strip larger than the memory for a terrain, or in millions of
//! tiles.

use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::path::PathBuf;

use hapterra_tests::memory_limit::{self, zstd_bomb};
use hapterra_tests::tiffs::{DATA, Directory, Values, floats_in_a_strip, placed, tiff};
use heightfield::disk_cache::DiskCache;
use heightfield::{OpenOptions, Raster};

/// Samples along each side: 4.1 GB of single floats.
const SIDE: u32 = 32_000;
/// Offset of the strip.
const FIRST: u32 = 4096;
/// Distance of the rows with heights; the file is sparse between them, which reads as zeros.
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
    let mut file = fs::OpenOptions::new()
        .write(true)
        .open(&path)
        .expect("there");
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

/// Side of a mask in one strip, too large to be decoded with each block.
const MASKED: u32 = 6000;

fn one(tag: u16, value: u32) -> (u16, Values) {
    (tag, Values::Longs(vec![value]))
}

/// Writes tiles of bytes of 7, except the first, and a mask of the same bytes in one strip.
fn masked(compression: u32, mask: &[u8]) -> (tempfile::TempDir, PathBuf) {
    const TILE: u32 = 3000;
    let image = |kind: u32, compression: u32, meaning: u32, chunk: Vec<(u16, Values)>| {
        let mut image = vec![
            one(254, kind),
            one(256, MASKED),
            one(257, MASKED),
            one(258, 8),
            one(259, compression),
            one(262, meaning),
        ];
        image.extend(chunk);
        image
    };
    let tiles = vec![
        one(277, 1),
        one(322, TILE),
        one(323, TILE),
        (324, Values::Longs(vec![DATA; 4])),
        (325, Values::Longs(vec![TILE * TILE; 4])),
    ];
    let bytes = mask.len() as u32;
    let place = DATA + TILE * TILE;
    let strip = vec![
        one(273, place),
        one(277, 1),
        one(278, MASKED),
        one(279, bytes),
    ];
    let mut data = vec![7; (TILE * TILE) as usize];
    data.extend(mask);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("masked.tif");
    let images = [image(0, 1, 1, tiles), image(4, compression, 4, strip)];
    std::fs::write(&path, tiff(&data, &images)).expect("written");
    // All tiles share one place; the file is as long as if they did not.
    let file = fs::OpenOptions::new()
        .write(true)
        .open(&path)
        .expect("there");
    let length = file.metadata().expect("read").len();
    file.set_len(length.max(u64::from(MASKED * MASKED)))
        .expect("a sparse file");
    (folder, path)
}

/// Returns options with which samples stay in the file, and unpacked data is in a folder.
fn in_file(disk: DiskCache) -> OpenOptions {
    OpenOptions {
        max_in_memory_bytes: 0,
        disk_cache: disk,
        ..OpenOptions::default()
    }
}

#[test]
fn mask_in_one_large_strip_is_read_row_by_row() {
    let mut mask = vec![7; (MASKED * MASKED) as usize];
    for hole in [0, MASKED + 1, 3500 * MASKED + 4000] {
        mask[hole as usize] = 0;
    }
    let (_folder, path) = masked(1, &mask);
    let raster = Raster::open(&path, &in_file(DiskCache::off())).expect("opens");
    assert!(raster.samples().is_none(), "it is in memory");
    assert_eq!(raster.remarks(), [""; 0]);
    for [column, row] in [[0, 0], [1, 1], [4000, 3500]] {
        assert!(raster.height(column, MASKED - 1 - row).is_nan());
        assert_eq!(raster.height(column + 1, MASKED - 1 - row), 7.0);
    }
}

/// Without a place for unpacked data, everything is in memory, and the reason is reported.
#[test]
fn packed_mask_in_one_strip_is_unpacked_on_disk_or_reported() {
    let mask = zstd_bomb((MASKED * MASKED).div_ceil(128 * 1024) as usize);
    let (folder, path) = masked(50000, &mask);
    let has_remark = |raster: &Raster, words: [&str; 2]| {
        let all = |remark: &String| words.iter().all(|word| remark.contains(word));
        assert!(raster.remarks().iter().any(all), "{:?}", raster.remarks());
    };
    let disk = DiskCache::at(&folder.path().join("cache"), 1 << 20);
    let raster = Raster::open(&path, &in_file(disk)).expect("opens");
    assert!(raster.samples().is_none(), "it is in memory");
    has_remark(&raster, ["its mask are too large", "up to 36 MB"]);
    assert_eq!(raster.height(5999, 0), 7.0);
    let raster = Raster::open(&path, &in_file(DiskCache::off())).expect("opens");
    assert!(raster.samples().is_some(), "it is left in the file");
    has_remark(&raster, ["as a whole", "its mask are too large"]);
    assert_eq!(raster.summary().no_data, 0);
}

/// 576 MB of bytes in one packed strip.
#[test]
fn packed_strip_is_read_in_the_memory_of_a_terrain() {
    const WIDE: u32 = 24_000;
    let image = |bytes: usize| {
        vec![
            one(256, WIDE),
            one(257, WIDE),
            one(258, 8),
            one(259, 50000),
            one(262, 1),
            one(273, DATA),
            one(277, 1),
            one(278, WIDE),
            one(279, bytes as u32),
        ]
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("packed.tif");
    let cache = folder.path().join("cache");
    let cache = cache.to_str().expect("a plain name");
    let write = |packed: &[u8]| {
        std::fs::write(&path, tiff(packed, &[image(packed.len())])).expect("written");
    };
    let info = |options: &[&str]| {
        let output = memory_limit::info(&path, options);
        let text = [output.stdout, output.stderr].concat();
        (
            output.status.code(),
            String::from_utf8_lossy(&text).into_owned(),
        )
    };
    let packed = zstd_bomb((WIDE * WIDE).div_ceil(128 * 1024) as usize);
    write(&packed);
    let (code, text) = info(&["--cache", cache]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("unpacked on disk"), "{text}");
    // Without a place on disk it needs memory, and there is too little.
    let (code, text) = info(&["--cache", "off"]);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("do not fit into memory"), "{text}");
    // A truncated strip: the rows before the end are rendered.
    write(&packed[..packed.len() / 10 * 9]);
    let (code, text) = info(&["--cache", cache]);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("cannot be read and count as no data"),
        "{text}"
    );
    // One that cannot be unpacked at all.
    let mut damaged = packed.clone();
    damaged[0] = 0;
    write(&damaged);
    let (code, text) = info(&["--cache", cache]);
    assert_eq!(code, Some(1), "{text}");
    let is_reported =
        text.contains("packed.tif") && text.contains("cannot be unpacked from row 0 on");
    assert!(is_reported && !text.contains("no surface"), "{text}");
    write(&packed[..3]);
    let (code, text) = info(&["--cache", cache]);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("absurd size"), "{text}");
}

/// A truncated file: its overview, the only part read when it opens, ends early.
#[test]
fn rows_of_an_overview_that_ends_early_are_read() {
    const WIDE: u32 = 4000;
    const HALF: u32 = WIDE / 2;
    const THERE: u32 = 600;
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
    // The directories come before the samples, as is usual in truncated files.
    const SAMPLES: u32 = 4096;
    let coarse = SAMPLES + WIDE * WIDE;
    let mut bytes = tiff(&[], &[image(0, WIDE, SAMPLES), image(1, HALF, coarse)]);
    bytes.resize(SAMPLES as usize, 0);
    bytes.resize(coarse as usize, 7);
    bytes.resize((coarse + HALF * THERE) as usize, 9);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cut.tif");
    std::fs::write(&path, bytes).expect("written");
    let options = OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    let raster = Raster::open(&path, &options).expect("all of the full image is there");
    assert_eq!([raster.height(0, 0), raster.height(3999, 3999)], [7.0; 2]);
    let coarse = |row: f64| raster.surface(1, [2000.0, f64::from(WIDE) - row]);
    assert_eq!(coarse(2.0 * f64::from(THERE) - 4.0), 9.0);
    assert!(coarse(2.0 * f64::from(THERE) + 4.0).is_nan());
}

#[test]
fn strip_of_4_gb_is_read_in_the_memory_of_a_terrain() {
    let (_folder, path) = file();
    let output = memory_limit::info(&path, &[]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(!text.contains("whole"), "{text}");
    let raster = Raster::open(&path, &OpenOptions::default()).expect("opens");
    for row in [0, EVERY, EVERY + 1, 17 * EVERY, 31_904, SIDE - 1] {
        for column in [0, 1, 2999, 3000, SIDE - 1] {
            let found = raster.height(column, SIDE - 1 - row);
            assert_eq!(found, f64::from(height(column, row)), "{column} {row}");
        }
    }
}

/// The whole file is searched for a height, which uses no memory, but is reported, as it takes
/// long.
#[test]
fn search_of_a_file_without_heights_is_reported() {
    const WIDE: u32 = 12_000;
    let image = floats_in_a_strip([WIDE; 2], FIRST);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("nothing.tif");
    std::fs::write(&path, tiff(&[], &[image])).expect("written");
    let file = fs::OpenOptions::new()
        .write(true)
        .open(&path)
        .expect("there");
    file.set_len(u64::from(FIRST) + u64::from(WIDE * WIDE) * 4)
        .expect("a sparse file");
    let output = memory_limit::info(&path, &["--input", "no-data=0"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{text}");
    let search = text.find("32 places of").expect("the search is reported");
    let end = text.find("no surface").expect("its result is reported");
    assert!(search < end, "{text}");
    assert!(text.contains("all 144000000 samples"), "{text}");
    // If zeros are heights, the first samples already have one.
    let output = memory_limit::info(&path, &[]);
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!text.contains("places of"), "nothing is to be searched for");
}

#[test]
fn four_million_tiles_are_read_in_the_memory_of_a_terrain() {
    const TILE: u32 = 64;
    const ACROSS: u32 = 2025;
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
        // All tiles share one place; the file is as long as if they did not.
        let file = fs::OpenOptions::new()
            .write(true)
            .open(&path)
            .expect("there");
        file.set_len(u64::from(ACROSS * TILE).pow(2))
            .expect("a sparse file");
        let output = memory_limit::info_without_gdal(&path, &[]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), text)
    };
    let (code, text) = info(&[image(0)]);
    assert_eq!(code, Some(0), "{text}");
    // Five such lists exceed the cache: that is not damage.
    let (code, text) = info(&[0, 1, 1, 1, 1].map(image));
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("very many small tiles"), "{text}");
}
