//! Marks in a recording.

use serde::{Deserialize, Serialize};

use crate::steering::Made;

/// A moment that the user has named while a terrain was touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// The tick that was marked, as the column `tick` has it; none where the device has not
    /// answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tick: Option<u32>,
    /// Time of that tick, as the column `t_s` has it; that of the latest tick where there is none.
    pub t_s: f64,
    /// The host's clock when the mark was asked for, seconds since 1970 in UTC: before the tick,
    /// by what host and link take.
    pub host_unix_s: f64,
    /// The user's text: 1 to 200 characters, none of them a control character.
    pub text: String,
}

/// The mark alone, as TOML has it.
#[derive(Serialize)]
struct Marks<'m> {
    mark: [&'m Mark; 1],
}

impl Mark {
    /// A mark as it was made, with the time of its tick.
    #[must_use]
    pub fn new(made: Made, t_s: f64) -> Self {
        Self {
            tick: made.tick,
            t_s,
            host_unix_s: made.host_unix_s,
            text: made.text,
        }
    }

    /// The mark as TOML that may follow on
    /// [`Settings::to_toml`](super::settings::Settings::to_toml).
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&Marks { mark: [self] }).unwrap_or_default()
    }
}
