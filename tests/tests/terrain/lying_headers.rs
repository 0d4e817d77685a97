//! Files read on demand that have wrong headers: windows, overviews, sizes. Each results in an
//! error, or a terrain with the file's heights, within the memory for a terrain.

use std::fs;
use std::path::{Path, PathBuf};

use hapterra_tests::memory_limit::{self, zstd_bomb};
use hapterra_tests::tiffs::{DATA, Directory, Values, placed, tiff};
use heightfield::{OpenOptions, Raster};

/// Side of the full image and of a tile in samples, and bytes of a tile of single floats.
const SIDE: u32 = 256;
const TILE: u32 = 64;
const TILE_BYTES: u32 = TILE * TILE * 4;
/// Height of all samples of the full image, and of the data after it.
const HEIGHT: f32 = 7.0;
const OTHER: f32 = 900.0;
/// Offset of the other images' data.
const OTHERS: u32 = DATA + TILE_BYTES;

/// Returns data as large as the full image; only a small part is used.
fn data() -> Vec<u8> {
    let of = |height: f32| height.to_le_bytes().repeat((TILE * TILE) as usize);
    let mut data = [of(HEIGHT), of(OTHER)].concat();
    data.resize((SIDE * SIDE * 4) as usize, 0);
    data
}

fn one(tag: u16, value: u32) -> (u16, Values) {
    (tag, Values::Longs(vec![value]))
}

/// Returns an image of single floats whose tiles are all the same.
fn image(kind: u32, side: u32, tile: u32, place: u32, tiles: usize) -> Directory {
    vec![
        one(254, kind),
        one(256, side),
        one(257, side),
        one(258, 32),
        one(259, 1),
        one(262, 1),
        one(277, 1),
        one(322, tile),
        one(323, tile),
        (324, Values::Longs(vec![place; tiles])),
        (325, Values::Longs(vec![TILE_BYTES; tiles])),
        one(339, 3),
    ]
}

fn full() -> Directory {
    let mut full = image(0, SIDE, TILE, DATA, 16);
    full.extend(placed([400_000.0, 3_800_000.0], 30.0, 32611));
    full
}

/// Returns an image with another value of a tag.
fn with(mut image: Directory, tag: u16, values: Values) -> Directory {
    let found = image.iter_mut().find(|(own, _)| *own == tag);
    found.expect("the tag is there").1 = values;
    image
}

fn overview() -> Directory {
    image(1, SIDE / 2, TILE, OTHERS, 4)
}

fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("written");
    (folder, path)
}

fn windows() -> OpenOptions {
    OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    }
}

fn open(path: &Path) -> Raster {
    let raster = Raster::open(path, &windows());
    raster.unwrap_or_else(|error| panic!("{error}"))
}

/// Checks that it ends within the memory, either well or in an error with fault, file and remedy.
fn ends_well(what: &str, path: &Path, more: &[&str]) -> (bool, String) {
    let options = [&["--input", "in-memory=0MB"], more].concat();
    let output = memory_limit::info(path, &options);
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("{what}: {:?} {printed}", output.status.code());
    match output.status.code() {
        Some(0) => {}
        Some(1) => {
            // Warnings about no-data may come before.
            let error = printed.find("error: ").map_or("", |at| &printed[at..]);
            assert!(error.contains("hint: "), "{what}: {printed}");
            let name = path.file_name().expect("a name").to_string_lossy();
            assert!(printed.contains(name.as_ref()), "{what}: {printed}");
        }
        code => panic!("{what}: {code:?} {printed}"),
    }
    (output.status.success(), printed)
}

#[test]
fn overview_at_another_place_is_not_used() {
    let elsewhere = |corner: [f64; 2], cell: f64, zone: u16| {
        let mut overview = overview();
        overview.extend(placed(corner, cell, zone));
        overview
    };
    let here = [400_000.0, 3_800_000.0];
    let cases = [
        ("it is one", overview(), true),
        ("its path is reported", elsewhere(here, 60.0, 32611), true),
        ("in another system", elsewhere(here, 60.0, 32612), false),
        (
            "at another place",
            elsewhere([400_300.0, 3_800_000.0], 60.0, 32611),
            false,
        ),
        (
            "of cells of another size",
            elsewhere(here, 45.0, 32611),
            false,
        ),
        // Writers copy tags; GDAL ignores an overview's.
        (
            "with the full image's place and cells",
            elsewhere(here, 30.0, 32611),
            true,
        ),
        (
            "larger than the file",
            image(1, 2 * SIDE, TILE, OTHERS, 64),
            false,
        ),
        (
            "as large as the file",
            image(1, SIDE, TILE, OTHERS, 16),
            false,
        ),
        (
            "of another type",
            with(overview(), 339, Values::Longs(vec![1])),
            false,
        ),
        (
            "of fewer bits",
            with(overview(), 258, Values::Longs(vec![16])),
            false,
        ),
        (
            "of two bands",
            with(overview(), 277, Values::Longs(vec![2])),
            false,
        ),
        (
            "of other proportions",
            with(overview(), 257, Values::Longs(vec![SIDE / 4])),
            false,
        ),
        (
            "of huge tiles",
            with(overview(), 322, Values::Longs(vec![1 << 31])),
            false,
        ),
        (
            "with too few tiles",
            with(overview(), 325, Values::Longs(vec![TILE_BYTES; 3])),
            false,
        ),
        (
            "packed in a way that is not read",
            with(overview(), 259, Values::Longs(vec![7])),
            false,
        ),
    ];
    for (what, overview, is_used) in cases {
        let (_folder, path) = written("lie.tif", &tiff(&data(), &[full(), overview]));
        let raster = open(&path);
        assert_eq!(raster.height(17, 200), f64::from(HEIGHT), "{what}");
        let expected = if is_used { OTHER } else { HEIGHT };
        assert_eq!(
            raster.surface(1, [30.0, 30.0]),
            f64::from(expected),
            "{what}"
        );
        assert!(ends_well(what, &path, &[]).0, "{what}");
    }
}

