//! Heights for no-data samples, by inverse distance from data along four axes.
//!
//! For a no-data sample, the nearest data is searched to the left, right, up and down. The samples
//! found within the limit are averaged, weighted by the inverse of their distance in samples; if
//! none is found, the sample stays no-data. Filled heights are not used to fill others, so a value
//! does not depend on the window that is read.
//!
//! GDAL's `FillNodata` uses the same weights. It searches four quadrants, not axes, so its values
//! differ.

use std::hash::Hasher;

use twox_hash::XxHash64;

use super::{ReadStatus, ReadTracker};

/// Max distance from data at which no-data is filled ([`OpenOptions::fill`](crate::OpenOptions)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fill(u32);

impl Fill {
    /// Max distance, samples.
    pub const MAX: u32 = 64;

    /// Returns a fill from data at most `samples` away; `None` unless `samples` is from 1 to
    /// [`Fill::MAX`].
    #[must_use]
    pub fn within(samples: u32) -> Option<Self> {
        (1..=Self::MAX).contains(&samples).then_some(Self(samples))
    }

    /// Returns the max distance of the data, in samples of the level that is read.
    #[must_use]
    pub const fn samples(self) -> u32 {
        self.0
    }

    /// Returns the hash of a file with filled heights, from the file's hash.
    pub(super) fn print_of(self, file: u64) -> u64 {
        let mut hasher = XxHash64::with_seed(0);
        hasher.write_u64(file);
        hasher.write_u32(self.0);
        hasher.finish()
    }

    /// Returns the height at a sample of an image, filled if it is no-data. It is pending while any
    /// sample that determines it is.
    pub(super) fn height(
        self,
        at: [u32; 2],
        size: [u32; 2],
        read: impl Fn([u32; 2]) -> (f64, ReadStatus),
    ) -> (f64, ReadStatus) {
        let (height, status) = read(at);
        if !height.is_nan() || !status.is_complete() {
            return (height, status);
        }
        let reads = ReadTracker::default();
        let (mut sum, mut weights) = (0.0, 0.0);
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for (axis, is_forward) in [(0, false), (0, true), (1, false), (1, true)] {
            let along = |distance: u32| {
                let index = match is_forward {
                    true => at[axis].checked_add(distance),
                    false => at[axis].checked_sub(distance),
                };
                let mut neighbour = at;
                neighbour[axis] = index.filter(|index| *index < size[axis])?;
                Some(neighbour)
            };
            let neighbours = (1..=self.0).map_while(|distance| Some((distance, along(distance)?)));
            for (distance, neighbour) in neighbours {
                let (height, status) = read(neighbour);
                reads.add(status);
                if !status.is_complete() {
                    break;
                }
                if !height.is_nan() {
                    let weight = 1.0 / f64::from(distance);
                    (sum, weights) = (sum + weight * height, weights + weight);
                    (lowest, highest) = (lowest.min(height), highest.max(height));
                    break;
                }
            }
        }
        if weights == 0.0 || !reads.status().is_complete() {
            return (f64::NAN, reads.status());
        }
        // Rounding must not leave the file's range.
        ((sum / weights).clamp(lowest, highest), ReadStatus::Complete)
    }
}

#[cfg(test)]
#[path = "fill_tests.rs"]
mod tests;
