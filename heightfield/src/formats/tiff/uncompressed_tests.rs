//! Large strips and tiles without compression, in all types, orders and arrangements.

use super::super::test_files::{BANDS, KINDS, Made, ONE_STRIP, SIZE, check, open, value};
use crate::RasterError;

#[test]
fn sample_types_decode_in_both_byte_orders() {
    for kind in KINDS {
        for is_big_endian in [false, true] {
            let made = Made {
                kind,
                is_big_endian,
                ..ONE_STRIP
            };
            for max_in_memory_bytes in [0, 1 << 30] {
                check(&made, &open(&made, max_in_memory_bytes).expect("a field"));
            }
        }
    }
}

#[test]
fn strips_and_tiles_of_several_bands_round_trip() {
    for chunk in [SIZE, [SIZE[0], 640], [1024, 640], [2048, 2048]] {
        for (bands, is_planar) in [(1, false), (BANDS, false), (BANDS, true)] {
            let made = Made {
                chunk,
                bands,
                is_planar,
                ..ONE_STRIP
            };
            for max_in_memory_bytes in [0, 1 << 30] {
                check(&made, &open(&made, max_in_memory_bytes).expect("a field"));
            }
        }
    }
}

#[test]
fn only_the_omitted_tile_is_no_data() {
    let made = Made {
        chunk: [1024, 640],
        omitted: Some(1),
        ..ONE_STRIP
    };
    for max_in_memory_bytes in [0, 1 << 30] {
        let raster = open(&made, max_in_memory_bytes).expect("sparse");
        let height = |[column, row]: [u32; 2]| raster.height(column, SIZE[1] - 1 - row);
        for place in [[0, 0], [1023, 639], [1024, 640], [1200, 1102]] {
            assert_eq!(height(place), value(place, 0) as f64);
        }
        assert!(height([1024, 0]).is_nan() && height([1200, 639]).is_nan());
    }
}

#[test]
fn missing_strip_rows_are_no_data_and_the_others_are_read() {
    const ROW: u32 = 4 * SIZE[0];
    // The first strip ends 140 rows early, and the second states the missing rows.
    let made = Made {
        chunk: [SIZE[0], 640],
        other: Some((279, &[500 * ROW, (SIZE[1] - 500) * ROW])),
        ..ONE_STRIP
    };
    let raster = open(&made, 0).expect("most of it is there");
    let height = |row| raster.height(7, SIZE[1] - 1 - row);
    for row in (0..500).chain(640..SIZE[1]) {
        assert_eq!(height(row), value([7, row], 0) as f64, "{row}");
    }
    assert!((500..640).all(|row| height(row).is_nan()));
    let made = Made {
        other: Some((279, &[900 * ROW])),
        ..ONE_STRIP
    };
    let fault = open(&made, 0).expect_err("fewer bytes than samples");
    assert!(matches!(fault, RasterError::AbsurdSize(_)), "{fault}");
}

#[test]
fn fill_order_and_predictor_are_left_to_the_decoder() {
    // The decoder reads each, or reports an error.
    let turned = Made {
        kind: KINDS[0],
        other: Some((266, &[2])),
        ..ONE_STRIP
    };
    let raster = open(&turned, 0).expect("a field");
    let expected = (value([5, 9], 0) as u8).reverse_bits();
    assert_eq!(raster.height(5, SIZE[1] - 10), f64::from(expected));
    let differences = Made {
        kind: KINDS[2],
        other: Some((317, &[2])),
        ..ONE_STRIP
    };
    let raster = open(&differences, 0).expect("a field");
    let sum: i64 = (0..=3).map(|column| value([column, 4], 0)).sum();
    assert_eq!(raster.height(3, SIZE[1] - 5), sum as f64);
}

/// The decoder rejects these; read by rows, they would be the heights of other bands.
#[test]
fn mixed_band_types_and_unknown_planar_config_are_refused() {
    for (tag, values, why) in [
        (258, &[32, 16, 32][..], "mixed BitsPerSample"),
        (339, &[3, 1, 3][..], "mixed SampleFormat"),
        (284, &[3][..], "planar configuration"),
    ] {
        let made = Made {
            bands: BANDS,
            other: Some((tag, values)),
            ..ONE_STRIP
        };
        let fault = open(&made, 0).expect_err(why);
        let is_reported = matches!(&fault, RasterError::Unsupported { .. });
        assert!(is_reported && fault.to_string().contains(why), "{fault}");
    }
}

#[test]
fn strip_offset_beyond_the_file_end_is_refused_on_open() {
    let made = Made {
        other: Some((273, &[u32::MAX - 7])),
        ..ONE_STRIP
    };
    let fault = open(&made, 0).expect_err("nothing is there");
    assert!(matches!(fault, RasterError::Truncated(_)), "{fault}");
}
