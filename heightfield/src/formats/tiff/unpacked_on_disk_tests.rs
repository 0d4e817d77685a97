//! Compressed strips and tiles, decompressed to disk and read by rows, or as a whole.

use std::io::Write;
use std::sync::Arc;

use flate2::write::ZlibEncoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

use super::super::images;
use super::super::layout::{Layout, NumberKind};
use super::super::test_files::{
    BAND, BANDS, KINDS, Made, ONE_STRIP, Packing, SIZE, check, open, value,
};
use super::super::{open as open_file, uncompressed, unpack};
use super::*;
use crate::blocks::Part;
use crate::input::FileBytes;
use crate::samples::{SampleValue, with_samples};

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("packed");
    encoder.finish().expect("packed")
}

fn lzw(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8);
    encoder.encode(bytes).expect("packed")
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec(bytes, CompressionLevel::Fastest)
}

fn runs(bytes: &[u8]) -> Vec<u8> {
    let runs = bytes.chunks(100);
    let packed = runs.flat_map(|run| [&[run.len() as u8 - 1], run].concat());
    packed.collect()
}

const DEFLATE: Packing = packing(8, deflated, 1);

const fn packing(code: u16, pack: fn(&[u8]) -> Vec<u8>, predictor: u16) -> Packing {
    Packing {
        code,
        pack,
        predictor,
    }
}

/// Returns a layout whose strips or tiles are decompressed into a folder with a max size.
fn layout(made: &Made, bytes: Vec<u8>, max_bytes: u64) -> (tempfile::TempDir, Layout) {
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), max_bytes);
    let input = FileBytes::unpacked("test.tif", bytes);
    let file = Arc::new(open_file(&input).expect("a TIFF"));
    let full = images::full(&file).expect("an image");
    let requested = (made.bands > 1).then_some(BAND);
    let mut layout = Layout::read(&full, NumberKind::Heights(requested)).expect("a layout");
    unpack::into_file(&mut layout, &disk).expect("a file");
    (folder, layout)
}

/// Compares parts all over the image with the written values.
fn check_parts(made: &Made, layout: &Layout) {
    let part = |column, row, columns, rows| Part {
        column,
        row,
        columns,
        rows,
    };
    for part in [
        part(0, SIZE[1] - 3, SIZE[0], 3),
        part(1000, 600, 200, 90),
        part(0, 0, 7, 2),
    ] {
        let samples = uncompressed::read(layout, layout.band, &part).expect("read");
        let band = if made.bands > 1 { BAND - 1 } else { 0 };
        let rows = part.row..part.row + part.rows;
        let places = rows.flat_map(|row| (0..part.columns).map(move |c| [part.column + c, row]));
        let expected: Vec<f64> = places.map(|place| value(place, band) as f64).collect();
        let found: Vec<f64> = with_samples!(&samples, values => {
            values.iter().map(|value| value.widen()).collect()
        });
        assert!(found == expected, "{part:?} {made:?}");
    }
}

#[test]
fn compressions_and_predictors_decode_to_written_samples() {
    let mut all = vec![];
    for (code, pack) in [
        (5, lzw as fn(&[u8]) -> Vec<u8>),
        (32946, deflated),
        (32773, runs),
        (50000, zstd),
    ] {
        let packing = packing(code, pack, 1);
        all.push(Made {
            packing,
            ..ONE_STRIP
        });
    }
    for (index, kind) in KINDS.into_iter().enumerate() {
        for predictor in if kind.format == 3 { 1..=3 } else { 1..=2 } {
            all.push(Made {
                kind,
                is_big_endian: (index + usize::from(predictor)) % 2 == 0,
                packing: packing(8, deflated, predictor),
                ..ONE_STRIP
            });
        }
    }
    for made in all {
        check(&made, &open(&made, 1 << 30).expect("in memory"));
        check_parts(&made, &layout(&made, made.bytes(), 1).1);
    }
}

#[test]
fn strips_and_tiles_of_several_bands_round_trip() {
    for chunk in [SIZE, [SIZE[0], 640], [1024, 640]] {
        for (bands, is_planar, predictor) in [(1, false, 2), (BANDS, false, 3), (BANDS, true, 2)] {
            let made = Made {
                chunk,
                bands,
                is_planar,
                packing: packing(8, deflated, predictor),
                ..ONE_STRIP
            };
            check(&made, &open(&made, 1 << 30).expect("in memory"));
            check_parts(&made, &layout(&made, made.bytes(), 1).1);
        }
    }
}

/// Two adjacent tiles, three times.
const TILES: Made = Made {
    chunk: [1024, 400],
    packing: DEFLATE,
    ..ONE_STRIP
};

