//! NetCDF files of every way of storing a variable, made by NetCDF's and HDF5's libraries:
//! `data/netcdf.py` names the command. What is read where it is touched is to the bit what is
//! read as a whole; what is damaged is a hole; what lies takes no memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use hapterra_tests::bounded::{self, zstd_bomb};
use heightfield::{BadRaster, OpenOptions, Raster};

const SIZE: (u32, u32) = (90, 70);
const HOLE: (u32, u32) = (3, 4);
/// Rows and columns of a chunk.
const CHUNK: (u32, u32) = (16, 12);

const FILES: [&str; 20] = [
    "big_endian.nc",
    "btree_2.nc",
    "classic.nc",
    "classic_records.nc",
    "classic_time.nc",
    "contiguous.nc",
    "depths.nc",
    "early.nc",
    "extensible_array.nc",
    "fixed_array.nc",
    "growing.nc",
    "packed.nc",
    "single_chunk.nc",
    "southern.nc",
    "sparse.nc",
    "time.nc",
    "turned.nc",
    "turned_contiguous.nc",
    "unsigned.nc",
    "zstd.nc",
];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data/netcdf")
        .join(name)
}

/// The height at a column and a row from the north, as `netcdf.py` has it.
fn height(column: u32, row: u32) -> f64 {
    f64::from(20 + (3 * column + 2 * row + (column * row) % 5) % 230)
}

fn windows() -> OpenOptions {
    OpenOptions {
        most_in_memory_bytes: 0,
        ..OpenOptions::default()
    }
}

fn open(path: &Path, options: &OpenOptions) -> Raster {
    let raster = Raster::open(path, options);
    raster.unwrap_or_else(|error| panic!("{error}"))
}

/// All samples of a level, its row 0 the southernmost.
fn samples(raster: &Raster, level: u8) -> Vec<Vec<f64>> {
    let step = 1 << level;
    let (columns, rows) = (SIZE.0.div_ceil(step), SIZE.1.div_ceil(step));
    let row = |row| {
        let mut heights = vec![0.0; columns as usize];
        raster.copy_row(level, row, 0, &mut heights);
        heights
    };
    (0..rows).map(row).collect()
}

fn bits(samples: &[Vec<f64>]) -> Vec<u64> {
    let all = samples.iter().flatten();
    all.map(|height| {
        if height.is_nan() {
            u64::MAX
        } else {
            height.to_bits()
        }
    })
    .collect()
}

#[test]
fn every_storage_gives_the_same_samples_in_windows() {
    for name in FILES {
        let whole = open(&path(name), &OpenOptions::default());
        let touched = open(&path(name), &windows());
        assert!(
            whole.samples().is_some() && touched.samples().is_none(),
            "{name}"
        );
        for level in 0..=6 {
            let [whole, touched] = [&whole, &touched].map(|raster| bits(&samples(raster, level)));
            assert_eq!(whole, touched, "{name}, level {level}");
        }
        let places = [
            [0.5, 0.25],
            [13.75, 69.0],
            [88.9, 0.1],
            [2.5, 65.5],
            [40.0, 33.3],
        ];
        for place in places {
            let [one, other] = [&whole, &touched].map(|raster| raster.surface(0, place).to_bits());
            assert_eq!(one, other, "{name} {place:?}");
        }
        assert_eq!(whole.format(), touched.format(), "{name}");
        assert_eq!(
            whole.bounds().map(|b| [b.west, b.south, b.east, b.north]),
            touched.bounds().map(|b| [b.west, b.south, b.east, b.north]),
            "{name}"
        );
        assert_eq!(whole.remarks(), touched.remarks(), "{name}");
        assert!(
            touched.memory_bytes() <= 256 << 20,
            "{name}: {}",
            touched.memory_bytes()
        );
        // The same file is the same terrain.
        let again = open(&path(name), &windows());
        assert_eq!(samples(&again, 0).len(), SIZE.1 as usize);
    }
}

#[test]
fn every_storage_holds_the_exact_field() {
    for name in FILES {
        let raster = open(&path(name), &windows());
        let sign = if name == "depths.nc" { -1.0 } else { 1.0 };
        let rows = samples(&raster, 0);
        for row in 0..SIZE.1 {
            for column in 0..SIZE.0 {
                let found = rows[(SIZE.1 - 1 - row) as usize][column as usize];
                let is_written = name != "sparse.nc" || ((16..48).contains(&row) && column < 36);
                let wanted = sign * height(column, row);
                match name {
                    // Its missing values and its valid range, in stored numbers.
                    "packed.nc" if [98.5, 96.5].contains(&wanted) || wanted > 300.0 => {
                        assert!(found.is_nan(), "{name}: {column} {row}");
                    }
                    _ if (column, row) == HOLE || !is_written => {
                        assert!(found.is_nan(), "{name}: {column} {row}: {found}");
                    }
                    _ => assert_eq!(found, wanted, "{name}: {column} {row}"),
                }
            }
        }
        let bounds = raster.bounds().expect("its place");
        for (found, wanted) in [(bounds.west, 7.995), (bounds.north, 50.005)] {
            assert!((found - wanted).abs() < 1e-9, "{name}: {found}");
        }
    }
}

