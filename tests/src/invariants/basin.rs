//! The proxy does not pass a crest: a flood fill, column by column, of the points no farther from
//! the HIP than its last position, starting there.

use std::collections::HashSet;

use super::Invariant;
use super::observed_tick::ObservedTick;
use super::oracle::{TickOracle, Verdict};
use super::surface::{distance, patches_at};

/// Moves shorter than this, in cells, pass no relevant crest.
const SHORT: f64 = 0.02;
/// HIPs farther than this, in cells, need too large a flood.
const MAX_DISTANCE: f64 = 4.0;
/// Columns over the reach of the HIP, if that is a cell or less: at least 64 a cell, and a whole
/// number, so that edges between patches lie in columns.
const COLUMNS: f64 = 256.0;
/// Tolerance of a channel between two columns, cells.
const SLACK: f64 = 0.02;

impl TickOracle<'_> {
    /// Checks that a path within reach joins the proxy with its last position.
    pub(super) fn check_basin(&self, before: &ObservedTick, observed: &ObservedTick) -> Verdict {
        let reach = distance(before.proxy, observed.hip);
        let is_checked = before.is_touching()
            && observed.is_touching()
            && reach < MAX_DISTANCE
            // Otherwise another check reports it.
            && distance(observed.proxy, observed.hip) <= reach + SLACK
            && distance(before.proxy, observed.proxy) > SHORT;
        if !is_checked {
            return Ok(());
        }
        let [from, to] = [before.proxy, observed.proxy].map(|at| [at[0], at[1]]);
        let is_open = |at| self.is_open(at, observed.hip, reach + SLACK);
        const MAX_SAMPLES: u32 = 64;
        let is_straight = (0..=MAX_SAMPLES).all(|sample| {
            let share = f64::from(sample) / f64::from(MAX_SAMPLES);
            is_open([0, 1].map(|i| from[i] + share * (to[i] - from[i])))
        });
        let columns = (COLUMNS / reach).clamp(64.0, 1_024.0).round();
        if is_straight || is_flooded(from, to, columns, is_open) {
            return Ok(());
        }
        let detail = format!("over a crest of more than {reach}: {before:?} then {observed:?}");
        self.fail(Invariant::Basin, detail)
    }

    /// Returns true if a column has a point of ground or air within `reach` of the HIP.
    fn is_open(&self, [x, y]: [f64; 2], hip: [f64; 3], reach: f64) -> bool {
        let up = reach * reach - (x - hip[0]).powi(2) - (y - hip[1]).powi(2);
        let ground = patches_at(self.terrain, x, y).map(|patch| patch.height(x, y));
        // Over no-data there is only air.
        let lowest = ground.reduce(f64::min).unwrap_or(f64::NEG_INFINITY);
        up >= 0.0 && lowest - hip[2] <= up.sqrt()
    }
}

/// Returns true if open columns join two points.
fn is_flooded(
    from: [f64; 2],
    to: [f64; 2],
    columns: f64,
    is_open: impl Fn([f64; 2]) -> bool,
) -> bool {
    let column = |at: [f64; 2]| at.map(|c| (c * columns).round() as i64);
    let (start, end) = (column(from), column(to));
    let mut reached = HashSet::from([start]);
    let mut edge = vec![start];
    while let Some([x, y]) = edge.pop() {
        if (x - end[0]).abs().max((y - end[1]).abs()) <= 1 {
            return true;
        }
        for next in [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]] {
            if is_open(next.map(|c| c as f64 / columns)) && reached.insert(next) {
                edge.push(next);
            }
        }
    }
    false
}
