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
    /// height of a stored sample. The summary's range is empty where there is no height.
    pub(in crate::raster) fn survey(&self, height: impl Fn(Option<f64>) -> f64) -> Survey {
        let images = self.reader.images();
        let image = images.len().saturating_sub(1);
        let mut hasher = XxHash64::with_seed(0);
        hasher.write_u64(self.reader.index());
        let mut summary = HeightSummary::EMPTY;
        for part in self.looks(image) {
            let rows = part.row..part.row + part.rows;
            for (row, column) in rows
                .flat_map(|row| (part.column..part.column + part.columns).map(move |c| (row, c)))
            {
                let height = height(self.stored(image, column, row));
                let bits = if height.is_nan() { f64::NAN } else { height };
                hasher.write(&bits.to_le_bytes());
                summary.add(height);
            }
        }
        Survey {
            summary,
            print: Some(hasher.finish()),
        }
    }

    /// Blocks to be looked at.
    fn looks(&self, image: usize) -> Vec<Part> {
        let Some(of) = self.reader.images().get(image) else {
            return Vec::new();
        };
        let [across, down] = of.counts();
        let every = (0..down).flat_map(|row| (0..across).map(move |column| [column, row]));
        let stored = every
            .map(|at| of.part(at))
            .filter(|part| self.reader.is_stored(image, part));
        let stored: Vec<_> = stored.collect();
        if u64::from(of.columns) * u64::from(of.rows) <= FEW_SAMPLES || stored.len() <= LOOKS {
            return stored;
        }
        let spread = |look: usize| stored[look * (stored.len() - 1) / (LOOKS - 1)];
        (0..LOOKS).map(spread).collect()
    }
}
