//! Handler of a session's events, while a terrain is served.

use hapterra_core::scene::SceneChange;

use crate::link::{Event, HostRequest, LinkStats};
use crate::terrain::Terrain;

/// Receives the events of a session, and states the requests to the device
/// and when there is enough of it.
pub trait SessionHandler<'t> {
    /// Receives an event of the device.
    fn take(&mut self, event: Event<'_>);

    /// Receives the state of the line, in words for the user.
    fn hear(&mut self, line: &str);

    /// Returns the requests to the device; read after each poll of the line.
    fn asks(&mut self) -> Vec<HostRequest>;

    /// Another view that is to be put in now, with its terrain; taken after each look at
    /// the line. An [`Event::Viewed`] tells what came of it.
    fn view(&mut self) -> Option<(SceneChange, Terrain<'t>)> {
        None
    }

    /// May show how it goes; called after each look at the line.
    fn show(&mut self, tally: &LinkStats);

    /// Returns true if it has seen enough.
    fn is_over(&self) -> bool;
}
