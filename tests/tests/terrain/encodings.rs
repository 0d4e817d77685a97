//! One field in encodings that this repository has no encoder for, written by GDAL:
//! `data/by_gdal.py` has the command. Every sample is exact.

use std::fs;
use std::path::{Path, PathBuf};

use hapterra_tests::reader::Reader;
use heightfield::{OpenOptions, Raster, RasterError};

const NO_DATA: (u32, u32) = (3, 4);

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data/by_gdal")
        .join(name)
}

/// Returns the height at a column and a row from the north, as in `by_gdal.py`.
fn height(column: u32, row: u32) -> f64 {
    let (column, row) = (f64::from(column), f64::from(row));
    100.0 + 7.0 * column - 3.0 * row + (column * row) % 5.0
}

/// Each band is 1000 above the one before.
fn assert_field(raster: &Raster, (columns, rows): (u32, u32), band: u32, name: &str) {
    assert_eq!((raster.columns(), raster.rows()), (columns, rows), "{name}");
    assert_eq!(raster.summary().no_data, 1, "{name}");
    for row in 0..rows {
        for column in 0..columns {
            let found = raster.height(column, rows - 1 - row);
            if (column, row) == NO_DATA {
                assert!(found.is_nan(), "{name}: {found} in the no-data");
            } else {
                let expected = height(column, row) + 1000.0 * f64::from(band - 1);
                assert_eq!(found, expected, "{name}: column {column}, row {row}");
            }
        }
    }
}

fn open_by(reader: Reader, name: &str, options: &OpenOptions) -> Raster {
    let raster = reader.open(&path(name), options);
    raster.unwrap_or_else(|error| panic!("{reader:?}: {error}"))
}

fn of_band(band: u32) -> OpenOptions {
    OpenOptions {
        band: Some(band),
        ..OpenOptions::default()
    }
}

#[test]
fn every_encoding_yields_the_exact_field_in_place() {
    for reader in Reader::all() {
        holds_the_exact_field(reader);
    }
}

fn holds_the_exact_field(reader: Reader) {
    for name in [
        "lerc_i16.tif",
        "lerc_deflate_u16.tif",
        "lerc_zstd_f32.tif",
        "lerc_f64.tif",
        "lerc_bands_i16.tif",
        "bands_planar_i16.tif",
        "world.tif",
        "ehdr.bil",
        "float.flt",
        "envi.dat",
    ] {
        if !reader.supports(name) {
            continue;
        }
        let raster = open_by(reader, name, &OpenOptions::default());
        assert_field(&raster, (40, 30), 1, name);
        let bounds = raster
            .bounds()
            .unwrap_or_else(|| panic!("{name}: no bounds"));
        let sides = [bounds.west, bounds.south, bounds.east, bounds.north];
        assert_eq!(
            sides,
            [400_000.0, 3_799_100.0, 401_200.0, 3_800_000.0],
            "{name}"
        );
    }
    if !reader.supports("n34w119.dt0") {
        return;
    }
    let dted = open_by(reader, "n34w119.dt0", &OpenOptions::default());
    assert_field(&dted, (121, 121), 1, "n34w119.dt0");
    let bounds = dted.bounds().expect("placed");
    assert!(
        (bounds.west + 119.0 + 1.0 / 240.0).abs() < 1e-9,
        "{bounds:?}"
    );
    assert!(
        (bounds.north - 35.0 - 1.0 / 240.0).abs() < 1e-9,
        "{bounds:?}"
    );
}

#[test]
fn band_is_selected_by_number() {
    for (name, bands) in [
        ("lerc_bands_i16.tif", 3),
        ("bands_planar_i16.tif", 3),
        ("ehdr.bil", 2),
        ("envi.dat", 2),
    ] {
        for reader in Reader::all().into_iter().filter(|it| it.supports(name)) {
            for band in 1..=bands {
                let raster = open_by(reader, name, &of_band(band));
                assert_field(&raster, (40, 30), band, name);
            }
            let error = reader.open(&path(name), &of_band(bands + 1));
            let error = error.expect_err(name);
            assert!(
                matches!(error.fault(), RasterError::NoSuchPart { .. }),
                "{error}"
            );
            let there = format!("bands 1 to {bands}");
            assert!(error.to_string().contains(&there), "{error}");
        }
    }
}

#[test]
fn variable_option_for_a_single_field_file_is_refused() {
    let named = |name: &str| OpenOptions {
        variable: Some(name.to_owned()),
        ..OpenOptions::default()
    };
    let error = Raster::open(path("lerc_i16.tif"), &named("z")).expect_err("a TIFF");
    assert!(error.to_string().contains("TIFF has bands"), "{error}");
}

/// A given cell size is used if the file has none, and refused if it has one.
#[test]
fn given_cell_size_is_used_only_if_the_file_has_none() {
    let sized = OpenOptions {
        ground_cell_m: Some(12.5),
        ..OpenOptions::default()
    };
    let error = Raster::open(path("lerc_i16.tif"), &sized).expect_err("it states 30 m");
    assert!(
        matches!(error.fault(), RasterError::CellSizeStated(_)),
        "{error}"
    );
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("bare.asc");
    for header in ["cellsize 1", "dx 1\ndy 2"] {
        fs::write(&file, format!("ncols 2\nnrows 2\n{header}\n1 2 3 4")).expect("written");
        let raster = Raster::open(&file, &sized).expect("its unit was assumed");
        let (east, north) = raster.cell().expect("given").ground_metres();
        assert_eq!(
            (east, north / east),
            (12.5, if header.contains("dy") { 2.0 } else { 1.0 })
        );
    }
}

/// A file changed or truncated anywhere is refused or read; its memory stays bounded.
#[test]
fn damaged_file_causes_no_panic_and_bounded_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in [
        "lerc_i16.tif",
        "lerc_zstd_f32.tif",
        "lerc_deflate_u16.tif",
        "ehdr.bil",
    ] {
        let whole = fs::read(path(name)).expect("readable");
        let file = folder.path().join(name);
        for header in ["hdr", "prj"] {
            let beside = path(name).with_extension(header);
            if beside.is_file() {
                fs::copy(&beside, file.with_extension(header)).expect("copied");
            }
        }
        for cut in [0, 1, 9, whole.len() / 3, whole.len() / 2, whole.len() - 1] {
            fs::write(&file, &whole[..cut]).expect("written");
            let outcome = Raster::open(&file, &OpenOptions::default());
            // The last byte of a TIFF file may not belong to a sample.
            assert!(
                outcome.is_err() || cut == whole.len() - 1,
                "{name} cut at {cut}"
            );
        }
        let mut chance = 1_u64;
        for _ in 0..300 {
            let mut bytes = whole.clone();
            for _ in 0..3 {
                chance = chance
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let at = (chance >> 33) as usize % bytes.len();
                bytes[at] = (chance >> 20) as u8;
            }
            fs::write(&file, &bytes).expect("written");
            // A panic of a decoder would be an error as well, so look for one.
            if let Err(error) = Raster::open(&file, &OpenOptions::default()) {
                assert!(
                    !matches!(error.fault(), RasterError::DecoderFailed(_)),
                    "{name}: {error}"
                );
            }
        }
    }
}
