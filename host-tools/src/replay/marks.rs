//! Marks in a recording.

use serde::{Deserialize, Serialize};

use crate::steering::UserMark;

/// A moment that the user has named during a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// The marked tick, as in the column `tick`; `None` if the device has not answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tick: Option<u32>,
    /// Time of that tick, as in the column `t_s`; that of the latest tick if there is none.
    pub t_s: f64,
    /// The host's clock at the request, seconds since 1970 in UTC: earlier than the tick by the
    /// delay of host and link.
    pub host_unix_s: f64,
    /// The user's text: 1 to 200 characters, none of them a control character.
    pub text: String,
}

/// The mark alone, for TOML.
#[derive(Serialize)]
struct Marks<'m> {
    mark: [&'m Mark; 1],
}

impl Mark {
    /// Creates a mark with the time of its tick.
    #[must_use]
    pub fn new(made: UserMark, t_s: f64) -> Self {
        Self {
            tick: made.tick,
            t_s,
            host_unix_s: made.host_unix_s,
            text: made.text,
        }
    }

    /// Returns the mark as TOML that may follow
    /// [`Settings::to_toml`](super::settings::Settings::to_toml).
    #[must_use]
    pub fn to_toml(&self) -> String {
        toml::to_string(&Marks { mark: [self] }).unwrap_or_default()
    }
}
