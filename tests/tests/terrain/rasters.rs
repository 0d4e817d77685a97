//! Every file decodes to the exact stored samples, in any layout.
//!
//! The shared `dem/variants` are encodings of one 512 × 400 crop of a mountain range; its samples
//! are also raw files, so no decoder is compared with itself.

use std::path::{Path, PathBuf};

use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain, TileBuffer};
use hapterra_core::terrain::TileKey;
use hapterra_tests::reader::Reader;
use hapterra_tests::shared;
use heightfield::{CellUnit, OpenOptions, PngChannel, Raster, RasterError, Wait, gdal};

const COLUMNS: usize = 512;
const ROWS: usize = 400;
/// Marks no-data in `tujunga_i16_holes.raw`.
const NO_DATA: i16 = -32768;

fn open(path: &Path) -> Raster {
    Raster::open(path, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the heights of a raw file, north row first, no-data as NaN.
fn truth_i16(folder: &Path, name: &str) -> Vec<f64> {
    let bytes = std::fs::read(folder.join(name)).expect("the truth is there");
    let (samples, _) = bytes.as_chunks::<2>();
    let stored = samples.iter().map(|&bytes| i16::from_le_bytes(bytes));
    stored
        .map(|value| {
            if value == NO_DATA {
                f64::NAN
            } else {
                value.into()
            }
        })
        .collect()
}

fn truth_f32(folder: &Path) -> Vec<f64> {
    let bytes = std::fs::read(folder.join("tujunga_f32_nan.raw")).expect("the truth is there");
    let (samples, _) = bytes.as_chunks::<4>();
    samples
        .iter()
        .map(|&bytes| f32::from_le_bytes(bytes).into())
        .collect()
}

/// Returns a height in the 8-bit versions: (height − 533) × 255 / 1459, with the overflow of their
/// 16-bit computation, which adds cliffs to the mountains.
fn to_8_bits(height: f64) -> f64 {
    let wrapped = (height as i16 - 533).wrapping_mul(255);
    f64::from(wrapped.div_euclid(1459) as u8)
}

/// Returns the north-western `columns × rows` of `truth`.
fn crop(truth: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    let rows = truth.chunks(COLUMNS).take(rows);
    rows.flat_map(|row| row[..columns].iter().copied())
        .collect()
}

/// The first row of `truth` is the field's northernmost.
fn assert_heights(raster: &Raster, truth: &[f64], name: &str) {
    let (columns, rows) = (raster.columns() as usize, raster.rows() as usize);
    assert_eq!(columns * rows, truth.len(), "{name}: {columns} × {rows}");
    for (index, &expected) in truth.iter().enumerate() {
        let (column, row) = (index % columns, rows - 1 - index / columns);
        let height = raster.height(column as u32, row as u32);
        let same = height == expected || (height.is_nan() && expected.is_nan());
        assert!(same, "{name}: {height} for {expected} at {column}, {row}");
    }
    let holes = truth.iter().filter(|height| height.is_nan()).count();
    assert_eq!(raster.summary().no_data, holes as u64, "{name}: no-data");
}

/// Returns the expected heights of a variant, by its name and its line in the manifest.
fn expected(folder: &Path, name: &str, description: &str) -> Option<Vec<f64>> {
    let whole = || truth_i16(folder, "tujunga_i16.raw");
    let holes = || truth_i16(folder, "tujunga_i16_holes.raw");
    Some(match name {
        "i16_scale_offset_ft.tif" => holes().iter().map(|h| h * 0.3048 + 100.0).collect(),
        "i16_tiled_not_multiple.tif" => crop(&whole(), 477, 333),
        "u8_strip.tif" | "png_gray8.png" | "png_rgba8_depth_in_alpha.png" => {
            whole().into_iter().map(to_8_bits).collect()
        }
        "png_gray16.png" | "png_rgba16_depth_in_alpha.png" => whole(),
        "png_graya16.png" | "i16_cog_lzw_p2.tif" => holes(),
        "tujunga_holes.asc" | "tujunga_center_crlf_upper.asc" => crop(&holes(), 160, 120),
        _ if name.starts_with("f32_") || name.starts_with("f64_") => truth_f32(folder),
        _ if name.starts_with("odd_") || !name.ends_with(".tif") => return None,
        _ if description.contains("nodata=-32768") => holes(),
        _ => whole(),
    })
}

/// Returns the manifest's existing files, each with its description.
fn variants(folder: &Path) -> Vec<(String, String)> {
    let manifest = std::fs::read_to_string(folder.join("MANIFEST.csv")).expect("the manifest");
    let lines = manifest.lines().filter_map(|line| line.split_once(','));
    lines
        .filter(|(name, _)| folder.join(name).is_file())
        .map(|(name, description)| (name.to_owned(), description.to_owned()))
        .collect()
}

#[test]
fn every_variant_decodes_to_the_exact_samples() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    let mut checked = 0;
    for (name, description) in variants(&folder) {
        if let Some(truth) = expected(&folder, &name, &description) {
            let path = folder.join(&name);
            for reader in Reader::all().iter().filter(|reader| reader.supports(&name)) {
                let raster = reader.open(&path, &OpenOptions::default());
                let raster = raster.unwrap_or_else(|error| panic!("{reader:?}: {error}"));
                assert_heights(&raster, &truth, &format!("{name} by {reader:?}"));
            }
            checked += 1;
        }
    }
    println!("{checked} variants are exact");
    assert!(checked >= 16, "only {checked} variants were checked");
}

#[test]
fn raw_samples_decode_with_a_stated_layout() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    use heightfield::{Endian, RawLayout, SampleType};
    let open_raw = |sample, columns, name: &str, no_data| {
        let options = OpenOptions {
            raw: Some(RawLayout {
                columns,
                rows: ROWS as u32,
                sample,
                endian: Endian::Little,
            }),
            no_data,
            ..OpenOptions::default()
        };
        Raster::open(folder.join(name), &options)
    };
    let name = "tujunga_i16_holes.raw";
    let raster = open_raw(SampleType::I16, 512, name, Some(-32768.0)).expect(name);
    assert_heights(&raster, &truth_i16(&folder, name), name);
    let name = "tujunga_f32_nan.raw";
    let raster = open_raw(SampleType::F32, 512, name, None).expect(name);
    assert_heights(&raster, &truth_f32(&folder), name);

    let wrong = open_raw(SampleType::I16, 513, name, None).expect_err("another size");
    assert!(matches!(wrong.fault(), RasterError::Damaged(_)), "{wrong}");
    let short = open_raw(SampleType::F64, 512, name, None).expect_err("too short");
    assert!(
        matches!(short.fault(), RasterError::Truncated(_)),
        "{short}"
    );
}

