//! Large strips and tiles without compression, in all types, orders and arrangements.

use half::f16;

use super::super::decode;
use crate::raster::input::FileBytes;
use crate::raster::{BadRaster, OpenOptions, Raster};

const SIZE: [u32; 2] = [1201, 1103];
/// Bands of images that have several, and the one that is asked for, the first being 1.
const BANDS: u32 = 3;
const BAND: u32 = 2;

/// A sample that every type can hold.
fn value([column, row]: [u32; 2], band: u32) -> i64 {
    i64::from((column * 7 + row * 13 + band * 29) % 101)
}

/// How a type of samples is written.
#[derive(Clone, Copy, Debug)]
struct Kind {
    bits: u16,
    format: u16,
    bytes: fn(i64) -> Vec<u8>,
}

/// Types with their bytes, the least significant first.
const KINDS: [Kind; 11] = [
    kind(8, 1, |value| (value as u8).to_le_bytes().into()),
    kind(8, 2, |value| (value as i8).to_le_bytes().into()),
    kind(16, 1, |value| (value as u16).to_le_bytes().into()),
    kind(16, 2, |value| (value as i16).to_le_bytes().into()),
    kind(16, 3, |value| {
        f16::from_f32(value as f32).to_le_bytes().into()
    }),
    kind(32, 1, |value| (value as u32).to_le_bytes().into()),
    kind(32, 2, |value| (value as i32).to_le_bytes().into()),
    kind(32, 3, |value| (value as f32).to_le_bytes().into()),
    kind(64, 1, |value| (value as u64).to_le_bytes().into()),
    kind(64, 2, |value| value.to_le_bytes().into()),
    kind(64, 3, |value| (value as f64).to_le_bytes().into()),
];
const FLOAT: Kind = KINDS[7];

const fn kind(bits: u16, format: u16, bytes: fn(i64) -> Vec<u8>) -> Kind {
    Kind {
        bits,
        format,
        bytes,
    }
}

/// How a file is laid out.
#[derive(Clone, Copy, Debug)]
struct Made {
    kind: Kind,
    is_big_endian: bool,
    /// Columns and rows of a strip or tile.
    chunk: [u32; 2],
    bands: u32,
    /// Each band has its own chunks.
    is_planar: bool,
    /// Other values of a tag.
    other: Option<(u16, &'static [u32])>,
    /// A chunk that a sparse file leaves out.
    left_out: Option<usize>,
}

const ONE_STRIP: Made = Made {
    kind: FLOAT,
    is_big_endian: false,
    chunk: SIZE,
    bands: 1,
    is_planar: false,
    other: None,
    left_out: None,
};

impl Made {
    fn number(&self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        if self.is_big_endian {
            bytes.reverse();
        }
        bytes
    }

    /// The chunks of all bands, one after the other.
    fn chunks(&self) -> Vec<Vec<u8>> {
        let is_tiled = self.chunk[0] != SIZE[0];
        let planes = if self.is_planar { self.bands } else { 1 };
        let mut chunks = vec![];
        for plane in 0..planes {
            for first_row in (0..SIZE[1]).step_by(self.chunk[1] as usize) {
                for first_column in (0..SIZE[0]).step_by(self.chunk[0] as usize) {
                    let end = match is_tiled {
                        true => first_row + self.chunk[1],
                        false => (first_row + self.chunk[1]).min(SIZE[1]),
                    };
                    let rows = first_row..end;
                    let places = rows.flat_map(|row| {
                        (first_column..first_column + self.chunk[0])
                            .map(move |column| [column, row])
                    });
                    let bands = if self.is_planar {
                        plane..plane + 1
                    } else {
                        0..self.bands
                    };
                    let samples =
                        places.flat_map(|place| bands.clone().map(move |band| value(place, band)));
                    chunks.push(
                        samples
                            .flat_map(|v| self.number(&(self.kind.bytes)(v)))
                            .collect(),
                    );
                }
            }
        }
        chunks
    }

    fn bytes(&self) -> Vec<u8> {
        let chunks = self.chunks();
        let mut places = vec![];
        let mut data = vec![0; 8];
        for (number, chunk) in chunks.iter().enumerate() {
            let is_there = self.left_out != Some(number);
            places.push(if is_there { data.len() as u32 } else { 0 });
            if is_there {
                data.extend(chunk);
            }
        }
        let sizes: Vec<u32> = chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let mut tags: Vec<(u16, Vec<u32>)> = vec![
            (256, vec![SIZE[0]]),
            (257, vec![SIZE[1]]),
            (258, vec![self.kind.bits.into(); self.bands as usize]),
            (259, vec![1]),
            (262, vec![1]),
            (277, vec![self.bands]),
            (284, vec![if self.is_planar { 2 } else { 1 }]),
            (339, vec![self.kind.format.into(); self.bands as usize]),
        ];
        tags.extend(match self.chunk[0] == SIZE[0] {
            true => vec![(273, places), (278, vec![self.chunk[1]]), (279, sizes)],
            false => vec![
                (322, vec![self.chunk[0]]),
                (323, vec![self.chunk[1]]),
                (324, places),
                (325, sizes),
            ],
        });
        if let Some((tag, values)) = self.other {
            tags.retain(|(own, _)| *own != tag);
            tags.push((tag, values.to_vec()));
        }
        tags.sort_by_key(|(tag, _)| *tag);
        self.with_directory(data, &tags)
    }

