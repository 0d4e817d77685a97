//! Conversion of rows to ticks by their times, with checks of the times.

use super::counts::Untimed;
use super::fault::{TickError, TimeFault};
use super::{ON_TICK, Pace, Row, Tick, Ticks};

/// Max duration of a move on one straight line, s: rows more than 2 s apart are not a hand's path.
const MAX_MOVE_S: f64 = 2.0;
/// Max duration of a rest between two rows, s: a longer one is probably another unit of time.
const MAX_REST_S: f64 = 600.0;

/// A row with a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timed {
    row: Row,
    t_s: f64,
    /// True if a tick was at the row or next to it.
    is_rendered: bool,
}

/// Next state after a row.
enum Next {
    /// A later row.
    Row(Timed),
    /// A row at which the ticks restart.
    Restart(Timed),
    /// All rows up to now have the same time, which is therefore unused.
    Untimed,
    /// The last row was read.
    End,
}

impl<R, E> Ticks<R>
where
    R: Iterator<Item = Result<Row, E>>,
{
    /// Returns the next tick by the rows' own times.
    pub(super) fn next_by_time(&mut self) -> Result<Option<Tick>, TickError<E>> {
        let Some(mut before) = self.before else {
            return self.first();
        };
        loop {
            let next = match self.ahead.take() {
                Some(row) => Next::Row(row),
                None => self.read_next(&before)?,
            };
            let mut ahead = match next {
                Next::Row(ahead) => ahead,
                Next::Restart(row) => return self.begin(row).map(Some),
                Next::Untimed => return self.next_row(),
                Next::End => return Ok(None),
            };
            let late = self.due.ticks_late(ahead.t_s);
            if late > ON_TICK {
                let tick = self.tick_between(&before, &ahead);
                (before.is_rendered, ahead.is_rendered) = (true, true);
                (self.before, self.ahead) = (Some(before), Some(ahead));
                return Ok(Some(tick));
            }
            self.counts.passed_over += u64::from(!before.is_rendered);
            ahead.is_rendered |= late >= -ON_TICK;
            self.before = Some(ahead);
            if late >= -ON_TICK {
                return Ok(Some(self.tick_at(&ahead.row)));
            }
            before = ahead;
        }
    }

    fn first(&mut self) -> Result<Option<Tick>, TickError<E>> {
        let Some(row) = self.read()? else {
            return Ok(None);
        };
        match row.t_s {
            Some(t_s) => self.begin(Timed::new(row, t_s)).map(Some),
            None => {
                self.counts.untimed = Some(Untimed::Missing);
                self.pace = Pace::RowByRow;
                self.queued.push_back((row, 1));
                self.next_row()
            }
        }
    }

    /// Returns tick 0, at a row.
    fn begin(&mut self, row: Timed) -> Result<Tick, TickError<E>> {
        if self.due.is_coarse_at(row.t_s) {
            return Err(self.time_error(TimeFault::TooLarge(row.t_s)));
        }
        (self.due.begin_s, self.due.next) = (row.t_s, 0);
        let is_rendered = true;
        self.before = Some(Timed { is_rendered, ..row });
        Ok(self.tick_at(&row.row))
    }

    /// Returns the next tick, on the straight line between two rows.
    fn tick_between(&mut self, before: &Timed, ahead: &Timed) -> Tick {
        let t_s = self.due.time_s();
        let share = (t_s - before.t_s) / (ahead.t_s - before.t_s);
        let pairs = before.row.hip_mm.iter().zip(ahead.row.hip_mm);
        let mut hip_mm = [0.0; 3];
        for (at, (from, to)) in hip_mm.iter_mut().zip(pairs) {
            *at = from + (to - from) * share;
        }
        self.due.next += 1;
        self.counts.filled_in += 1;
        Tick {
            t_s,
            hip_mm,
            view: ahead.row.view,
        }
    }

    /// Reads the next row that is later than `before`.
    fn read_next(&mut self, before: &Timed) -> Result<Next, TickError<E>> {
        let mut repeated = 0;
        // If all rows have one time, the times may have no meaning.
        let is_begin = self.counts.rows == 1 && self.pace == Pace::ByTime;
        loop {
            let row = self.read()?;
            let Some((row, t_s)) = row.and_then(|row| Some((row, row.t_s?))) else {
                self.counts.passed_over += u64::from(!before.is_rendered);
                return Ok(match is_begin && repeated > 0 {
                    true => self.switch_to_row_by_row(before, repeated, None),
                    false => Next::End,
                });
            };
            let is_still = row.hip_mm == before.row.hip_mm;
            if t_s != before.t_s {
                self.counts.repeated += repeated;
                return self.check_row(before, Timed::new(row, t_s), is_still);
            }
            if !is_still && is_begin {
                return Ok(self.switch_to_row_by_row(before, repeated, Some(row)));
            }
            if !is_still {
                return Err(self.time_error(TimeFault::TwoPositions(t_s)));
            }
            repeated += 1;
        }
    }

    /// Uses rows as ticks from now on: the first row was rendered, and the repeated rows have its
    /// time.
    fn switch_to_row_by_row(&mut self, first: &Timed, repeated: u64, row: Option<Row>) -> Next {
        self.counts.untimed = Some(Untimed::Same(first.t_s));
        self.pace = Pace::RowByRow;
        self.queued.push_back((first.row, repeated));
        self.queued.extend(row.map(|row| (row, 1)));
        Next::Untimed
    }

    /// Checks a row at another time than the one before it.
    fn check_row(
        &mut self,
        before: &Timed,
        row: Timed,
        is_still: bool,
    ) -> Result<Next, TickError<E>> {
        let (from, to) = (before.t_s, row.t_s);
        let step = to - from;
        let fault = match self.pace {
            _ if step < 0.0 => Some(TimeFault::Backwards { from, to }),
            Pace::Recorded => self.off_tick(from, to),
            _ if step > MAX_REST_S => Some(TimeFault::Rest { from, to, step }),
            _ if step > MAX_MOVE_S && !is_still => Some(TimeFault::Gap { from, to, step }),
            _ => None,
        };
        if let Some(fault) = fault {
            return Err(self.time_error(fault));
        }
        if self.pace == Pace::Recorded {
            let is_gap = step > MAX_MOVE_S;
            self.counts.gaps += u64::from(is_gap);
            if is_gap || row.row.view != before.row.view {
                return Ok(Next::Restart(row));
            }
        } else if !is_still {
            self.counts.count_move(step);
        }
        Ok(Next::Row(row))
    }

    /// Returns the fault if a time contradicts the rate of a recording.
    fn off_tick(&self, from: f64, to: f64) -> Option<TimeFault> {
        let late = self.due.ticks_late(to);
        let is_tick = late >= -ON_TICK && (late - libm::round(late)).abs() <= ON_TICK;
        let ticks = libm::round((to - from) * self.due.tick_hz * 1e3) / 1e3;
        let tick_hz = self.due.tick_hz;
        (!is_tick).then_some(TimeFault::OffTick { to, ticks, tick_hz })
    }
}

impl Timed {
    const fn new(row: Row, t_s: f64) -> Self {
        Self {
            row,
            t_s,
            is_rendered: false,
        }
    }
}