#[test]
fn srtm_tile_has_cell_size_of_its_latitude_and_no_data() {
    let Some(path) = shared("dem/variants/N27E086.hgt") else {
        return;
    };
    let raster = open(&path);
    let bytes = std::fs::read(&path).expect("readable");
    let (samples, _) = bytes.as_chunks::<2>();
    let stored = samples.iter().map(|&bytes| i16::from_be_bytes(bytes));
    let truth: Vec<f64> = stored
        .map(|value| {
            if value == NO_DATA {
                f64::NAN
            } else {
                value.into()
            }
        })
        .collect();
    assert_heights(&raster, &truth, "N27E086.hgt");
    let cell = raster.cell().expect("3 arc seconds");
    assert_eq!(cell.unit, CellUnit::Degree);
    // 27.5° north: 3" are 92.3 m of latitude and 82.3 m of longitude.
    let (east, north) = cell.metres();
    assert!((east - 82.34).abs() < 0.05, "{east}");
    assert!((north - 92.34).abs() < 0.05, "{north}");
    assert_eq!(raster.stated_metres_per_vertical_unit(), Some(1.0));
}

#[test]
fn cell_size_and_units_are_read_from_the_file() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    let raster = open(&folder.join("i16_scale_offset_ft.tif"));
    let rendered = HapticGrid::new(&raster, HapticCells::Stored);
    // 30 m of the map; UTM reduces the ground by 0.026 % there.
    let side = rendered.side_m().expect("known");
    assert!((side - 30.007_77).abs() < 1e-4, "{side}");
    assert!(!rendered.is_resampled());
    assert_eq!(raster.metres_per_vertical_unit(), 0.3048);
    assert_eq!(rendered.cells_per_vertical_unit(), Some(0.3048 / side));

    let rotated = open(&folder.join("rotated_geotransform.tif"));
    let metres = rotated.cell().expect("a grid").metres();
    assert_eq!(metres, (20.0_f64.hypot(4.0), 20.0_f64.hypot(5.0)));
    assert!(rotated.remarks()[0].contains("rotated by 11.3°"));

    let picture = open(&folder.join("png_gray16.png"));
    let rendered = HapticGrid::new(&picture, HapticCells::Stored);
    assert_eq!(
        (rendered.side_m(), rendered.cells_per_vertical_unit()),
        (None, None)
    );
}

