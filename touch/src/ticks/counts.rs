//! Relation of rows to ticks, in numbers.

/// Duration of a move on one straight line from which it is counted as odd, s: a hand changes
/// direction at most ten times a second.
pub const ODD_MOVE_S: f64 = 0.05;

/// Reason why the times of rows are not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Untimed {
    /// There are none.
    Missing,
    /// All times are equal, s.
    Same(f64),
    /// The caller has requested it.
    Requested,
}

/// Counts of a path that is read tick by tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Reason why the times of rows are not used, if any.
    pub untimed: Option<Untimed>,
    /// Rows read.
    pub rows: u64,
    /// Ticks.
    pub ticks: u64,
    /// Ticks that are not at a row.
    pub filled_in: u64,
    /// Rows without a tick at or next to them.
    pub passed_over: u64,
    /// Rows with the time and position of the row before.
    pub repeated: u64,
    /// Gaps in a recording that were not filled.
    pub gaps: u64,
    /// Moves on straight lines that took longer than [`ODD_MOVE_S`].
    pub odd_moves: u64,
    /// The longest move, s.
    pub max_move_s: f64,
}

impl Counts {
    /// Counts a move between two rows, s.
    pub(super) fn count_move(&mut self, step_s: f64) {
        self.odd_moves += u64::from(step_s > ODD_MOVE_S);
        self.max_move_s = self.max_move_s.max(step_s);
    }
}
