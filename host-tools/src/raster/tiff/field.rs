//! The whole image, filled chunk by chunk.

use tiff::decoder::DecodingResult;

use super::chunks::Place;
use super::layout::{Layout, Stored};
use crate::raster::{Fault, Samples};

/// The samples so far.
pub(super) struct Field {
    pub(super) samples: Samples,
    /// All samples are there.
    pub(super) is_whole: bool,
}

impl Field {
    /// Room for an image's samples.
    pub(super) fn new(layout: &Layout) -> Result<Self, Fault> {
        let samples = layout.columns as usize * layout.rows as usize;
        Ok(Self {
            samples: match layout.stored {
                Stored::U8 => Samples::U8(room(samples)?),
                Stored::I8 => Samples::I8(room(samples)?),
                Stored::U16 => Samples::U16(room(samples)?),
                Stored::I16 => Samples::I16(room(samples)?),
                Stored::U32 => Samples::U32(room(samples)?),
                Stored::I32 => Samples::I32(room(samples)?),
                Stored::F16 | Stored::F32 => Samples::F32(room(samples)?),
                Stored::F64 | Stored::U64 | Stored::I64 => Samples::F64(room(samples)?),
            },
            is_whole: false,
        })
    }

    /// A single chunk that is the whole image.
    pub(super) fn from_whole(chunk: DecodingResult) -> Self {
        use DecodingResult as Chunk;
        Self {
            samples: match chunk {
                Chunk::U8(values) => Samples::U8(values),
                Chunk::I8(values) => Samples::I8(values),
                Chunk::U16(values) => Samples::U16(values),
                Chunk::I16(values) => Samples::I16(values),
                Chunk::U32(values) => Samples::U32(values),
                Chunk::I32(values) => Samples::I32(values),
                Chunk::F32(values) => Samples::F32(values),
                Chunk::F64(values) => Samples::F64(values),
                Chunk::F16(values) => {
                    Samples::F32(values.into_iter().map(|value| value.to_f32()).collect())
                }
                Chunk::U64(values) => {
                    Samples::F64(values.into_iter().map(|value| value as f64).collect())
                }
                Chunk::I64(values) => {
                    Samples::F64(values.into_iter().map(|value| value as f64).collect())
                }
            },
            is_whole: true,
        }
    }

    /// Copies the first band of a chunk to its place; `None` when the chunk is of
    /// another type or too short.
    pub(super) fn take(&mut self, chunk: &DecodingResult, place: &Place) -> Option<()> {
        use DecodingResult as Chunk;
        match (&mut self.samples, chunk) {
            (Samples::U8(field), Chunk::U8(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::I8(field), Chunk::I8(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::U16(field), Chunk::U16(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::I16(field), Chunk::I16(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::U32(field), Chunk::U32(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::I32(field), Chunk::I32(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::F32(field), Chunk::F32(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::F64(field), Chunk::F64(chunk)) => copy(field, chunk, place, |value| value),
            (Samples::F32(field), Chunk::F16(chunk)) => {
                copy(field, chunk, place, |value| value.to_f32())
            }
            (Samples::F64(field), Chunk::U64(chunk)) => {
                copy(field, chunk, place, |value| value as f64)
            }
            (Samples::F64(field), Chunk::I64(chunk)) => {
                copy(field, chunk, place, |value| value as f64)
            }
            _ => None,
        }
    }

    /// The decoder turns pictures whose white is zero into ones whose black is;
    /// heights are wanted as they are stored.
    pub(super) fn undo_inversion(&mut self) {
        match &mut self.samples {
            Samples::U8(values) => values.iter_mut().for_each(|value| *value = !*value),
            Samples::U16(values) => values.iter_mut().for_each(|value| *value = !*value),
            Samples::U32(values) => values.iter_mut().for_each(|value| *value = !*value),
            _ => {}
        }
    }
}

fn room<T: Default + Clone>(samples: usize) -> Result<Vec<T>, Fault> {
    let mut values = Vec::new();
    values.try_reserve_exact(samples).map_err(|_| {
        Fault::AbsurdSize(format!(
            "{samples} samples are more than this machine can hold"
        ))
    })?;
    values.resize(samples, T::default());
    Ok(values)
}

fn copy<From: Copy, To>(
    field: &mut [To],
    chunk: &[From],
    place: &Place,
    convert: impl Fn(From) -> To,
) -> Option<()> {
    let row_length = place.columns * place.interleaved;
    for (chunk_row, target) in chunk.chunks_exact(row_length).zip(place.rows_in_field()) {
        let texels = chunk_row.chunks_exact(place.interleaved);
        for (sample, texel) in field.get_mut(target)?.iter_mut().zip(texels) {
            *sample = convert(texel[0]);
        }
    }
    (chunk.len() >= row_length * place.rows).then_some(())
}
