//! Summary of a file without reading all of it.

use std::hash::Hasher;

use twox_hash::XxHash64;

use super::super::HeightSummary;
use super::{BlockImage, Part, Shared};
use crate::Wait;
use crate::remote::without_key;

/// An image of at most this many samples is read whole.
const FEW_SAMPLES: u64 = 1 << 20;
/// Number of stored blocks, evenly spread, that are read of a larger image.
const MAX_PARTS: usize = 32;
/// Max listed blocks, evenly spread over those that are stored: a full list could need more memory
/// than the terrain.
const MAX_LISTED: usize = 1 << 20;

/// Summary of the heights that are read at opening.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Survey {
    /// Range and count of these heights.
    pub(crate) summary: HeightSummary,
    /// Hash of the file's index and of these heights. It is the same for the same file, and almost
    /// certainly differs after a change. `None` if all samples are in memory.
    pub(crate) print: Option<u64>,
}

impl Survey {
    /// Returns the survey of a raster in memory: its samples identify it.
    pub(crate) const fn of_all(summary: HeightSummary) -> Self {
        Self {
            summary,
            print: None,
        }
    }
}

/// Parts of a raster that are read at opening.
#[derive(Debug)]
pub(crate) struct SurveyParts {
    /// The image to read.
    pub(crate) image: usize,
    /// Parts of it, of which a few are read.
    pub(crate) parts: Vec<Part>,
}

/// The heights that have been read.
struct SurveyedHeights {
    hasher: XxHash64,
    summary: HeightSummary,
}

impl SurveyedHeights {
    /// Counts a height; NaN is no-data.
    fn add(&mut self, height: f64) {
        let bits = if height.is_nan() { f64::NAN } else { height };
        self.hasher.write(&bits.to_le_bytes());
        self.summary.add(height);
    }
}

impl Shared {
    /// Reads the parts that the reader chooses, or the coarsest image, all of it if it is small.
    /// `height` converts a stored sample. The summary's range is empty if the whole file has no
    /// height.
    pub(crate) fn survey(&self, height: impl Fn(Option<f64>) -> f64) -> Survey {
        let mut surveyed = SurveyedHeights {
            hasher: XxHash64::with_seed(0),
            summary: HeightSummary::EMPTY,
        };
        surveyed.hasher.write_u64(self.reader.index());
        let chosen = self.reader.survey_parts();
        let (is_chosen, SurveyParts { image, parts }) = match chosen {
            Some(parts) => (true, parts),
            None => (false, self.coarsest()),
        };
        let add_part = |part: &Part, surveyed: &mut SurveyedHeights| {
            self.add_part(image, part, |stored| surveyed.add(height(stored)));
        };
        let add_samples = |part: &Part, surveyed: &mut SurveyedHeights| match is_chosen {
            true => add_part(part, surveyed),
            false => self.add_block(image, part, |stored| surveyed.add(height(stored))),
        };
        let is_small = !is_chosen && self.samples(image) <= FEW_SAMPLES;
        let count = match is_small || parts.len() <= MAX_PARTS {
            true => parts.len(),
            false => MAX_PARTS,
        };
        let chosen = (0..count).map(|index| parts[index * (parts.len() - 1) / (count - 1).max(1)]);
        let chosen: Vec<Part> = chosen.collect();
        self.reader.prefetch(image, &chosen);
        for part in &chosen {
            add_samples(part, &mut surveyed);
        }
        if count < parts.len() && surveyed.summary.has_none() {
            self.warn_of_search(count, parts.len());
            // Most of the file may be no-data: then the first height anywhere is enough.
            for part in &parts {
                add_part(part, &mut surveyed);
                if !surveyed.summary.has_none() {
                    break;
                }
            }
        }
        Survey {
            summary: surveyed.summary,
            print: Some(surveyed.hasher.finish()),
        }
    }

    /// Warns that opening the file may take long, and why.
    fn warn_of_search(&self, count: usize, parts: usize) {
        let name = (self.path.get()).map_or("the file".into(), |path| without_key(path));
        tracing::warn!(
            "{count} places of {name} have no height: all {parts} are searched until one has, which may take a while"
        );
    }

    /// Reads the samples of a block, which is cached.
    fn add_block(&self, image: usize, part: &Part, mut add: impl FnMut(Option<f64>)) {
        for row in part.row..part.row + part.rows {
            for column in part.column..part.column + part.columns {
                let stored = self.sample(image, [column, row], Wait::UntilRead);
                add(stored.ok().flatten());
            }
        }
    }

    /// Reads the samples of a part that is not a block: it is not cached, and nothing around it is
    /// read.
    fn add_part(&self, image: usize, part: &Part, mut add: impl FnMut(Option<f64>)) {
        let read = self.read(image, part);
        self.state().lacked_block |= read.is_err();
        let block = read.ok().and_then(|read| read.block);
        for index in 0..part.columns as usize * part.rows as usize {
            add(block.as_ref().and_then(|block| block.stored(index)));
        }
    }

    fn coarsest(&self) -> SurveyParts {
        let image = self.reader.images().len().saturating_sub(1);
        let images = self.reader.images();
        let parts = images.get(image).map(|of| {
            let is_stored = |part: &Part| self.reader.is_stored(image, part);
            stored_parts(of, is_stored)
        });
        SurveyParts {
            image,
            parts: parts.unwrap_or_default(),
        }
    }

    fn samples(&self, image: usize) -> u64 {
        let of = self.images.get(image);
        of.map_or(0, |of| u64::from(of.columns) * u64::from(of.rows))
    }
}

/// Returns the blocks of an image that contain samples, or evenly spread ones if there are too
/// many.
pub(crate) fn stored_parts(of: &BlockImage, is_stored: impl Fn(&Part) -> bool) -> Vec<Part> {
    let [across, down] = of.counts();
    let every = || (0..down).flat_map(|row| (0..across).map(move |column| [column, row]));
    let stored = || every().map(|at| of.part(at)).filter(&is_stored);
    let step = match u64::from(across) * u64::from(down) > MAX_LISTED as u64 {
        true => stored().count().div_ceil(MAX_LISTED).max(1),
        false => 1,
    };
    stored().step_by(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listed_blocks_are_stored_and_limited_in_number() {
        let of = BlockImage {
            columns: 2048,
            rows: 2048,
            block: [1, 1],
            every: None,
            first: [0; 2],
        };
        let one = stored_parts(&of, |part| (part.column, part.row) == (1999, 7));
        assert_eq!(one.len(), 1);
        assert_eq!((one[0].column, one[0].row), (1999, 7));
        let all = stored_parts(&of, |_| true);
        assert_eq!(all.len(), MAX_LISTED);
        assert!(all.last().is_some_and(|part| part.row == 2047));
        let third = stored_parts(&of, |part| part.row.is_multiple_of(3));
        assert!((MAX_LISTED / 2..=MAX_LISTED).contains(&third.len()));
        assert!(third.iter().all(|part| part.row % 3 == 0));
    }
}
