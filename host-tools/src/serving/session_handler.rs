//! Handler of a session's events, while a terrain is served.

use hapterra_core::scene::SceneChange;

use crate::link::{Event, HostRequest, LinkStats};
use crate::terrain::Terrain;

/// Receives the events of a session, and returns the requests to the device and the end of the
/// service.
pub trait SessionHandler<'t> {
    /// Receives an event of the device.
    fn on_event(&mut self, event: Event<'_>);

    /// Receives the state of the line, as text for the user.
    fn notify(&mut self, line: &str);

    /// Returns the requests to the device; read after each poll of the line.
    fn requests(&mut self) -> Vec<HostRequest>;

    /// Returns a scene change that is due, with its terrain; called after each poll of the line. An
    /// [`Event::SceneChangeResult`] reports its result.
    fn scene_change(&mut self) -> Option<(SceneChange, Terrain<'t>)> {
        None
    }

    /// Shows the progress, if wanted; called after each poll of the line.
    fn show(&mut self, stats: &LinkStats);

    /// Returns true if the service should end.
    fn is_over(&self) -> bool;
}
