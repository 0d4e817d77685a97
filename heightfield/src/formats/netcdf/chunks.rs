//! A variable of a NetCDF-4 file that stays in its file: chunks are read when they are touched.

use std::hash::Hasher;

use hdf5_reader::{Dataset, H5Type, SliceInfo, SliceInfoElem};
use twox_hash::XxHash64;

use super::access::{Access, CHUNK_CACHE_BYTES};
use super::{fault, of_the_other_sign};
use crate::blocks::{
    Block, BlockImage, BlockReader, LARGEST_BLOCK_BYTES, Looks, Part, USUAL_BLOCK, usual_block,
};
use crate::guard::guarded;
use crate::remote::RemoteFile;
use crate::samples::{HoleMask, with_samples};
use crate::unread::Unread;
use crate::{BadRaster, SampleType, Samples, thinned};

/// Blocks of coarse images, whose samples are of many chunks.
const COARSE_BLOCK: u32 = 32;
/// Samples of a block of a file that is elsewhere and has no chunks: what lies together comes
/// together.
const WIDE_BLOCK: [u32; 2] = [32_768, 2];
/// When the file is opened so many places each way are looked at, and more only where the first
/// of them have no heights.
const PLACES: u32 = 16;

/// How a variable's samples are stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Columns and rows as the raster has them.
    pub(super) size: [u32; 2],
    /// The type of a sample in the file.
    pub(super) stored: SampleType,
    /// Whether an attribute says that these integers have the other sign.
    pub(super) other_sign: bool,
    /// The variable is stored column by column.
    pub(super) x_first: bool,
}

impl Layout {
    /// The type in which samples are held.
    pub(super) fn held(&self) -> SampleType {
        match self.other_sign {
            true => of_the_other_sign(self.stored.none()).sample_type(),
            false => self.stored,
        }
    }
}

/// The chunks of a variable.
pub(super) struct Chunks {
    access: Access,
    dataset: Dataset,
    layout: Layout,
    /// Columns and rows of a chunk, or of what is read at once where there are no chunks.
    chunk: [u32; 2],
    images: Vec<BlockImage>,
    is_remote: bool,
    unread: Unread,
}

/// Samples along rows or columns that are of one chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Piece {
    /// The first of them in what is read.
    at: usize,
    count: usize,
    /// The same in the file.
    first: u64,
    /// The chunk.
    chunk: u64,
}

impl Chunks {
    /// The variable of a file; `None` where its chunks are too large to be read one by one.
    pub(super) fn new(
        access: Access,
        dataset: Dataset,
        layout: Layout,
        (name, is_remote): (&str, bool),
    ) -> Option<Self> {
        let chunks = dataset.chunks();
        let chunk = match &chunks {
            Some(sides) => {
                let mut samples = sides.iter().map(|side| u64::from(*side));
                let samples = samples.try_fold(1_u64, u64::checked_mul)?;
                // Any sample may come to be held in eight bytes.
                if samples == 0 || samples.checked_mul(8)? > LARGEST_BLOCK_BYTES {
                    return None;
                }
                let [second, first] = *sides.last_chunk::<2>()?;
                let sides = if layout.x_first {
                    [second, first]
                } else {
                    [first, second]
                };
                [0, 1].map(|axis| sides[axis].min(layout.size[axis]))
            }
            None => match (is_remote, layout.x_first) {
                (false, _) => [USUAL_BLOCK; 2],
                (true, false) => WIDE_BLOCK,
                (true, true) => [WIDE_BLOCK[1], WIDE_BLOCK[0]],
            },
        };
        let full = usual_block(chunk);
        let block = |k: u32| match k {
            0 => full,
            k => full.map(|side| side.div_ceil(1 << k).max(COARSE_BLOCK)),
        };
        Some(Self {
            images: thinned::images(layout.size, block),
            access,
            dataset,
            layout,
            chunk,
            is_remote,
            unread: Unread::of(name),
        })
    }