/// Columns, rows, no-data and height range of the real files, from the sources and another decoder
/// (GDAL).
#[test]
fn every_real_file_opens() {
    let Some(folder) = shared("dem/real") else {
        return;
    };
    let by_gdal: [(&str, [u32; 2], u64, [f64; 2]); 6] = [
        ("HI_topo_02.nc", [725, 534], 0, [-7.438, 2.804]),
        ("Kilauea.utm.nc", [857, 793], 20656, [0.0, 1505.0]),
        ("N10W110.hgt.zip", [1201, 1201], 0, [0.0, 9.0]),
        // GDAL adds an empty row at either end.
        (
            "SainteHelens.dem",
            [327, 468],
            3497 + 2 * 327,
            [682.0, 2543.0],
        ),
        (
            "earth_relief_20m_holes.grd",
            [31, 31],
            171,
            [-4929.5, 1601.0],
        ),
        ("tut_relief.nc", [600, 600], 0, [1052.0, 4328.0]),
    ];
    let own: [(&str, [u32; 2], u64, [f64; 2]); 12] = [
        ("LisbonElevation.tif", [547, 421], 0, [-6.829, 217.941]),
        ("N44W072.hgt", [1201, 1201], 0, [115.0, 1908.0]),
        ("SRTMGL3_boulder.asc", [240, 144], 0, [1943.0, 3286.0]),
        ("bigtujunga.tif", [1197, 643], 0, [315.0, 2295.0]),
        ("bijou_gully_5m.asc", [105, 77], 0, [1673.068, 1729.865]),
        (
            "dom1_32_356_5699_1_nw_2020.tif",
            [1000, 1000],
            0,
            [87.29, 167.74],
        ),
        ("hugo_site.asc", [76, 55], 2028, [1660.0, 1711.0]),
        ("mt_everest_90m.tif", [1201, 1201], 130_953, [192.0, 8642.0]),
        ("mt_rainier_90m.tif", [1201, 1201], 9033, [263.0, 4371.0]),
        ("pre_runout_DEM.asc", [80, 122], 122, [189.028, 582.385]),
        (
            "red_butte_slc_utm12_f32.tif",
            [260, 268],
            37948,
            [1580.229, 2520.133],
        ),
        ("west_bijou_gully.asc", [43, 89], 2739, [1680.779, 1725.433]),
    ];
    let by_gdal = by_gdal.into_iter().filter(|_| gdal().is_ok());
    for (name, [columns, rows], holes, [lowest, highest]) in own.into_iter().chain(by_gdal) {
        let raster = open(&folder.join(name));
        let summary = raster.summary();
        assert_eq!([raster.columns(), raster.rows()], [columns, rows], "{name}");
        assert_eq!(summary.no_data, holes, "{name}");
        assert!(
            (summary.lowest - lowest).abs() < 1e-3,
            "{name}: {}",
            summary.lowest
        );
        assert!(
            (summary.highest - highest).abs() < 1e-3,
            "{name}: {}",
            summary.highest
        );
        assert!(
            HapticGrid::new(&raster, HapticCells::Stored)
                .cells_per_vertical_unit()
                .is_some(),
            "{name}: true proportions"
        );
    }
}

