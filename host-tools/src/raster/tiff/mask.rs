//! The mask that GDAL keeps beside an image: one bit a sample, 0 for no data.

use std::io::{self, Read, Seek, SeekFrom};

use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

use super::{MASK, REDUCED, directory, fault};
use crate::raster::Fault;
use crate::raster::decoded::Decoded;
use crate::raster::input::Input;
use crate::raster::samples::HoleMask;

const PHOTOMETRIC: u64 = 262;

/// Marks the samples that the file's own mask calls no data, where it has one.
pub(super) fn apply(input: &Input, directories: usize, decoded: &mut Decoded) -> Result<(), Fault> {
    let Some(index) = find(input, directories, decoded)? else {
        return Ok(());
    };
    let Some(place) =
        directory::value_place(&mut input.reader()?, input.len(), index, PHOTOMETRIC)?
    else {
        return Ok(());
    };
    // The decoder reads no masks, but black and white pictures of the same layout:
    // it is shown one.
    let reader = Overlaid::new(input.reader()?, place)?;
    let mut decoder = Decoder::new(reader).map_err(fault)?;
    decoder.seek_to_image(index).map_err(fault)?;
    let mut holes = decoded
        .mask
        .take()
        .unwrap_or_else(|| HoleMask::new(decoded.samples.len()));
    read(&mut decoder, decoded.columns as usize, &mut holes)?;
    decoded.mask = Some(holes);
    Ok(())
}

/// The image that is the mask of the full image.
fn find(input: &Input, directories: usize, decoded: &Decoded) -> Result<Option<usize>, Fault> {
    let mut decoder = Decoder::new(input.reader()?).map_err(fault)?;
    for index in 1..directories {
        // An image that cannot be read is no reason to refuse those before it.
        if !decoder.more_images() || decoder.next_image().is_err() {
            return Ok(None);
        }
        let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType);
        let kind = kind.ok().flatten().unwrap_or(0);
        let size = decoder.dimensions().map_err(fault)?;
        if kind & (MASK | REDUCED) == MASK && size == (decoded.columns, decoded.rows) {
            return Ok(Some(index));
        }
    }
    Ok(None)
}

fn read<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    columns: usize,
    holes: &mut HoleMask,
) -> Result<(), Fault> {
    let bits = decoder.get_tag_u32(Tag::BitsPerSample).unwrap_or(1);
    if !matches!(bits, 1 | 8) {
        return Err(Fault::damaged(format!(
            "TIFF: a mask of {bits} bits a sample"
        )));
    }
    let (chunk_columns, chunk_rows) = decoder.chunk_dimensions();
    let across = columns.div_ceil(chunk_columns.max(1) as usize);
    let chunks = decoder
        .strip_count()
        .or_else(|_| decoder.tile_count())
        .map_err(fault)?;
    for index in 0..chunks {
        let (width, _) = decoder.chunk_data_dimensions(index);
        let row_bytes = (width as usize * bits as usize).div_ceil(8).max(1);
        let DecodingResult::U8(bytes) = decoder.read_chunk(index).map_err(fault)? else {
            return Err(Fault::damaged("TIFF: its mask is not made of bits"));
        };
        let west = index as usize % across * chunk_columns as usize;
        let north = index as usize / across * chunk_rows as usize;
        for (row, bytes) in (north..).zip(bytes.chunks_exact(row_bytes)) {
            for column in 0..width as usize {
                let has_data = match bits {
                    1 => bytes[column / 8] >> (7 - column % 8) & 1 == 1,
                    _ => bytes[column] != 0,
                };
                if !has_data {
                    holes.set(row * columns + west + column);
                }
            }
        }
    }
    Ok(())
}

/// A file in which two bytes read as something else: "black is zero".
struct Overlaid<R> {
    file: R,
    position: u64,
    place: u64,
    shown: [u8; 2],
}

impl<R: Read + Seek> Overlaid<R> {
    fn new(mut file: R, place: u64) -> Result<Self, Fault> {
        let mut order = [0; 2];
        file.read_exact(&mut order).map_err(Fault::Unreadable)?;
        file.seek(SeekFrom::Start(0)).map_err(Fault::Unreadable)?;
        Ok(Self {
            file,
            position: 0,
            place,
            shown: if &order == b"MM" { [0, 1] } else { [1, 0] },
        })
    }
}

impl<R: Read> Read for Overlaid<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        for (at, &byte) in (self.place..).zip(&self.shown) {
            let inside = at
                .checked_sub(self.position)
                .and_then(|at| usize::try_from(at).ok());
            if let Some(target) = inside.and_then(|at| buffer[..count].get_mut(at)) {
                *target = byte;
            }
        }
        self.position += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Overlaid<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = self.file.seek(to)?;
        Ok(self.position)
    }
}