/// A damaged tile of an overview is no-data at coarse levels, and has no other effect.
#[test]
fn missing_overview_tiles_leave_the_full_image_intact() {
    for (what, place, warns) in [
        ("behind the end", u32::MAX - 7, true),
        ("left out", 0, false),
    ] {
        let overview = with(
            overview(),
            324,
            Values::Longs(vec![place, OTHERS, OTHERS, OTHERS]),
        );
        let (_folder, path) = written("lie.tif", &tiff(&data(), &[full(), overview]));
        let raster = open(&path);
        assert_eq!(raster.height(3, 250), f64::from(HEIGHT), "{what}");
        assert!(raster.surface(1, [3.0, 250.0]).is_nan(), "{what}");
        assert_eq!(raster.surface(1, [200.0, 3.0]), f64::from(OTHER), "{what}");
        let (is_open, printed) = ends_well(what, &path, &[]);
        assert!(
            is_open && printed.contains("cannot be read and count as no data") == warns,
            "{what}: {printed}"
        );
    }
}

#[test]
fn tile_with_a_false_offset_is_no_data() {
    let places = |first: u32| {
        let mut places = vec![DATA; 16];
        places[0] = first;
        with(full(), 324, Values::Longs(places))
    };
    let (_folder, path) = written("lie.tif", &tiff(&data(), &[places(u32::MAX - 7)]));
    let raster = open(&path);
    assert!(raster.height(3, 250).is_nan());
    assert_eq!(raster.height(3, 3), f64::from(HEIGHT));
    let (is_open, printed) = ends_well("behind the end", &path, &[]);
    assert!(is_open && printed.contains("columns 0 to "), "{printed}");
    // At the header's offset nothing is stored, whatever the size: no heights of zero.
    for options in [windows(), OpenOptions::default()] {
        let (_folder, path) = written("lie.tif", &tiff(&data(), &[places(0)]));
        let raster = Raster::open(&path, &options).expect("sparse");
        assert!(raster.height(3, 250).is_nan());
        assert_eq!(raster.height(3, 3), f64::from(HEIGHT));
    }
}

#[test]
fn tile_with_huge_stated_size_is_read_in_bounded_memory() {
    let packed = |bytes: u32, compression: u32, place: u32| {
        let mut sizes = vec![TILE_BYTES; 16];
        sizes[0] = bytes;
        let mut places = vec![DATA; 16];
        places[0] = place;
        let image = with(full(), 325, Values::Longs(sizes));
        let image = with(image, 324, Values::Longs(places));
        with(image, 259, Values::Longs(vec![compression]))
    };
    // The other tiles are not such streams, so they are no-data: the file has no heights.
    let bomb = zstd_bomb(1 << 15);
    let all = [data(), bomb.clone()].concat();
    let place = DATA + data().len() as u32;
    for (what, image, data, length) in [
        (
            "4 GB of a file of 5 GB",
            packed(u32::MAX, 1, DATA),
            data(),
            Some(5_u64 << 30),
        ),
        (
            "4 GB of a packed tile",
            packed(u32::MAX, 8, DATA),
            data(),
            Some(5 << 30),
        ),
        (
            "4 GB in 131 KB",
            packed(bomb.len() as u32, 50000, place),
            all,
            None,
        ),
    ] {
        let (_folder, path) = written("lie.tif", &tiff(&data, &[image]));
        if let Some(length) = length {
            let file = fs::OpenOptions::new()
                .write(true)
                .open(&path)
                .expect("there");
            file.set_len(length).expect("a sparse file");
        }
        ends_well(what, &path, &[]);
    }
}

