//! The additional columns in a recording of `run` and `demo`: state of the loop and its guard in
//! the tick.

use hapterra_core::guard::Mode;
use hapterra_core::scene::TickRecord;

use super::recording::{Column, Value};
use super::state_name;

/// The loop's part of a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoopColumns {
    /// Number of the row's placement, from 0.
    view: u32,
    state: &'static str,
    mode: &'static str,
    /// Names of the limits that reduced the force, joined by spaces.
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

    /// Returns the loop's part of a sample in a placement of the recording.
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

    /// Returns the number of the row's placement, from 0.
    #[must_use]
    pub const fn view(&self) -> u32 {
        self.view
    }

    /// Returns the values, in the order of [`Self::COLUMNS`].
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

/// Returns a mode's name in a recording.
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
