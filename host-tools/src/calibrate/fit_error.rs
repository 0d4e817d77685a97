//! Reason why the measurements yield no record.

/// Reason why the measurements yield no record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// A joint moved too little in all checks.
    #[error(
        "joint {joint} moved by no more than {counts} counts in all checks: too little to determine its ratio"
    )]
    NotMoved {
        /// The joint, 1 to 3.
        joint: usize,
        /// The largest move, counts.
        counts: u32,
    },
    /// No ratios fit the checks.
    #[error("no ratios explain the checks: they are off by {residual_mm:.1} mm at best")]
    NoRatios {
        /// Root mean square of the residuals, mm.
        residual_mm: f64,
    },
    /// No pose shows a joint's gravity.
    #[error("no pose shows the weight on joint {joint}")]
    NoWeight {
        /// The joint, 2 or 3.
        joint: usize,
    },
}