/// A folder, and a copy of a file in it that was changed.
fn changed(name: &str, change: impl FnOnce(&mut Vec<u8>)) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let copy = folder.path().join(name);
    let mut bytes = fs::read(path(name)).expect("readable");
    change(&mut bytes);
    fs::write(&copy, bytes).expect("written");
    (folder, copy)
}

fn places_of(bytes: &[u8], pattern: &[u8]) -> Vec<usize> {
    let windows = bytes.windows(pattern.len()).enumerate();
    windows
        .filter(|(_, window)| *window == pattern)
        .map(|(at, _)| at)
        .collect()
}

#[test]
fn a_damaged_chunk_is_a_hole_and_the_others_are_felt() {
    // Deflate's streams begin so, and have a check sum of HDF5's behind them.
    let (_folder, copy) = changed("packed.nc", |bytes| {
        let streams = places_of(bytes, &[0x78, 0x5e]);
        assert!(streams.len() >= 40, "{streams:?}");
        bytes[streams[20] + 30] ^= 0x55;
    });
    assert!(Raster::open(&copy, &OpenOptions::default()).is_err());
    let good = open(&path("packed.nc"), &windows());
    let raster = open(&copy, &windows());
    let (good_rows, rows) = (samples(&good, 0), samples(&raster, 0));
    let mut lost = Vec::new();
    for row in 0..SIZE.1 {
        for column in 0..SIZE.0 {
            let at = |rows: &[Vec<f64>]| rows[(SIZE.1 - 1 - row) as usize][column as usize];
            let (good, found) = (at(&good_rows), at(&rows));
            if good.to_bits() != found.to_bits() && !(good.is_nan() && found.is_nan()) {
                assert!(found.is_nan(), "{column} {row}: {found}, not {good}");
                lost.push((row / CHUNK.0, column / CHUNK.1));
            }
        }
    }
    assert!((1..=192).contains(&lost.len()), "{}", lost.len());
    assert!(lost.iter().all(|chunk| *chunk == lost[0]), "{lost:?}");
    // A coarse level has holes where these are, and nowhere else.
    for level in 1..=3 {
        let step = 1 << level;
        let coarse = samples(&raster, level);
        for (row, heights) in coarse.iter().enumerate() {
            for (column, height) in heights.iter().enumerate() {
                let fine = rows[row * step][column * step];
                let same = fine.to_bits() == height.to_bits() || (fine.is_nan() && height.is_nan());
                assert!(same, "level {level}: {column} {row}: {height}, not {fine}");
            }
        }
    }
    let output = info(&copy);
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}");
    let (row, column) = lost[0];
    let (first_row, first_column) = (row * CHUNK.0, column * CHUNK.1);
    let place = format!("columns {first_column} to ");
    assert!(
        told.contains(&place) && told.contains(&format!("rows {first_row} to ")),
        "{told}"
    );
    assert_eq!(
        told.matches("cannot be read and are a hole").count(),
        1,
        "{told}"
    );
}

/// Runs `hapterra info` on a file whose samples are to be read where they are touched.
fn info(path: &Path) -> Output {
    bounded::info(path, &["--in-memory-mb", "0"])
}

/// The key of the first chunk in the index, a B-tree of HDF5's first version: bytes and mask,
/// offsets of rows, columns and bytes, and the chunk's address.
fn first_key(bytes: &[u8]) -> usize {
    let trees = places_of(bytes, b"TREE\x01");
    assert_eq!(trees.len(), 1);
    trees[0] + 24
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    bytes[at..at + value.len()].copy_from_slice(value);
}

