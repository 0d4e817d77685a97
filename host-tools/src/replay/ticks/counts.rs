//! What rows were for ticks, in numbers and in words.

/// The HIP may move on one straight line for so long before that is odd, s: a hand turns ten times
/// a second at most.
const ODD_MOVE_S: f64 = 0.05;

/// Why the times of rows are not used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Untimed {
    /// There are none.
    Missing,
    /// All are this one, s.
    Same(f64),
    /// So it was asked for.
    Asked,
}

/// Counts of a trajectory that is read tick by tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counts {
    tick_hz: u32,
    pub(super) untimed: Option<Untimed>,
    /// Rows read.
    pub(super) rows: u64,
    /// Ticks, and those of them that are at no row.
    pub(super) ticks: u64,
    pub(super) filled_in: u64,
    /// Rows that no tick was at or next to.
    pub(super) passed_over: u64,
    /// Rows with time and place of the row before.
    pub(super) repeated: u64,
    /// Gaps in a recording in which nothing was filled in.
    pub(super) gaps: u64,
    /// Moves on straight lines that took longer than [`ODD_MOVE_S`], and the longest, s.
    odd_moves: u64,
    longest_s: f64,
}

impl Counts {
    pub(super) const fn new(tick_hz: u32) -> Self {
        Self {
            tick_hz,
            untimed: None,
            rows: 0,
            ticks: 0,
            filled_in: 0,
            passed_over: 0,
            repeated: 0,
            gaps: 0,
            odd_moves: 0,
            longest_s: 0.0,
        }
    }

    /// Counts a move between two rows, s.
    pub(super) fn moves(&mut self, step_s: f64) {
        self.odd_moves += u64::from(step_s > ODD_MOVE_S);
        self.longest_s = self.longest_s.max(step_s);
    }

    /// What rows were for ticks; none where they were a tick each by their own times.
    pub(super) fn pace(&self) -> Option<String> {
        let (rows, hz) = (self.rows, self.tick_hz);
        Some(match self.untimed {
            Some(Untimed::Missing) => {
                format!("one row of the path a tick, {hz} ticks a second: it has no t_s")
            }
            Some(Untimed::Same(t_s)) => format!(
                "one row of the path a tick, {hz} ticks a second: t_s is {t_s} in all of them"
            ),
            Some(Untimed::Asked) => format!("one row of the path a tick, {hz} ticks a second"),
            None if rows == self.ticks && self.filled_in == 0 => return None,
            None => format!(
                "{hz} ticks a second by t_s, on straight lines between the {rows} rows of the path"
            ),
        })
    }

    /// What is odd, a sentence each.
    pub(super) fn remarks(&self) -> Vec<String> {
        let longest = (self.longest_s * 1e6).round() / 1e6;
        let odd = self.odd_moves;
        let remarks = [
            (
                odd,
                format!(
                    "{odd} times the HIP moves for more than {ODD_MOVE_S} s between two rows, {longest} s at most: it is felt on straight lines there. t_s is in seconds"
                ),
            ),
            (
                self.passed_over,
                format!(
                    "{} of {} rows lie between two ticks and are not felt",
                    self.passed_over, self.rows
                ),
            ),
            (
                self.repeated,
                format!(
                    "{} rows repeat time and place of the row before, and are left out",
                    self.repeated
                ),
            ),
            (
                self.gaps,
                format!(
                    "{} gaps of the recording are longer than 2 s, and nothing is filled in",
                    self.gaps
                ),
            ),
        ];
        let told = remarks.into_iter().filter(|(count, _)| *count > 0);
        told.map(|(_, remark)| remark).collect()
    }
}
