//! Names of the proxy's states in recordings and events.

use hapterra_core::contact::ContactState;

/// Names in recordings of earlier versions, and today's.
const EARLIER: [(&str, &str); 2] = [("waiting", "unseeded"), ("letting go", "releasing")];

/// Returns a state's name in a recording.
#[must_use]
pub const fn state_name(state: ContactState) -> &'static str {
    match state {
        ContactState::Unseeded => "unseeded",
        ContactState::Free => "free",
        ContactState::Touching => "touching",
        ContactState::Releasing => "releasing",
    }
}

/// Replaces an earlier version's name with today's.
pub(super) fn update_name(name: &mut String) {
    if let Some((_, now)) = EARLIER.iter().find(|(earlier, _)| earlier == name) {
        *name = (*now).to_owned();
    }
}