/// Files that lie about their sizes, and the words of the error where they do not open.
#[test]
#[allow(clippy::type_complexity)]
fn lying_headers_are_errors_or_holes_in_bounded_memory() {
    let chunk = |rows: u32, columns: u32| {
        move |bytes: &mut Vec<u8>| {
            let pattern = [16_u32, 12, 4].map(u32::to_le_bytes).concat();
            let places = places_of(bytes, &pattern);
            assert_eq!(places.len(), 1);
            put(bytes, places[0], &rows.to_le_bytes());
            put(bytes, places[0] + 4, &columns.to_le_bytes());
        }
    };
    let size = |rows: u64, columns: u64| {
        move |bytes: &mut Vec<u8>| {
            let pattern = [70_u64, 90].map(u64::to_le_bytes).concat();
            for place in places_of(bytes, &pattern) {
                put(bytes, place, &rows.to_le_bytes());
                put(bytes, place + 8, &columns.to_le_bytes());
            }
        }
    };
    let first = |packed: u32, address: u64| {
        move |bytes: &mut Vec<u8>| {
            let key = first_key(bytes);
            put(bytes, key, &packed.to_le_bytes());
            put(bytes, key + 32, &address.to_le_bytes());
        }
    };
    let bomb = |bytes: &mut Vec<u8>| {
        let (at, frame) = (bytes.len() as u64, zstd_bomb(1 << 15));
        let key = first_key(bytes);
        put(bytes, key, &(frame.len() as u32).to_le_bytes());
        put(bytes, key + 32, &at.to_le_bytes());
        bytes.extend(frame);
    };
    let tries: Vec<(&str, Box<dyn Fn(&mut Vec<u8>)>, Option<&str>)> = vec![
        (
            "chunks of 2^31 x 12",
            Box::new(chunk(1 << 31, 12)),
            Some(""),
        ),
        (
            "chunks of 2^31 x 2^31",
            Box::new(chunk(1 << 31, 1 << 31)),
            Some(""),
        ),
        (
            "chunks of 2^16 x 2^16",
            Box::new(chunk(1 << 16, 1 << 16)),
            Some(""),
        ),
        ("chunks of 0 x 12", Box::new(chunk(0, 12)), Some("")),
        (
            "2^31 x 2^31 samples",
            Box::new(size((1 << 31) - 1, (1 << 31) - 1)),
            Some(""),
        ),
        ("2^40 x 90 samples", Box::new(size(1 << 40, 90)), Some("")),
        (
            "2^63 x 2^63 samples",
            Box::new(size(1 << 63, 1 << 63)),
            Some(""),
        ),
        (
            "a chunk behind the end",
            Box::new(first(300, 1 << 40)),
            None,
        ),
        (
            "a chunk at the end of numbers",
            Box::new(first(300, u64::MAX - 8)),
            None,
        ),
        (
            "a packed chunk of 4 GB",
            Box::new(first(u32::MAX, 4240)),
            None,
        ),
        ("a chunk of 4 GB in 131 KB", Box::new(bomb), None),
    ];
    for (what, lie, words) in tries {
        let (_folder, copy) = changed("early.nc", lie);
        for options in [windows(), OpenOptions::default()] {
            if let Err(error) = Raster::open(&copy, &options) {
                let failed = matches!(error.fault(), BadRaster::DecoderFailed(_));
                assert!(!failed, "{what}: {error}");
            }
        }
        let output = info(&copy);
        let told = String::from_utf8_lossy(&output.stderr);
        println!("{what}: {:?} {told}", output.status.code());
        match (words, output.status.code()) {
            (None, Some(0)) => {}
            (Some(words), Some(1)) => {
                assert!(
                    told.starts_with("error: ") && told.contains(words),
                    "{what}: {told}"
                );
                assert!(told.contains("hint: "), "{what}: {told}");
            }
            (_, code) => panic!("{what}: {code:?} {told}"),
        }
    }
}

/// The classic format has no chunks: what lies behind the end was cut off.
#[test]
fn a_file_without_chunks_that_was_cut_is_refused_when_it_is_opened() {
    for name in [
        "classic.nc",
        "classic_records.nc",
        "contiguous.nc",
        "turned_contiguous.nc",
    ] {
        let (_folder, copy) = changed(name, |bytes| bytes.truncate(bytes.len() - 6000));
        let error = Raster::open(&copy, &windows()).expect_err(name).to_string();
        assert!(
            error.contains("truncated") || error.contains("damaged"),
            "{name}: {error}"
        );
    }
}

#[test]
fn a_packing_that_is_not_read_is_named_at_once() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/by_gdal/bzip2.nc");
    let options = OpenOptions {
        variable: Some("bed".into()),
        ..windows()
    };
    let error = Raster::open(file, &options).expect_err("bzip2");
    assert!(
        matches!(error.fault(), BadRaster::Unsupported { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("HDF5's registry"), "{error}");
}

/// Changed anywhere, a file opens or does not, and whatever is touched ends.
#[test]
fn damaged_copies_end_in_an_error_or_in_holes() {
    let mut chance = 1_u64;
    let mut roll = |below: usize| {
        chance = chance
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (chance >> 33) as usize % below
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut opened = 0;
    for name in [
        "early.nc",
        "fixed_array.nc",
        "packed.nc",
        "classic_records.nc",
        "time.nc",
    ] {
        let whole = fs::read(path(name)).expect("readable");
        for _ in 0..100 {
            let mut bytes = whole.clone();
            let reach = [bytes.len(), 6000][roll(2)];
            for _ in 0..1 + roll(6) {
                bytes[roll(reach)] = roll(256) as u8;
            }
            let file = folder.path().join(name);
            fs::write(&file, &bytes).expect("written");
            match Raster::open(&file, &windows()) {
                Ok(raster) => {
                    opened += 1;
                    for level in [0, 3] {
                        let _ = samples(&raster, level);
                    }
                }
                Err(error) => {
                    let failed = matches!(error.fault(), BadRaster::DecoderFailed(_));
                    assert!(!failed, "{name}: {error}");
                }
            }
        }
    }
    assert!(opened > 50, "{opened}");
}
