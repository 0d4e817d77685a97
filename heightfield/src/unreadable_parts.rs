//! Tiles, strips, chunks and rows of a file that cannot be read: each causes one warning, and is
//! no-data.

use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

use super::RasterError;
use super::blocks::Part;

/// Max stored parts: further ones are read, and reported, again.
const MAX: usize = 1 << 16;
/// After this many warnings, one reports that there are more.
const WARNINGS: usize = 8;

/// Parts of a file that could not be read.
#[derive(Debug)]
pub(super) struct UnreadableParts {
    /// The file's name for warnings.
    name: String,
    reported: Mutex<HashSet<(usize, [u32; 2])>>,
}

impl UnreadableParts {
    /// Returns an empty set for a file.
    pub(super) fn of(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            reported: Mutex::default(),
        }
    }

    /// Returns true if reading the part at a column and row of an image failed before.
    pub(super) fn has(&self, image: usize, first: [u32; 2]) -> bool {
        let reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        reported.contains(&(image, first))
    }

    /// Warns once per part of an image that cannot be read.
    pub(super) fn warn(&self, image: usize, part: &Part, fault: &RasterError) {
        let mut reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        if reported.len() < MAX && !reported.insert((image, [part.column, part.row])) {
            return;
        }
        if reported.len() <= WARNINGS {
            tracing::warn!(
                "columns {} to {}, rows {} to {} of {}{} cannot be read and count as no data: {fault}",
                part.column,
                part.column + part.columns - 1,
                part.row,
                part.row + part.rows - 1,
                if image > 0 { "an overview of " } else { "" },
                self.name
            );
        } else if reported.len() == WARNINGS + 1 {
            tracing::warn!("more of {} cannot be read and count as no data", self.name);
        }
    }
}
