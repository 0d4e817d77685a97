//! Relation of rows to ticks, in numbers.

/// The HIP may move on one straight line for so long before that is odd, s: a hand turns ten times
/// a second at most.
pub const ODD_MOVE_S: f64 = 0.05;

/// Reason for which the times of rows are not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Untimed {
    /// There are none.
    Missing,
    /// All are this one, s.
    Same(f64),
    /// So it was asked for.
    Asked,
}

/// Counts of a path that is read tick by tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Reason for which the times of rows are not used, if any.
    pub untimed: Option<Untimed>,
    /// Rows read.
    pub rows: u64,
    /// Ticks.
    pub ticks: u64,
    /// Ticks that are at no row.
    pub filled_in: u64,
    /// Rows that no tick was at or next to.
    pub passed_over: u64,
    /// Rows with time and place of the row before.
    pub repeated: u64,
    /// Gaps in a recording in which nothing was filled in.
    pub gaps: u64,
    /// Moves on straight lines that took longer than [`ODD_MOVE_S`].
    pub odd_moves: u64,
    /// The longest move, s.
    pub longest_move_s: f64,
}

impl Counts {
    /// Counts a move between two rows, s.
    pub(super) fn moves(&mut self, step_s: f64) {
        self.odd_moves += u64::from(step_s > ODD_MOVE_S);
        self.longest_move_s = self.longest_move_s.max(step_s);
    }
}
