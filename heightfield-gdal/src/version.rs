//! Versions of GDAL.

use std::fmt;

/// A version of GDAL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// For example, 3 in 3.6.2.
    pub major: u32,
    /// For example, 6 in 3.6.2.
    pub minor: u32,
    /// For example, 2 in 3.6.2.
    pub patch: u32,
}

impl Version {
    /// The oldest supported version.
    pub const OLDEST: Self = Self {
        major: 3,
        minor: 4,
        patch: 0,
    };

    /// Converts GDAL's number, as 3060200.
    pub(crate) fn of(number: u32) -> Self {
        Self {
            major: number / 1_000_000,
            minor: number / 10_000 % 100,
            patch: number / 100 % 100,
        }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}
