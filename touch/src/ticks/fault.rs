//! Invalid times of rows.

/// Reason why a tick cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TickError<E> {
    /// A row cannot be read.
    #[error(transparent)]
    Row(E),
    /// The time of a row is invalid.
    #[error("row {row}: {fault}")]
    Time {
        /// The row, from 0.
        row: u64,
        /// The fault of its time.
        fault: TimeFault,
    },
}

/// A time, s, that cannot follow the time of the previous row.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TimeFault {
    /// The time is NaN or infinite.
    #[error("the time is not a finite number: state it in seconds")]
    NotFinite,
    /// The time is before that of the previous row.
    #[error("time decreases from {from} s to {to} s")]
    Backwards {
        /// Time of the previous row, s.
        from: f64,
        /// Time of the row, s.
        to: f64,
    },
    /// The time equals that of a row at another position.
    #[error("two places at {0} s: the HIP cannot be at both")]
    TwoPositions(f64),
    /// The first different time after rows that all had the same.
    #[error("time begins at {to} s, and all rows before, at several places, have {from} s")]
    TimesStart {
        /// Time of the rows before, s.
        from: f64,
        /// Time of the row, s.
        to: f64,
    },
    /// A move on a straight line is too long.
    #[error(
        "the HIP moves during a gap of {step} s, from {from} s to {to} s: its path there is unknown; state times in seconds, or split the path there"
    )]
    Gap {
        /// Time of the previous row, s.
        from: f64,
        /// Time of the row, s.
        to: f64,
        /// Time between them, s.
        step: f64,
    },
    /// A rest is too long.
    #[error(
        "a gap of {step} s, from {from} s to {to} s: state times in seconds, or split the path there"
    )]
    Rest {
        /// Time of the previous row, s.
        from: f64,
        /// Time of the row, s.
        to: f64,
        /// Time between them, s.
        step: f64,
    },
    /// The time is too far from zero to distinguish ticks.
    #[error("numbers near {0} s are too far apart to separate ticks: begin at 0 s")]
    TooLarge(f64),
    /// The time is not at a tick of the recording.
    #[error(
        "{to} s is {ticks} ticks after the row before, but the settings state {tick_hz} ticks a second"
    )]
    OffTick {
        /// Time of the row, s.
        to: f64,
        /// Ticks since the previous row.
        ticks: f64,
        /// The rate.
        tick_hz: f64,
    },
}