#[test]
fn two_tile_rows_stay_unpacked_at_any_limit_and_more_within_it() {
    let tile = 1024 * 400 * 4;
    for (max_bytes, max_tiles) in [(1, 4), (5 * tile, 5), (1 << 30, 6)] {
        let (_folder, layout) = layout(&TILES, TILES.bytes(), max_bytes);
        // Each tile is read twice, alternately.
        check_parts(&TILES, &layout);
        check_parts(&TILES, &layout);
        let unpacked = layout.unpacked.as_ref().expect("unpacked");
        assert_eq!(unpacked.max_bytes(), max_tiles * tile);
        let file = unpacked.unnamed.file.metadata().expect("metadata");
        assert!(file.len() <= max_tiles * tile, "{} {max_bytes}", file.len());
    }
}

/// Otherwise each block of a row of blocks would decompress both of its strips again.
#[test]
fn strips_and_tiles_under_a_row_of_blocks_stay_unpacked() {
    let at_border = Part {
        column: 0,
        row: 300,
        columns: 10,
        rows: 200,
    };
    let strips = Made {
        chunk: [SIZE[0], 400],
        ..TILES
    };
    let planar = Made {
        bands: BANDS,
        is_planar: true,
        ..strips
    };
    for made in [TILES, strips, planar] {
        let (folder, mut layout) = layout(&made, made.bytes(), 1);
        if made.is_planar {
            // Its third band is the transparency.
            layout.alpha = Some(2);
            let disk = DiskCache::at(folder.path(), 1);
            unpack::into_file(&mut layout, &disk).expect("unpacked");
        }
        let bands: Vec<_> = layout.bands_read().collect();
        for column in [0, 1100] {
            for band in &bands {
                let part = Part {
                    column,
                    ..at_border
                };
                uncompressed::read(&layout, *band, &part).expect("read");
            }
        }
        assert!(layout.is_available(&at_border), "{made:?}");
    }
}

/// A read that does not wait never decompresses a tile.
#[test]
fn tile_is_available_once_it_is_unpacked() {
    let made = Made {
        chunk: [1024, 640],
        packing: DEFLATE,
        ..ONE_STRIP
    };
    let (_folder, layout) = layout(&made, made.bytes(), 1 << 30);
    let part = |column| Part {
        column,
        row: 600,
        columns: 10,
        rows: 2,
    };
    let is_available = |column| layout.is_available(&part(column));
    assert!(!is_available(0) && !is_available(1020));
    uncompressed::read(&layout, 0, &part(0)).expect("read");
    assert!(is_available(0) && !is_available(1020) && !is_available(1100));
    uncompressed::read(&layout, 0, &part(1020)).expect("read");
    assert!(is_available(1020) && is_available(1100));
}

#[test]
fn least_recently_read_tile_is_evicted_first() {
    let (_folder, layout) = layout(&TILES, TILES.bytes(), 1);
    let part = |[column, row]: [u32; 2]| Part {
        column,
        row,
        columns: 1,
        rows: 1,
    };
    let tiles = [[0, 0], [1100, 0], [0, 450], [1100, 450], [0, 850]];
    for tile in [0, 1, 2, 3, 0, 4] {
        uncompressed::read(&layout, 0, &part(tiles[tile])).expect("read");
    }
    let available = tiles.map(|tile| layout.is_available(&part(tile)));
    assert_eq!(available, [true, false, true, true, true]);
}

#[test]
fn cut_strip_keeps_its_rows_and_reports_the_missing_ones() {
    fn cut(bytes: &[u8]) -> Vec<u8> {
        let packed = runs(bytes);
        packed[..packed.len() / 2].to_vec()
    }
    let made = Made {
        packing: packing(32773, cut, 1),
        ..ONE_STRIP
    };
    let (_folder, layout) = layout(&made, made.bytes(), 1);
    let row = |row| Part {
        column: 0,
        row,
        columns: SIZE[0],
        rows: 1,
    };
    let read = |at| uncompressed::read(&layout, 0, &row(at));
    assert!(read(500).is_ok());
    let fault = read(600).expect_err("cut").to_string();
    let is_reported = fault.contains("packbits") && fault.contains("from row 551 on");
    assert!(is_reported && fault.contains("ends too early"), "{fault}");
    let fault = open(&made, 1 << 30).expect_err("all of it is read");
    assert!(matches!(fault, RasterError::Damaged(_)), "{fault}");
}

#[test]
fn unpacking_by_rows_refuses_lerc() {
    let made = Made {
        other: Some((259, &[34887])),
        ..ONE_STRIP
    };
    let input = FileBytes::unpacked("test.tif", made.bytes());
    let file = Arc::new(open_file(&input).expect("a TIFF"));
    let full = images::full(&file).expect("an image");
    let mut layout = Layout::read(&full, NumberKind::Heights(None)).expect("a layout");
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), 1);
    let error = unpack::into_file(&mut layout, &disk).expect_err("it is unpacked as a whole");
    assert!(error.to_string().contains("lerc"), "{error}");
}
