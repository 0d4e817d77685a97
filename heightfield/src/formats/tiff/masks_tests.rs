//! Masks of few bits per sample, in strips and tiles, by each reader.

use std::io::Write;

use super::super::open;
use super::super::test_files::{KINDS, Made, ONE_STRIP, PLAIN, Packing, SIZE};
use super::*;
use crate::input::FileBytes;

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let fast = flate2::Compression::fast();
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), fast);
    encoder.write_all(bytes).expect("packed");
    encoder.finish().expect("packed")
}

const DEFLATE: Packing = Packing {
    code: 8,
    pack: deflated,
    predictor: 1,
};

/// Returns the no-data samples of a part. The bytes are those of a file with one byte per sample; a
/// mask of fewer bits uses the first ones.
fn expected(made: &Made, bits: usize, part: &Part) -> Vec<usize> {
    let chunks = Made {
        packing: PLAIN,
        ..*made
    }
    .chunks();
    let [width, height] = made.chunk.map(|side| side as usize);
    let (across, row_bytes) = (
        SIZE[0].div_ceil(made.chunk[0]) as usize,
        (width * bits).div_ceil(8),
    );
    let has_data = |column: usize, row: usize| {
        let chunk = &chunks[row / height * across + column / width];
        let bit = column % width * bits;
        let byte = chunk[row % height * row_bytes + bit / 8];
        (byte << (bit % 8)) >> (8 - bits) != 0
    };
    let (columns, count) = (
        part.columns as usize,
        part.columns as usize * part.rows as usize,
    );
    let place = |index: usize| {
        let (column, row) = (part.column as usize, part.row as usize);
        (column + index % columns, row + index / columns)
    };
    let missing = (0..count).filter(|index| {
        let (column, row) = place(*index);
        !has_data(column, row)
    });
    missing.collect()
}

fn mask(made: &Made) -> Mask {
    let input = FileBytes::unpacked("test.msk", made.bytes());
    let file = Arc::new(open(&input).expect("a TIFF"));
    let directory = images::full(&file).expect("an image");
    Mask {
        layout: Some(Layout::of_mask(&directory).expect("a mask")),
        directory,
    }
}

fn found(mask: &Mask, part: &Part) -> Vec<usize> {
    let mut found = vec![];
    let read = mask.missing(part, |index| found.push(index));
    read.expect("read");
    found.sort_unstable();
    found
}

#[test]
fn mask_of_any_bit_depth_is_equal_in_every_read_path() {
    const BITS: [&[u32]; 4] = [&[1], &[2], &[4], &[8]];
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), 1 << 30);
    let whole = Part::whole(SIZE[0], SIZE[1]);
    let inner = Part {
        column: 1005,
        row: 630,
        columns: 101,
        rows: 33,
    };
    for bits in BITS {
        for chunk in [SIZE, [1024, 640]] {
            let made = Made {
                kind: KINDS[0],
                chunk,
                other: Some((258, bits)),
                ..ONE_STRIP
            };
            let bits = bits[0] as usize;
            // The whole mask only once, because the expected result is slow to compute.
            for part in [whole, inner].into_iter().skip(usize::from(bits > 1)) {
                let expected = expected(&made, bits, &part);
                let all = part.columns as usize * part.rows as usize;
                assert!(!expected.is_empty() && expected.len() < all, "{bits}");
                // Read by the decoder.
                assert!(found(&mask(&made), &part) == expected, "{bits} {chunk:?}");
                let mut plain = mask(&made);
                plain.layout.as_mut().expect("laid out").is_plain = true;
                assert!(found(&plain, &part) == expected, "{bits} {chunk:?}");
                let packed = Made {
                    packing: DEFLATE,
                    ..made
                };
                let mut packed = mask(&packed);
                // The decoder rejects more bytes than samples.
                if bits == 8 {
                    assert!(found(&packed, &part) == expected, "{bits} {chunk:?}");
                }
                let layout = packed.layout.as_mut().expect("laid out");
                unpack::into_file(layout, &disk).expect("a file");
                assert!(found(&packed, &part) == expected, "{bits} {chunk:?}");
            }
        }
    }
}

#[test]
fn whole_mask_in_strips_is_read_in_row_order() {
    for chunk in [SIZE, [SIZE[0], 500]] {
        let made = Made {
            kind: KINDS[0],
            chunk,
            other: Some((258, &[1])),
            packing: DEFLATE,
            ..ONE_STRIP
        };
        let all = Part::whole(SIZE[0], SIZE[1]);
        let mask = mask(&made);
        let layout = mask.layout.as_ref().expect("laid out");
        let mut found = vec![];
        whole(layout, &all, |index| found.push(index)).expect("read");
        assert!(found == expected(&made, 1, &all), "{chunk:?}");
    }
}
