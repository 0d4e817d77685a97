//! Behaviour of a read if heights are not in memory, and completeness of its result.

use std::cell::Cell;

/// Behaviour of a read if a height is not in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// Waits until the height is read, or cannot be read at present.
    UntilRead,
    /// Does not wait: the height is read in the background, for a later read.
    Never,
}

/// Completeness of a read. A pending height is NaN, but it is not no-data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[must_use = "pending heights look like no-data"]
pub enum ReadStatus {
    /// All heights were returned.
    #[default]
    Complete,
    /// Some heights are pending: read again later.
    Pending,
}

impl ReadStatus {
    /// Returns true if all heights were returned.
    #[must_use]
    pub const fn is_complete(self) -> bool {
        matches!(self, Self::Complete)
    }

    /// Combines two reads: complete if both are.
    pub const fn and(self, other: Self) -> Self {
        match self {
            Self::Complete => other,
            Self::Pending => self,
        }
    }
}

/// Combined status of several reads.
#[derive(Debug, Default)]
pub struct ReadTracker(Cell<ReadStatus>);

impl ReadTracker {
    /// Adds the status of a read.
    pub fn add(&self, status: ReadStatus) {
        self.0.set(self.0.get().and(status));
    }

    /// Adds the status of a read, and returns the value.
    pub fn record<T>(&self, (read, status): (T, ReadStatus)) -> T {
        self.add(status);
        read
    }

    /// Returns the status of all earlier reads.
    pub const fn status(&self) -> ReadStatus {
        self.0.get()
    }
}