/// Mount St. Helens' summit is at 562.2 km east, 5115.4 km north (UTM 10), and the quadrangle's
/// first profile and lowest row are at 557.82 and 5108.01 km.
#[test]
fn real_files_are_oriented_north_up() {
    let Some(folder) = shared("dem/real") else {
        return;
    };
    if gdal().is_err() {
        eprintln!("skipped: there is no libgdal for these files");
        return;
    }
    let helens = open(&folder.join("SainteHelens.dem"));
    let places = (0..helens.rows()).flat_map(|row| (0..helens.columns()).map(move |c| (c, row)));
    let summit = places
        .filter(|&(column, row)| !helens.height(column, row).is_nan())
        .max_by(|a, b| helens.height(a.0, a.1).total_cmp(&helens.height(b.0, b.1)))
        .expect("a summit");
    let place = [
        557.82 + 0.03 * f64::from(summit.0),
        // The lowest row is GDAL's.
        5107.98 + 0.03 * f64::from(summit.1),
    ];
    assert!((place[0] - 562.2).abs() < 0.2, "east {}", place[0]);
    assert!((place[1] - 5115.4).abs() < 0.2, "north {}", place[1]);
    // Kilauea's rows ascend in its file; the sea lies south of the volcano.
    let kilauea = open(&folder.join("Kilauea.utm.nc"));
    assert_eq!(kilauea.height(428, 72), 27.0);
    assert_eq!(kilauea.height(428, 792), 1045.0);
}

/// 64.8 million samples use the bytes of their own type and no more.
#[test]
fn large_file_is_in_memory_once_in_its_own_type() {
    let Some(path) = shared("dem/large/globe_g10g_10800x6000_i16_cog.tif") else {
        return;
    };
    let raster = open(&path);
    assert_eq!((raster.columns(), raster.rows()), (10_800, 6_000));
    assert_eq!(raster.memory_bytes(), 2 * 10_800 * 6_000);
    assert_eq!(raster.summary().highest, 8752.0);
    // Everest is at 27.99° north, 86.93° east; the tile is 0-50° north, 0-90° east.
    let near = (10_420..10_440).flat_map(|column| (3350..3370).map(move |row| (column, row)));
    let highest = near
        .map(|(column, row)| raster.height(column, row))
        .fold(0.0, f64::max);
    assert_eq!(highest, 8752.0);
    let mut row = vec![0.0; 8];
    assert!(
        raster
            .read_row(0, 3358, 10_796, &mut row, Wait::UntilRead)
            .is_complete()
    );
    assert_eq!(row[3], raster.height(10_799, 3358));
    assert!(
        row[4..].iter().all(|height| height.is_nan()),
        "outside is no surface"
    );
}

/// Checks for the same tiles at each level, if coarse levels are subsets of the file's samples.
fn same_tiles(held: &Raster, blocks: &Raster) {
    let scale = Scale::new(1.0, 0.01).expect("a scale");
    for level in 0..3 {
        let [held, blocks] = [held, blocks].map(|raster| Terrain::new(raster, scale, level));
        let (Ok(held), Ok(blocks)) = (held, blocks) else {
            continue;
        };
        let [mut one, mut other] = [TileBuffer::default(), TileBuffer::default()];
        let key = TileKey::new(level, 0, 0);
        let tiles = (held.tile(key, &mut one), blocks.tile(key, &mut other));
        if level == 0 {
            assert_eq!(tiles.0, tiles.1);
        }
        assert!(tiles.0.is_some() && tiles.1.is_some());
        // Some heights are not known yet, so none may be ruled out.
        assert!(blocks.top() > held.top());
    }
}

/// All TIFFs read in blocks are the same as in memory.
#[test]
fn every_tiff_has_the_same_samples_in_blocks_and_at_once() {
    let folders = ["dem/real", "dem/variants", "dem/tiff_ok"];
    let Some(folders) = folders.map(shared).into_iter().collect::<Option<Vec<_>>>() else {
        return;
    };
    let in_blocks = OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    let mut files = 0;
    for folder in folders {
        for entry in std::fs::read_dir(folder).expect("folder") {
            let path = entry.expect("entry").path();
            if path.extension().is_none_or(|extension| extension != "tif") {
                continue;
            }
            let Ok(held) = Raster::open(&path, &OpenOptions::default()) else {
                continue;
            };
            let blocks = Raster::open(&path, &in_blocks).expect("the same file");
            let name = path.display();
            assert!(
                held.samples().is_some() && blocks.samples().is_none(),
                "{name}"
            );
            assert_eq!(held.bounds(), blocks.bounds(), "{name}");
            let mut rows = [(); 2].map(|()| vec![0.0; held.columns() as usize + 3]);
            for row in 0..=held.rows() {
                assert!(
                    held.read_row(0, row, 0, &mut rows[0], Wait::UntilRead)
                        .is_complete()
                );
                assert!(
                    blocks
                        .read_row(0, row, 0, &mut rows[1], Wait::UntilRead)
                        .is_complete()
                );
                let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
                assert!(rows[0].iter().zip(&rows[1]).all(same), "{name}: row {row}");
            }
            same_tiles(&held, &blocks);
            files += 1;
        }
    }
    assert!(files > 20, "{files}");
}