#[test]
fn false_directories_are_errors_or_yield_the_full_image() {
    let long = |values: &[u32]| Values::Longs(values.to_vec());
    let huge = 1 << 31;
    let both = |image: Directory, tags: [u16; 2], value: u32| {
        with(
            with(image, tags[0], long(&[value])),
            tags[1],
            long(&[value]),
        )
    };
    for (what, image) in [
        ("tiles of 2^31 each way", both(full(), [322, 323], huge)),
        (
            "tiles of 2^31 by 1",
            with(with(full(), 322, long(&[huge])), 323, long(&[1])),
        ),
        ("tiles of no samples", with(full(), 322, long(&[0]))),
        ("2^31 samples each way", both(full(), [256, 257], huge)),
        (
            "the most samples each way",
            both(full(), [256, 257], u32::MAX),
        ),
        ("too few places", with(full(), 324, long(&[DATA; 3]))),
        ("too few sizes", with(full(), 325, long(&[TILE_BYTES; 3]))),
    ] {
        let (_folder, path) = written("lie.tif", &tiff(&data(), &[image]));
        assert!(!ends_well(what, &path, &[]).0, "{what}");
    }
    // The list of directories: back to the first, to itself, past the end.
    let good = tiff(&data(), &[full(), overview()]);
    let first = u32::from_le_bytes(good[4..8].try_into().expect("four bytes"));
    let next = first as usize + 2 + 12 * full().len();
    let second = u32::from_le_bytes(good[next..next + 4].try_into().expect("four bytes"));
    let last = second as usize + 2 + 12 * overview().len();
    for (what, at, to) in [
        ("the second leads to the first", last, first),
        ("the second leads to itself", last, second),
        ("the first leads to itself", next, first),
        ("the second is behind the end", next, u32::MAX - 1),
    ] {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&to.to_le_bytes());
        let (_folder, path) = written("lie.tif", &bytes);
        ends_well(what, &path, &[]);
    }
    // A list of 3 · 10⁹ entries.
    let entry = full()
        .iter()
        .position(|(tag, _)| *tag == 324)
        .expect("places");
    let mut bytes = good;
    let at = first as usize + 2 + 12 * entry + 4;
    bytes[at..at + 4].copy_from_slice(&3_000_000_000_u32.to_le_bytes());
    let (_folder, path) = written("lie.tif", &bytes);
    assert!(!ends_well("a list of 3 billion places", &path, &[]).0);
}

fn npy(header: &str) -> Vec<u8> {
    let header = format!("{header:<117}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend([1; 4000]);
    bytes
}

#[test]
fn plain_samples_with_false_headers_are_errors() {
    let shape = |shape: &str| {
        npy(&format!(
            "{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}"
        ))
    };
    let mut long_header = b"\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr': '<f4'".to_vec();
    long_header.extend([b' '; 3000]);
    for (what, bytes) in [
        ("2^31 x 2^31", shape("2147483648, 2147483648")),
        ("2^63 x 2", shape("9223372036854775808, 2")),
        ("2^64 x 2", shape("18446744073709551616, 2")),
        ("a product that wraps to 4", shape("4294967297, 4294967292")),
        ("0 x 5", shape("0, 5")),
        ("-3 x 5", shape("-3, 5")),
        ("a header of 4 GB", long_header),
    ] {
        let (_folder, path) = written("lie.npy", &bytes);
        assert!(!ends_well(what, &path, &[]).0, "{what}");
    }
    let header = |size: [&str; 2], more: &str| {
        format!(
            "ncols {}\nnrows {}\nxllcorner 0\nyllcorner 0\ncellsize 1\n{more}\n",
            size[0], size[1]
        )
    };
    for (what, extension, text) in [
        (
            "2^31 x 2^31",
            "flt",
            header(["2147483648", "2147483648"], ""),
        ),
        (
            "2^32 - 1 squared",
            "flt",
            header(["4294967295", "4294967295"], ""),
        ),
        ("2^40 x 2", "flt", header(["1099511627776", "2"], "")),
        ("0 x 5", "flt", header(["0", "5"], "")),
        (
            "skips 2^63",
            "bil",
            header(["10", "10"], "nbits 16\nskipbytes 9223372036854775808"),
        ),
        (
            "rows of 2^63",
            "bil",
            header(["10", "10"], "nbits 16\ntotalrowbytes 9223372036854775807"),
        ),
        (
            "bands of 2^63",
            "bsq",
            header(
                ["10", "10"],
                "nbits 16\nnbands 2\nbandgapbytes 9223372036854775807",
            ),
        ),
        (
            "2^32 - 1 bands",
            "bip",
            header(["10", "10"], "nbits 16\nnbands 4294967295"),
        ),
    ] {
        let (_folder, path) = written(&format!("lie.{extension}"), &[1; 4000]);
        fs::write(path.with_extension("hdr"), text).expect("written");
        assert!(!ends_well(what, &path, &[]).0, "{what}");
    }
    let (_folder, path) = written("lie.raw", &[1; 4000]);
    for size in ["4294967295x4294967295", "2147483648x2147483648", "1001x2"] {
        assert!(
            !ends_well(size, &path, &["--input", &format!("raw={size}")]).0,
            "{size}"
        );
    }
    // As long as declared, and empty: a terabyte that uses no memory.
    let (_folder, path) = written("N44W072.hgt", &[]);
    let side = 741_455_u64;
    let file = fs::OpenOptions::new()
        .write(true)
        .open(&path)
        .expect("there");
    file.set_len(2 * side * side).expect("a sparse file");
    ends_well("a terabyte of zeros", &path, &[]);
    file.set_len(2 * side * side + 2).expect("a sparse file");
    assert!(!ends_well("no square", &path, &[]).0);
}
