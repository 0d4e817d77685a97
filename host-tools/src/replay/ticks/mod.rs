//! A trajectory at the ticks of a device.
//!
//! Tick `n` is at `t_s` of the first row plus `n` divided by the tick rate; the last one is not
//! later than the last row. The HIP of a tick is that of the row at its time, bit for bit, if there
//! is one within [`ON_TICK`]; else it lies on the straight line between the rows before and after
//! it, passed at a constant speed. Rows between two ticks are not felt, as an arm's encoders are
//! not read between them.
//!
//! So a path whose rows are a tick apart is felt row by row. The rows of a recording are whole
//! ticks apart, mostly one: a device sends a sample a millisecond, and some may be lost on the
//! link.

mod by_time;
mod counts;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use super::trajectory::{Row, TimeFault, Trajectory, TrajectoryError};
use by_time::Timed;
use counts::{Counts, Untimed};

/// A row that is as near to a tick is at it, ticks: times are written with six digits, or in
/// single precision.
const ON_TICK: f64 = 0.01;

/// How rows become ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// By the rows' own times. A file without times has one row a tick.
    ByTime,
    /// By the rows' own times, which are whole ticks: those of a recording that is felt with its
    /// settings. Nothing is filled in between two views and in gaps of more than 2 s.
    Recorded,
    /// One row a tick, whatever times they have.
    RowByRow,
}

/// Where the HIP is in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Time of the tick, s: that of its row to the bit, if it has one.
    pub t_s: f64,
    /// Position of the HIP, mm: east, north, up.
    pub hip_mm: [f64; 3],
    /// The view of its row, or of the rows between which it lies.
    pub view: u32,
}

/// A trajectory that is read tick by tick.
pub struct Ticks {
    trajectory: Trajectory,
    pace: Pace,
    due: Due,
    /// The last row whose time is not later than that of the latest tick.
    before: Option<Timed>,
    /// The row after it, if it was read already.
    ahead: Option<Timed>,
    /// Rows that were read, and how many times each stands there: a tick each.
    held: VecDeque<(Row, u64)>,
    counts: Counts,
}

impl Ticks {
    /// The ticks of a device with `tick_hz` ticks a second, 1 at least.
    #[must_use]
    pub fn new(trajectory: Trajectory, pace: Pace, tick_hz: u32) -> Self {
        let mut counts = Counts::new(tick_hz);
        if pace == Pace::RowByRow {
            counts.untimed = Some(Untimed::Asked);
        }
        Self {
            trajectory,
            pace,
            due: Due::new(tick_hz),
            before: None,
            ahead: None,
            held: VecDeque::new(),
            counts,
        }
    }

    /// The trajectory.
    pub const fn trajectory(&mut self) -> &mut Trajectory {
        &mut self.trajectory
    }

    /// Returns what the rows were for the ticks, for the line that counts them; none where they
    /// were a tick each by their own times.
    #[must_use]
    pub fn pace(&self) -> Option<String> {
        self.counts.pace()
    }

    /// Returns what is odd about the times, a sentence each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        self.counts.remarks()
    }

    /// The next tick; `None` after the last.
    ///
    /// # Errors
    /// [`TrajectoryError`] names line and column of what is wrong with a row or its time.
    pub fn next_tick(&mut self) -> Result<Option<Tick>, TrajectoryError> {
        let tick = match self.pace {
            Pace::RowByRow => self.next_row(),
            Pace::ByTime | Pace::Recorded => self.next_by_time(),
        }?;
        self.counts.ticks += u64::from(tick.is_some());
        Ok(tick)
    }

    /// The next row as the next tick.
    fn next_row(&mut self) -> Result<Option<Tick>, TrajectoryError> {
        while self.held.front().is_some_and(|(_, times)| *times == 0) {
            self.held.pop_front();
        }
        let row = match self.held.front_mut() {
            Some((row, times)) => {
                *times -= 1;
                Some(*row)
            }
            None => self.read()?,
        };
        let Some(row) = row else {
            return Ok(None);
        };
        if let (Some(Untimed::Same(from)), Some(to)) = (self.counts.untimed, row.t_s)
            && from != to
        {
            return Err(self.trajectory.mistimed(TimeFault::Begins { from, to }));
        }
        let t_s = row.t_s.unwrap_or_default();
        if self.due.next == 0 && !self.due.is_coarse_at(t_s) {
            self.due.begin_s = t_s;
        }
        Ok(Some(self.tick_at(&row)))
    }

    /// The next tick, at a row.
    fn tick_at(&mut self, row: &Row) -> Tick {
        let is_there = |t_s: &f64| self.due.late(*t_s).abs() <= ON_TICK;
        let t_s = row.t_s.filter(is_there).unwrap_or(self.due.s());
        self.due.next += 1;
        Tick {
            t_s,
            hip_mm: row.hip_mm,
            view: row.view,
        }
    }

    fn read(&mut self) -> Result<Option<Row>, TrajectoryError> {
        let row = self.trajectory.next_row()?;
        self.counts.rows += u64::from(row.is_some());
        Ok(row)
    }
}

/// When the next tick is due.
#[derive(Clone, Copy, Debug)]
struct Due {
    tick_hz: f64,
    /// Time of tick 0, s.
    begin_s: f64,
    /// Number of the next tick.
    next: u64,
}

impl Due {
    fn new(tick_hz: u32) -> Self {
        Self {
            tick_hz: f64::from(tick_hz.max(1)),
            begin_s: 0.0,
            next: 0,
        }
    }

    /// Time of the next tick, s.
    fn s(&self) -> f64 {
        self.begin_s + self.next as f64 / self.tick_hz
    }

    /// By how many ticks a time is later than the next tick.
    fn late(&self, t_s: f64) -> f64 {
        (t_s - self.s()) * self.tick_hz
    }

    /// Returns true if numbers near a time are too far apart to tell ticks by them.
    fn is_coarse_at(&self, t_s: f64) -> bool {
        t_s.abs() * f64::EPSILON * self.tick_hz > ON_TICK
    }
}