    /// Looks at what would be wrong with all chunks: how they are packed, and that a file
    /// without chunks goes on to its last sample.
    ///
    /// # Errors
    /// That it is.
    pub(super) fn check(&self) -> Result<(), BadRaster> {
        let has_chunks = self.dataset.chunks().is_some();
        let [columns, rows] = self.layout.size;
        let places = match has_chunks {
            true => vec![[0, 0], [columns / 2, rows / 2]],
            false => vec![[columns - 1, rows - 1]],
        };
        for place in places {
            let pieces = [0, 1].map(|axis| Piece {
                at: 0,
                count: 1,
                first: place[axis].into(),
                chunk: 0,
            });
            let read = with_samples!(self.layout.stored.none(), none => {
                self.piece(&none, &pieces, 1).map(|_| ())
            });
            match read {
                Err(fault @ BadRaster::Unsupported { .. }) => return Err(fault),
                Err(fault) if fault.is_of_the_line() || !has_chunks => return Err(fault),
                // One chunk is one chunk.
                _ => {}
            }
        }
        Ok(())
    }

    /// The samples of one chunk, every so many-th, in the file's order.
    fn piece<T: H5Type>(
        &self,
        _none: &[T],
        [along, down]: &[Piece; 2],
        every: u64,
    ) -> Result<Vec<T>, BadRaster> {
        let slice = |piece: &Piece| SliceInfoElem::Slice {
            start: piece.first,
            end: piece.first + (piece.count as u64 - 1) * every + 1,
            step: every,
        };
        let leading = self.dataset.ndim().saturating_sub(2);
        let mut selections = vec![SliceInfoElem::Index(0); leading];
        selections.extend(match self.layout.x_first {
            true => [slice(along), slice(down)],
            false => [slice(down), slice(along)],
        });
        let selection = SliceInfo { selections };
        let read = guarded(super::FORMAT.name, || {
            let read = self.dataset.read_slice::<T>(&selection);
            read.map_err(|error| fault(&error.into()))
        });
        // Whatever the decoder makes of what has not come.
        self.access.check_came()?;
        let (values, first) = read?.into_raw_vec_and_offset();
        match first {
            None | Some(0) if values.len() == along.count * down.count => Ok(values),
            _ => Err(BadRaster::damaged("a chunk has another number of samples")),
        }
    }

    /// The samples of a part of an image, and those of chunks that cannot be read.
    fn all<T: H5Type + Copy + Default>(
        &self,
        none: &[T],
        image: &BlockImage,
        part: &Part,
    ) -> Result<(Vec<T>, Option<HoleMask>), BadRaster> {
        let every = image.every.unwrap_or(1);
        let pieces = |from: u32, count: u32, axis: usize| {
            pieces(
                from..from + count,
                image.first[axis],
                every,
                self.chunk[axis],
            )
        };
        let along = pieces(part.column, part.columns, 0);
        let down = pieces(part.row, part.rows, 1);
        let columns = part.columns as usize;
        let mut values = vec![T::default(); columns * part.rows as usize];
        let mut holes = None;
        for down in &down {
            for along in &along {
                let covers = self.covers([along.chunk, down.chunk]);
                let read = match self.unread.has(0, [covers.column, covers.row]) {
                    true => None,
                    false => match self.piece(none, &[*along, *down], every.into()) {
                        Ok(read) => Some(read),
                        Err(fault) if fault.is_of_the_line() => return Err(fault),
                        Err(fault) => {
                            self.unread.warn(0, &covers, &fault);
                            None
                        }
                    },
                };
                let places = (0..down.count)
                    .flat_map(|row| (0..along.count).map(move |column| (column, row)));
                for (column, row) in places {
                    let to = (down.at + row) * columns + along.at + column;
                    let from = match self.layout.x_first {
                        true => column * down.count + row,
                        false => row * along.count + column,
                    };
                    match &read {
                        Some(read) => values[to] = read[from],
                        None => {
                            let room = || HoleMask::with_capacity(columns * part.rows as usize);
                            holes.get_or_insert_with(room).insert(to);
                        }
                    }
                }
            }
        }
        Ok((values, holes))
    }

