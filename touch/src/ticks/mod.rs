//! Conversion of a path to the ticks of a device.
//!
//! Tick `n` is at `t_s` of the first row plus `n` divided by the tick rate; the last one is not
//! later than the last row. The HIP of a tick is that of the row at its time, bit for bit, if a row
//! is within a hundredth of a tick; else it is interpolated linearly between the rows before and
//! after it. Rows between two ticks are not rendered, because an arm's encoders are not read
//! between ticks either.
//!
//! So a path whose rows are a tick apart is rendered row by row. The rows of a recording are a
//! whole number of ticks apart, mostly one: a device sends a sample a millisecond, and some may be
//! lost on the link.

mod by_time;
mod counts;
mod fault;

use alloc::collections::VecDeque;

use by_time::Timed;
pub use counts::{Counts, ODD_MOVE_S, Untimed};
pub use fault::{TickError, TimeFault};

/// Maximum distance of a row from a tick that it is at, in ticks: times are written with six
/// digits, or in single precision.
const ON_TICK: f64 = 0.01;

/// Rule that converts rows to ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// By the rows' own times. A file without times has one row a tick.
    ByTime,
    /// By the rows' own times, which are whole ticks: for a recording that is rendered with its
    /// settings. Nothing is interpolated between two placements and in gaps of more than 2 s.
    Recorded,
    /// One row a tick, whatever their times are.
    RowByRow,
}

/// A row of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s; `None` if the path has no times.
    pub t_s: Option<f64>,
    /// Position of the HIP, mm: east, north, up.
    pub hip_mm: [f64; 3],
    /// The placement in which the row was rendered; 0 for the first or only placement.
    pub view: u32,
}

/// The HIP in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Time of the tick, s: equal to that of its row, if it has one.
    pub t_s: f64,
    /// Position of the HIP, mm: east, north, up.
    pub hip_mm: [f64; 3],
    /// The placement of its row, or of the rows around it.
    pub view: u32,
}

/// An iterator over the ticks of a path, which reads the rows one by one. The first error ends it.
///
/// ```
/// use core::convert::Infallible;
/// use hapterra_touch::ticks::{Pace, Row, Ticks};
///
/// // 1 mm in 2 ms: at 1 kHz a tick lies between.
/// let row = |t_s, x| Ok::<_, Infallible>(Row { t_s: Some(t_s), hip_mm: [x, 0.0, 0.0], view: 0 });
/// let ticks = Ticks::new([row(0.0, 4.0), row(0.002, 5.0)].into_iter(), Pace::ByTime, 1000);
/// let x: Vec<_> = ticks.map(|tick| tick.unwrap().hip_mm[0]).collect();
/// assert_eq!(x, [4.0, 4.5, 5.0]);
/// ```
#[derive(Clone, Debug)]
pub struct Ticks<R> {
    rows: R,
    pace: Pace,
    due: Due,
    /// The last row whose time is not later than the latest tick's.
    before: Option<Timed>,
    /// The row after it, if it was read already.
    ahead: Option<Timed>,
    /// Rows that were read, and the number of repeats of each: a tick each.
    queued: VecDeque<(Row, u64)>,
    counts: Counts,
}

impl<R> Ticks<R> {
    /// Creates the ticks of a device with `tick_hz` ticks a second, at least 1.
    #[must_use]
    pub fn new(rows: R, pace: Pace, tick_hz: u32) -> Self {
        let untimed = (pace == Pace::RowByRow).then_some(Untimed::Requested);
        Self {
            rows,
            pace,
            due: Due::new(tick_hz),
            before: None,
            ahead: None,
            queued: VecDeque::new(),
            counts: Counts {
                untimed,
                ..Counts::default()
            },
        }
    }

    /// Returns the rows; the last one read is at or after the latest tick.
    pub const fn rows(&mut self) -> &mut R {
        &mut self.rows
    }

    /// Returns the counts of rows and ticks up to now, including odd times.
    #[must_use]
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }
}

impl<R, E> Iterator for Ticks<R>
where
    R: Iterator<Item = Result<Row, E>>,
{
    type Item = Result<Tick, TickError<E>>;

    fn next(&mut self) -> Option<Self::Item> {
        let tick = match self.pace {
            Pace::RowByRow => self.next_row(),
            Pace::ByTime | Pace::Recorded => self.next_by_time(),
        };
        self.counts.ticks += u64::from(matches!(tick, Ok(Some(_))));
        tick.transpose()
    }
}

impl<R, E> Ticks<R>
where
    R: Iterator<Item = Result<Row, E>>,
{
    /// Returns the next row as the next tick.
    fn next_row(&mut self) -> Result<Option<Tick>, TickError<E>> {
        while self.queued.front().is_some_and(|(_, times)| *times == 0) {
            self.queued.pop_front();
        }
        let row = match self.queued.front_mut() {
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
            return Err(self.time_error(TimeFault::TimesStart { from, to }));
        }
        let t_s = row.t_s.unwrap_or_default();
        if self.due.next == 0 && !self.due.is_coarse_at(t_s) {
            self.due.begin_s = t_s;
        }
        Ok(Some(self.tick_at(&row)))
    }

    /// Returns the next tick, at a row.
    fn tick_at(&mut self, row: &Row) -> Tick {
        let is_on_tick = |t_s: &f64| self.due.ticks_late(*t_s).abs() <= ON_TICK;
        let t_s = row.t_s.filter(is_on_tick).unwrap_or(self.due.time_s());
        self.due.next += 1;
        Tick {
            t_s,
            hip_mm: row.hip_mm,
            view: row.view,
        }
    }

    fn read(&mut self) -> Result<Option<Row>, TickError<E>> {
        let Some(row) = self.rows.next().transpose().map_err(TickError::Row)? else {
            return Ok(None);
        };
        self.counts.rows += 1;
        match row.t_s.is_none_or(f64::is_finite) {
            true => Ok(Some(row)),
            false => Err(self.time_error(TimeFault::NotFinite)),
        }
    }

    /// Returns the error of the latest row, whose time cannot follow the previous one.
    const fn time_error(&self, fault: TimeFault) -> TickError<E> {
        let row = self.counts.rows.saturating_sub(1);
        TickError::Time { row, fault }
    }
}

/// Time of the next tick.
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

    /// Returns the time of the next tick, s.
    fn time_s(&self) -> f64 {
        self.begin_s + self.next as f64 / self.tick_hz
    }

    /// Returns the ticks by which a time is later than the next tick.
    fn ticks_late(&self, t_s: f64) -> f64 {
        (t_s - self.time_s()) * self.tick_hz
    }

    /// Returns true if numbers near a time are too coarse to distinguish ticks.
    fn is_coarse_at(&self, t_s: f64) -> bool {
        t_s.abs() * f64::EPSILON * self.tick_hz > ON_TICK
    }
}
