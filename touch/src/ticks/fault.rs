//! Times of rows that cannot be right.

/// A tick that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TickError<E> {
    /// A row that cannot be read.
    #[error(transparent)]
    Row(E),
    /// A row whose time cannot be right.
    #[error("row {row}: {fault}")]
    Time {
        /// The row, from 0.
        row: u64,
        /// Its time.
        fault: TimeFault,
    },
}

/// A time, s, that cannot follow on the time of the row before.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TimeFault {
    /// Not a number, or infinite.
    #[error("the time is not a finite number: give seconds")]
    NotFinite,
    /// Before the row before.
    #[error("time goes back from {from} s to {to} s")]
    Backwards {
        /// Of the row before.
        from: f64,
        /// Of the row.
        to: f64,
    },
    /// The time of a row at another place.
    #[error("two places at {0} s: the HIP cannot be at both")]
    TwoPlaces(f64),
    /// A time after rows that all had the same.
    #[error("time begins at {to} s, and all rows before, at several places, have {from} s")]
    Begins {
        /// Of the rows before.
        from: f64,
        /// Of the row.
        to: f64,
    },
    /// A long move on a straight line.
    #[error(
        "the HIP moves during a gap of {step} s, from {from} s to {to} s: where it was meanwhile is not known; give seconds, or split the path there"
    )]
    Gap {
        /// Of the row before.
        from: f64,
        /// Of the row.
        to: f64,
        /// Between them.
        step: f64,
    },
    /// A very long rest.
    #[error("a gap of {step} s, from {from} s to {to} s: give seconds, or split the path there")]
    Rest {
        /// Of the row before.
        from: f64,
        /// Of the row.
        to: f64,
        /// Between them.
        step: f64,
    },
    /// Too far from zero to tell ticks.
    #[error("numbers near {0} s are too far apart to tell ticks by them: begin at 0 s")]
    TooLarge(f64),
    /// No tick of a recording.
    #[error(
        "{to} s is {ticks} ticks after the row before, where the settings say {tick_hz} ticks a second"
    )]
    OffTick {
        /// Of the row.
        to: f64,
        /// Ticks since the row before.
        ticks: f64,
        /// The rate.
        tick_hz: f64,
    },
}
