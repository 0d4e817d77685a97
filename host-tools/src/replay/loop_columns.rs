//! The columns that a recording of `run` and `demo` has after the usual ones: what the
//! loop and its guard did in the tick.

use hapterra_core::guard::Mode;
use hapterra_core::scene::Sample;

use super::recording::{Column, Value};
use super::state_name;

/// The loop's part of a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoopColumns {
    state: &'static str,
    mode: &'static str,
    /// Names of the limits that made the force less, joined by spaces.
    limits: String,
}

impl LoopColumns {
    /// The columns.
    pub const COLUMNS: [Column; 3] = [
        Column::Text("state"),
        Column::Text("mode"),
        Column::Text("limits"),
    ];

    /// The loop's part of a sample.
    #[must_use]
    pub fn of(sample: &Sample) -> Self {
        let limits: Vec<_> = sample.limits.iter_names().map(|(name, _)| name).collect();
        Self {
            state: state_name(sample.state),
            mode: mode_name(sample.mode),
            limits: limits.join(" "),
        }
    }

    /// The values, in the order of [`Self::COLUMNS`].
    #[must_use]
    pub fn values(&self) -> [Value<'_>; 3] {
        [
            Value::Text(self.state),
            Value::Text(self.mode),
            Value::Text(&self.limits),
        ]
    }
}

fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Disarmed => "disarmed",
        Mode::Requested => "requested",
        Mode::Confirming => "confirming",
        Mode::Ramping => "ramping",
        Mode::Armed => "armed",
        Mode::Fading => "fading",
    }
}
