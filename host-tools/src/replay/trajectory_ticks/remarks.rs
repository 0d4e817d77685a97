//! Text about the relation of rows to ticks.

use hapterra_touch::ticks::{Counts, ODD_MOVE_S, Untimed};

/// Describes the relation of rows to ticks; `None` if each row was a tick by its own time.
pub(super) fn pace(counts: &Counts, hz: u32) -> Option<String> {
    let rows = counts.rows;
    Some(match counts.untimed {
        Some(Untimed::Missing) => {
            format!("one row of the path a tick, {hz} ticks a second: it has no t_s")
        }
        Some(Untimed::Same(t_s)) => {
            format!("one row of the path a tick, {hz} ticks a second: t_s is {t_s} in all of them")
        }
        Some(Untimed::Requested) => format!("one row of the path a tick, {hz} ticks a second"),
        None if rows == counts.ticks && counts.filled_in == 0 => return None,
        None => format!(
            "{hz} ticks a second by t_s, on straight lines between the {rows} rows of the path"
        ),
    })
}

/// Returns the remarks, one sentence each.
pub(super) fn remarks(counts: &Counts) -> Vec<String> {
    let longest = (counts.max_move_s * 1e6).round() / 1e6;
    let odd = counts.odd_moves;
    let remarks = [
        (
            odd,
            format!(
                "{odd} times the HIP moves for more than {ODD_MOVE_S} s between two rows, {longest} s at most: straight lines are rendered there. t_s is in seconds"
            ),
        ),
        (
            counts.passed_over,
            format!(
                "{} of {} rows lie between two ticks and are not rendered",
                counts.passed_over, counts.rows
            ),
        ),
        (
            counts.repeated,
            format!(
                "{} rows repeat time and place of the row before, and are left out",
                counts.repeated
            ),
        ),
        (
            counts.gaps,
            format!(
                "{} gaps of the recording are longer than 2 s, and nothing is filled in",
                counts.gaps
            ),
        ),
    ];
    let reported = remarks.into_iter().filter(|(count, _)| *count > 0);
    reported.map(|(_, remark)| remark).collect()
}