/// An out-of-memory error has its reason and a remedy.
#[test]
fn large_file_read_as_a_whole_has_a_remark_with_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("grid.asc");
    let rows = "1 2 3 4 5 6 7 8\n".repeat(1000);
    let header = "ncols 8\nnrows 1000\nxllcorner 0\nyllcorner 0\ncellsize 1\n";
    std::fs::write(&path, format!("{header}{rows}")).expect("written");
    let remarks = |max_in_memory_bytes| {
        let options = OpenOptions {
            max_in_memory_bytes,
            ..OpenOptions::default()
        };
        let raster = Raster::open(&path, &options).expect("opens");
        raster.remarks().join("; ")
    };
    assert_eq!(remarks(1 << 20), "");
    let text = remarks(1 << 10);
    assert!(
        text.contains("as a whole") && text.contains("-co TILED=YES"),
        "{text}"
    );
}

#[test]
fn files_too_small_for_a_surface_are_refused() {
    let Some(folder) = shared("dem/variants") else {
        return;
    };
    for name in ["odd_1x1.tif", "odd_1xN.tif"] {
        let error = Raster::open(folder.join(name), &OpenOptions::default()).expect_err(name);
        assert!(
            matches!(error.fault(), RasterError::TooSmall { .. }),
            "{error}"
        );
    }
    assert_eq!(open(&folder.join("odd_2x2.tif")).columns(), 2);
}

/// Height fields of the third-party collection open; colours are refused.
#[test]
fn third_party_height_tiffs_are_read_and_colours_refused() {
    let Some(folder) = shared("dem/tiff_ok") else {
        return;
    };
    let files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    let mut opened = 0;
    for path in files {
        match Raster::open(&path, &OpenOptions::default()) {
            Ok(_) => opened += 1,
            Err(error) => assert!(
                matches!(
                    error.fault(),
                    RasterError::NotAHeightField(_)
                        | RasterError::ColourBands { .. }
                        | RasterError::TooSmall { .. }
                        | RasterError::AllNoData { .. }
                ),
                "{error}"
            ),
        }
    }
    assert!(opened >= 20, "only {opened} opened");

    // The same samples with and without Zstandard, and with three predictors.
    let plain = open(&folder.join("int16.tif"));
    assert_eq!(
        plain.samples(),
        open(&folder.join("int16_zstd.tif")).samples()
    );
    let half = open(&folder.join("random-fp16.tiff"));
    for name in ["random-fp16-pred2.tiff", "random-fp16-pred3.tiff"] {
        assert_eq!(half.samples(), open(&folder.join(name)).samples(), "{name}");
    }
    let little = open(&folder.join("seq-1c-16b-tiled-68f373a0.tiff"));
    for variant in ["bigendian", "deflate", "lzw", "multistrip"] {
        let name = format!("seq-1c-16b-{variant}-68f373a0.tiff");
        assert_eq!(
            little.samples(),
            open(&folder.join(&name)).samples(),
            "{name}"
        );
    }
    // Values 0 to 255 in order, north row first.
    assert_eq!(little.height(0, 15), 0.0);
    assert_eq!(little.height(15, 0), 255.0);
}

#[test]
fn colour_picture_needs_a_named_channel() {
    let Some(path) = shared("dem/variants/png_rgba8_depth_in_alpha.png") else {
        return;
    };
    let options = OpenOptions {
        png_channel: Some(PngChannel::Grey),
        ..OpenOptions::default()
    };
    let error = Raster::open(&path, &options).expect_err("there is no grey channel");
    assert!(
        matches!(error.fault(), RasterError::AmbiguousChannels(_)),
        "{error}"
    );
}