    fn with_directory(&self, mut data: Vec<u8>, tags: &[(u16, Vec<u32>)]) -> Vec<u8> {
        let [short, long] = [
            |made: &Self, value: u32| made.number(&(value as u16).to_le_bytes()),
            |made: &Self, value: u32| made.number(&value.to_le_bytes()),
        ];
        let head: &[u8] = if self.is_big_endian { b"MM" } else { b"II" };
        let at = data.len() as u32;
        data[..8].copy_from_slice(&[head, &short(self, 42), &long(self, at)].concat());
        data.extend(short(self, tags.len() as u32));
        let mut beyond = at + 2 + 12 * tags.len() as u32 + 4;
        let mut far = vec![];
        for (tag, values) in tags {
            let bytes: Vec<u8> = values.iter().flat_map(|value| long(self, *value)).collect();
            data.extend(short(self, (*tag).into()));
            data.extend(short(self, 4));
            data.extend(long(self, values.len() as u32));
            if bytes.len() <= 4 {
                data.extend(bytes);
            } else {
                data.extend(long(self, beyond));
                beyond += bytes.len() as u32;
                far.extend(bytes);
            }
        }
        data.extend([0; 4]);
        data.extend(far);
        data
    }
}

fn open(made: &Made, most_in_memory_bytes: u64) -> Result<Raster, BadRaster> {
    let options = OpenOptions {
        band: (made.bands > 1).then_some(BAND),
        most_in_memory_bytes,
        ..OpenOptions::default()
    };
    let input = FileBytes::unpacked("test.tif", made.bytes());
    Raster::checked(decode(&input, &options)?, None)
}

/// Holds samples all over the image, and all of some rows, against what was written.
fn check(made: &Made, raster: &Raster) {
    let band = if made.bands > 1 { BAND - 1 } else { 0 };
    let rows = [0, 1, 639, 640, 641, SIZE[1] - 1];
    let all_along = rows
        .iter()
        .flat_map(|row| (0..SIZE[0]).map(|column| [column, *row]));
    let scattered = (0..4000_u32).map(|n| [n * 7919 % SIZE[0], n * 6151 % SIZE[1]]);
    for place in all_along.chain(scattered) {
        let found = raster.height(place[0], SIZE[1] - 1 - place[1]);
        assert_eq!(found, value(place, band) as f64, "{place:?} {made:?}");
    }
}

#[test]
fn all_types_of_either_order_are_what_was_written() {
    for kind in KINDS {
        for is_big_endian in [false, true] {
            let made = Made {
                kind,
                is_big_endian,
                ..ONE_STRIP
            };
            for most_in_memory_bytes in [0, 1 << 30] {
                check(&made, &open(&made, most_in_memory_bytes).expect("a field"));
            }
        }
    }
}

#[test]
fn strips_and_tiles_of_several_bands_are_what_was_written() {
    for chunk in [SIZE, [SIZE[0], 640], [1024, 640], [2048, 2048]] {
        for (bands, is_planar) in [(1, false), (BANDS, false), (BANDS, true)] {
            let made = Made {
                chunk,
                bands,
                is_planar,
                ..ONE_STRIP
            };
            for most_in_memory_bytes in [0, 1 << 30] {
                check(&made, &open(&made, most_in_memory_bytes).expect("a field"));
            }
        }
    }
}

#[test]
fn a_tile_that_is_left_out_is_a_hole_and_no_other_is() {
    let made = Made {
        chunk: [1024, 640],
        left_out: Some(1),
        ..ONE_STRIP
    };
    for most_in_memory_bytes in [0, 1 << 30] {
        let raster = open(&made, most_in_memory_bytes).expect("sparse");
        let height = |[column, row]: [u32; 2]| raster.height(column, SIZE[1] - 1 - row);
        for place in [[0, 0], [1023, 639], [1024, 640], [1200, 1102]] {
            assert_eq!(height(place), value(place, 0) as f64);
        }
        assert!(height([1024, 0]).is_nan() && height([1200, 639]).is_nan());
    }
}

#[test]
fn rows_that_a_strip_does_not_have_are_holes_and_the_others_are_felt() {
    const ROW: u32 = 4 * SIZE[0];
    // The first strip ends 140 rows early, and the second is said to have as many more.
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
    assert!(matches!(fault, BadRaster::AbsurdSize(_)), "{fault}");
}

#[test]
fn bits_in_another_order_and_differences_are_left_to_the_decoder() {
    // Of either the decoder knows what to do, or says that it does not.
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

/// Decoded, they are refused; read as they lie, they were heights of other bands.
#[test]
fn bands_of_several_types_and_orders_that_nobody_knows_are_refused() {
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
        let is_told = matches!(&fault, BadRaster::Unsupported { .. });
        assert!(is_told && fault.to_string().contains(why), "{fault}");
    }
}

#[test]
fn a_strip_behind_the_end_is_told_before_anything_is_read() {
    let made = Made {
        other: Some((273, &[u32::MAX - 7])),
        ..ONE_STRIP
    };
    let fault = open(&made, 0).expect_err("nothing is there");
    assert!(matches!(fault, BadRaster::Truncated(_)), "{fault}");
}
