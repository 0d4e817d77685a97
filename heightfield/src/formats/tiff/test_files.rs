//! TIFF files for tests: all types, orders and arrangements of samples.

use half::f16;

use super::decode;
use crate::input::FileBytes;
use crate::{OpenOptions, Raster, RasterError};

pub(super) const SIZE: [u32; 2] = [1201, 1103];
/// Number of bands, and the requested band, the first being 1.
pub(super) const BANDS: u32 = 3;
pub(super) const BAND: u32 = 2;

/// Returns a sample that every type can store.
pub(super) fn value([column, row]: [u32; 2], band: u32) -> i64 {
    i64::from((column * 7 + row * 13 + band * 29) % 101)
}

/// A sample type and its writer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    pub(super) bits: u16,
    pub(super) format: u16,
    pub(super) bytes: fn(i64) -> Vec<u8>,
}

/// All types, with the least significant byte first.
pub(super) const KINDS: [Kind; 11] = [
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
pub(super) const FLOAT: Kind = KINDS[7];

const fn kind(bits: u16, format: u16, bytes: fn(i64) -> Vec<u8>) -> Kind {
    Kind {
        bits,
        format,
        bytes,
    }
}

/// Layout of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Made {
    pub(super) kind: Kind,
    pub(super) is_big_endian: bool,
    /// Columns and rows of a strip or tile.
    pub(super) chunk: [u32; 2],
    pub(super) bands: u32,
    /// True if each band has its own chunks.
    pub(super) is_planar: bool,
    /// A tag with other values.
    pub(super) other: Option<(u16, &'static [u32])>,
    /// A chunk to leave out, as in a sparse file.
    pub(super) omitted: Option<usize>,
    pub(super) packing: Packing,
}

/// Compression of samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packing {
    pub(super) code: u16,
    pub(super) pack: fn(&[u8]) -> Vec<u8>,
    pub(super) predictor: u16,
}

/// No compression.
pub(super) const PLAIN: Packing = Packing {
    code: 1,
    pack: <[u8]>::to_vec,
    predictor: 1,
};

pub(super) const ONE_STRIP: Made = Made {
    kind: FLOAT,
    is_big_endian: false,
    chunk: SIZE,
    bands: 1,
    is_planar: false,
    other: None,
    omitted: None,
    packing: PLAIN,
};

impl Made {
    fn number(&self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        if self.is_big_endian {
            bytes.reverse();
        }
        bytes
    }

    /// Returns a row of samples before compression, the least significant byte first.
    fn row(&self, samples: &[Vec<u8>], bands: usize) -> Vec<u8> {
        let value = |bytes: &Vec<u8>| {
            let mut eight = [0; 8];
            eight[..bytes.len()].copy_from_slice(bytes);
            u64::from_le_bytes(eight)
        };
        let size = samples[0].len();
        match self.packing.predictor {
            1 => samples
                .iter()
                .flat_map(|bytes| self.number(bytes))
                .collect(),
            2 => {
                let before =
                    |index: usize| index.checked_sub(bands).map_or(0, |at| value(&samples[at]));
                let differences = (0..samples.len())
                    .map(|index| value(&samples[index]).wrapping_sub(before(index)));
                differences
                    .flat_map(|all| self.number(&all.to_le_bytes()[..size]))
                    .collect()
            }
            _ => {
                let planes = (0..size).rev();
                let planes = planes.flat_map(|byte| samples.iter().map(move |bytes| bytes[byte]));
                let planes: Vec<u8> = planes.collect();
                let before = |index: usize| index.checked_sub(bands).map_or(0, |at| planes[at]);
                let all = (0..planes.len()).map(|index| planes[index].wrapping_sub(before(index)));
                all.collect()
            }
        }
    }

    /// Returns the chunks of all bands, in order.
    pub(super) fn chunks(&self) -> Vec<Vec<u8>> {
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
                    let samples: Vec<_> = samples.map(|v| (self.kind.bytes)(v)).collect();
                    let row = self.chunk[0] as usize * bands.len();
                    let rows = samples.chunks(row);
                    let rows: Vec<u8> = rows.flat_map(|row| self.row(row, bands.len())).collect();
                    chunks.push((self.packing.pack)(&rows));
                }
            }
        }
        chunks
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let chunks = self.chunks();
        let mut places = vec![];
        let mut data = vec![0; 8];
        for (number, chunk) in chunks.iter().enumerate() {
            let is_there = self.omitted != Some(number);
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
            (259, vec![self.packing.code.into()]),
            (262, vec![1]),
            (277, vec![self.bands]),
            (284, vec![if self.is_planar { 2 } else { 1 }]),
            (317, vec![self.packing.predictor.into()]),
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
        let mut out_of_line = vec![];
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
                out_of_line.extend(bytes);
            }
        }
        data.extend([0; 4]);
        data.extend(out_of_line);
        data
    }
}

pub(super) fn open(made: &Made, max_in_memory_bytes: u64) -> Result<Raster, RasterError> {
    let options = OpenOptions {
        band: (made.bands > 1).then_some(BAND),
        max_in_memory_bytes,
        ..OpenOptions::default()
    };
    let input = FileBytes::unpacked("test.tif", made.bytes());
    Raster::checked(decode(&input, &options)?, None)
}

/// Compares samples all over the image, and all of some rows, with the written ones.
pub(super) fn check(made: &Made, raster: &Raster) {
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