    /// The samples of a chunk in the full image.
    fn covers(&self, chunk: [u64; 2]) -> Part {
        let [columns, rows] = [0, 1].map(|axis| {
            let side = u64::from(self.chunk[axis]);
            let count = u64::from(self.layout.size[axis]);
            // Both fit: they are inside of the image.
            let first = chunk[axis] * side;
            (first as u32, side.min(count - first) as u32)
        });
        Part {
            column: columns.0,
            row: rows.0,
            columns: columns.1,
            rows: rows.1,
        }
    }
}

/// The samples of a range, each so many of the file apart, by chunks of so many of the file.
fn pieces(range: std::ops::Range<u32>, first: u32, every: u32, chunk: u32) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for (at, index) in range.enumerate() {
        let place = u64::from(index) * u64::from(every) + u64::from(first);
        let chunk = place / u64::from(chunk.max(1));
        match pieces.last_mut().filter(|piece| piece.chunk == chunk) {
            Some(piece) => piece.count += 1,
            None => pieces.push(Piece {
                at,
                count: 1,
                first: place,
                chunk,
            }),
        }
    }
    pieces
}

impl BlockReader for Chunks {
    fn format(&self) -> &'static str {
        super::FORMAT.name
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        self.layout.held()
    }

    fn is_stored(&self, _: usize, _: &Part) -> bool {
        // A chunk that is left out has the variable's fill value.
        true
    }

    fn set_order(&mut self, south_up: bool, east_first: bool) {
        thinned::set_order(&mut self.images, south_up, east_first);
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, BadRaster> {
        let image = &self.images[image];
        let (samples, holes): (Samples, _) = with_samples!(self.layout.stored.none(), none => {
            let (values, holes) = self.all(&none, image, part)?;
            (values.into(), holes)
        });
        Ok(Block {
            samples: match self.layout.other_sign {
                true => of_the_other_sign(samples),
                false => samples,
            },
            // No chunk that can be read has a hole that no value marks.
            is_lacking: holes.is_some(),
            holes,
        })
    }

    fn index(&self) -> u64 {
        let mut hasher = XxHash64::with_seed(0);
        hasher.write_u64(self.dataset.address());
        for side in self.layout.size.into_iter().chain(self.chunk) {
            hasher.write_u32(side);
        }
        hasher.finish()
    }

    fn looks(&self) -> Option<Looks> {
        Some(thinned::places(&self.images[0], PLACES))
    }

    fn kept_bytes(&self) -> usize {
        let pages = match self.is_remote {
            true => RemoteFile::kept_bytes(),
            false => 0,
        };
        CHUNK_CACHE_BYTES + pages
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_lie_apart_are_read_by_chunks() {
        let of = |range, first, every| {
            let pieces = pieces(range, first, every, 16);
            let each = pieces.iter();
            each.map(|piece| (piece.at, piece.count, piece.first, piece.chunk))
                .collect::<Vec<_>>()
        };
        assert_eq!(
            of(14..35, 0, 1),
            [(0, 2, 14, 0), (2, 16, 16, 1), (18, 3, 32, 2)]
        );
        // 13, 21, 29, 37: those of one chunk, and the ones of the next.
        assert_eq!(
            of(1..5, 5, 8),
            [(0, 1, 13, 0), (1, 2, 21, 1), (3, 1, 37, 2)]
        );
        // Chunks between are not read.
        assert_eq!(
            of(0..3, 0, 64),
            [(0, 1, 0, 0), (1, 1, 64, 4), (2, 1, 128, 8)]
        );
        assert_eq!(of(3..3, 0, 1), []);
    }
}
