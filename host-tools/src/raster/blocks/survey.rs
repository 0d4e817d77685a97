//! What is known of a file without reading all of it.

use std::hash::Hasher;

use twox_hash::XxHash64;

use super::super::HeightSummary;
use super::{Blocks, Part};

/// Of an image with at most so many samples all are looked at.
const FEW_SAMPLES: u64 = 1 << 20;
/// Of a larger one so many blocks that hold samples, spread evenly.
const LOOKS: usize = 32;

/// Heights looked at when the file was opened.
#[derive(Clone, Copy, Debug)]
pub(in crate::raster) struct Survey {
    /// Of the heights that were looked at.
    pub(in crate::raster) summary: HeightSummary,
    /// Hash of the file's index and of the heights that were looked at: the same file has
    /// the same, and one that was changed most likely another. `None` where all samples
    /// are in memory.
    pub(in crate::raster) print: Option<u64>,
}

impl Survey {
    /// Of a raster that is in memory: nothing but its samples is needed to know it again.
    pub(in crate::raster) const fn of_all(summary: HeightSummary) -> Self {
        Self {
            summary,
            print: None,
        }
    }
}

impl Blocks {
    /// Looks at the coarsest image, all of it where it is small. `height` makes a
    /// height of a stored sample. The summary's range is empty where there is no height in
    /// the whole file.
    pub(in crate::raster) fn survey(&self, height: impl Fn(Option<f64>) -> f64) -> Survey {
        let image = self.reader.images().len().saturating_sub(1);
        let mut hasher = XxHash64::with_seed(0);
        hasher.write_u64(self.reader.index());
        let mut summary = HeightSummary::EMPTY;
        let mut look = |part: Part| {
            for row in part.row..part.row + part.rows {
                for column in part.column..part.column + part.columns {
                    let height = height(self.stored(image, column, row));
                    let bits = if height.is_nan() { f64::NAN } else { height };
                    hasher.write(&bits.to_le_bytes());
                    summary.add(height);
                }
            }
            summary.has_none()
        };
        let parts = self.stored_parts(image);
        let is_small = parts.len() <= LOOKS || self.samples(image) <= FEW_SAMPLES;
        let looks = if is_small { parts.len() } else { LOOKS };
        let mut nothing_yet = true;
        for index in 0..looks {
            nothing_yet = look(parts[index * (parts.len() - 1) / (looks - 1).max(1)]);
        }
        if nothing_yet && !is_small {
            // Most of it holds nothing: the first height anywhere will do.
            let _ = parts.into_iter().find(|part| !look(*part));
        }
        Survey {
            summary,
            print: Some(hasher.finish()),
        }
    }

    fn samples(&self, image: usize) -> u64 {
        let of = self.reader.images().get(image);
        of.map_or(0, |of| u64::from(of.columns) * u64::from(of.rows))
    }

    /// The blocks of an image that hold samples.
    fn stored_parts(&self, image: usize) -> Vec<Part> {
        let Some(of) = self.reader.images().get(image) else {
            return Vec::new();
        };
        let [across, down] = of.counts();
        let every = (0..down).flat_map(|row| (0..across).map(move |column| [column, row]));
        let parts = every.map(|at| of.part(at));
        parts
            .filter(|part| self.reader.is_stored(image, part))
            .collect()
    }
}
