//! The columns that a recording of `run` and `demo` has after the usual ones: what the
//! loop and its guard did in the tick.

use hapterra_core::guard::Mode;
use hapterra_core::scene::TickRecord;

use super::recording::{Column, Value};
use super::state_name;

/// The loop's part of a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoopColumns {
    /// The view in which it was rendered, counted from 0.
    view: u32,
    state: &'static str,
    mode: &'static str,
    /// Names of the limits that made the force less, joined by spaces.
    limits: String,
}

impl LoopColumns {
    /// The columns.
    pub const COLUMNS: [Column; 4] = [
        Column::Text("state"),
        Column::Text("mode"),
        Column::Text("limits"),
        Column::Count("view"),
    ];

    /// The loop's part of a sample that was rendered in a view of the recording.
    #[must_use]
    pub fn of(sample: &TickRecord, view: usize) -> Self {
        let limits: Vec<_> = sample.limits.iter_names().map(|(name, _)| name).collect();
        Self {
            view: u32::try_from(view).unwrap_or(u32::MAX),
            state: state_name(sample.state),
            mode: mode_name(sample.mode),
            limits: limits.join(" "),
        }
    }

    /// The view in which it was rendered, counted from 0.
    #[must_use]
    pub const fn view(&self) -> u32 {
        self.view
    }

    /// The values, in the order of [`Self::COLUMNS`].
    #[must_use]
    pub fn values(&self) -> [Value<'_>; 4] {
        [
            Value::Text(self.state),
            Value::Text(self.mode),
            Value::Text(&self.limits),
            Value::Count(self.view),
        ]
    }
}

/// A mode's name in a recording.
#[must_use]
pub fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Disarmed => "disarmed",
        Mode::Requested => "requested",
        Mode::Confirming => "confirming",
        Mode::Ramping => "ramping",
        Mode::Armed => "armed",
        Mode::Fading => "fading",
    }
}
