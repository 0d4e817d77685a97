//! The ticks of a path of arrays, by the rule of `hapterra_touch::ticks`.

use std::convert::Infallible;

use hapterra_touch::ticks::{self, Counts, ODD_MOVE_S, Pace, Row, TickError, TimeFault};

/// Time, s, and HIP, mm.
pub(crate) type Tick = (f64, [f64; 3]);

/// Ticks of a path, and remarks on its times.
#[derive(Debug)]
pub(crate) struct Ticks {
    pub(crate) ticks: Vec<Tick>,
    pub(crate) remarks: Vec<String>,
}

/// Invalid times.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("t[{row}]: {fault}")]
pub(crate) struct TimeError {
    row: u64,
    fault: TimeFault,
}

impl Ticks {
    /// Returns the ticks at a rate from the first time to the last; without times, each position is
    /// a tick.
    pub(crate) fn of(path: &[[f64; 3]], t_s: Option<&[f64]>, hz: u32) -> Result<Self, TimeError> {
        let pace = match t_s {
            Some(_) => Pace::ByTime,
            None => Pace::RowByRow,
        };
        let rows = path.iter().enumerate().map(|(row, hip_mm)| {
            Ok::<_, Infallible>(Row {
                t_s: t_s.and_then(|t_s| t_s.get(row).copied()),
                hip_mm: *hip_mm,
                view: 0,
            })
        });
        let (mut ticks, mut all) = (ticks::Ticks::new(rows, pace, hz), Vec::new());
        for tick in &mut ticks {
            match tick {
                Ok(tick) => all.push((tick.t_s, tick.hip_mm)),
                Err(TickError::Row(never)) => match never {},
                Err(TickError::Time { row, fault }) => return Err(TimeError { row, fault }),
            }
        }
        let remarks = remarks(ticks.counts());
        Ok(Self {
            ticks: all,
            remarks,
        })
    }
}

/// Returns the remarks on times, a sentence each.
fn remarks(counts: &Counts) -> Vec<String> {
    let (odd, between, rows) = (counts.odd_moves, counts.passed_over, counts.rows);
    let repeated = counts.repeated;
    let remarks = [
        (
            odd,
            format!(
                "{odd} times the HIP moves for more than {ODD_MOVE_S} s between two rows, on straight lines: t is in seconds"
            ),
        ),
        (
            repeated,
            format!("{repeated} rows repeat time and place of the row before, and are left out"),
        ),
        (
            between,
            format!("{between} of {rows} rows lie between two ticks and are not sampled"),
        ),
    ];
    let remarks = remarks.into_iter().filter(|(count, _)| *count > 0);
    remarks.map(|(_, remark)| remark).collect()
}
