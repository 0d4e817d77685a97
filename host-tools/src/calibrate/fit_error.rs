//! Reason for which measurements make no record.

/// Reason for which measurements make no record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A joint hardly moved in any of the checks.
    #[error(
        "joint {joint} moved by no more than {counts} counts in all checks: too little to tell its ratio"
    )]
    NotMoved {
        /// The joint, 1 to 3.
        joint: usize,
        /// Counts that it moved at most.
        counts: u32,
    },
    /// No ratios explain the checks.
    #[error("no ratios explain the checks: they are off by {off_mm:.1} mm at best")]
    NoRatios {
        /// Root mean square of what is left over, mm.
        off_mm: f64,
    },
    /// Poses that say nothing about a joint's gravity.
    #[error("no pose shows the weight on joint {joint}")]
    NoWeight {
        /// The joint, 2 or 3.
        joint: usize,
    },
}
