//! A client over a transport, and its clock.

use std::time::Duration;

use hapterra_core::scene::{HipCommand, Scene, SceneChange};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::request::Request;

use super::client::{Arming, Client, Event};
use super::error::LinkError;
use super::host_protocol::State;
use super::host_request::HostRequest;
use super::line::{LOOK, Line};
use super::link_stats::LinkStats;
use super::timeouts::Timeouts;
use super::transport::Transport;
use crate::terrain::Terrain;

/// A conversation with a device over a transport.
pub struct Session<'t> {
    client: Client<'t>,
    line: Line<'t>,
    /// True if it is to continue; what a device does not read is not waited for else.
    goes_on: &'t dyn Fn() -> bool,
    /// Until then the close has to be sent and answered.
    leaves_by: Option<Duration>,
}

impl<'t> Session<'t> {
    /// A session that has sent nothing yet.
    #[must_use]
    pub fn new(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        transport: Box<dyn Transport + 't>,
        patience: Timeouts,
    ) -> Self {
        Self {
            client: Client::new(terrain, scene, arming, patience),
            line: Line::new(transport),
            goes_on: &|| true,
            leaves_by: None,
        }
    }

    /// The same session, which ends its beginning, and what a device is slow to read, when
    /// `goes_on` says no.
    #[must_use]
    pub fn heeding(mut self, goes_on: &'t dyn Fn() -> bool) -> Self {
        self.goes_on = goes_on;
        self
    }

    /// Shakes hands, puts the scene in force and asks the device to arm, if
    /// `arming` says how.
    ///
    /// # Errors
    /// [`LinkError`]: no answer, another protocol, a scene refused.
    pub fn open(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        transport: Box<dyn Transport + 't>,
        patience: Timeouts,
    ) -> Result<(Self, DeviceHello), LinkError> {
        let mut session = Self::new(terrain, scene, arming, transport, patience);
        let device = session.begin(&mut |_| {})?;
        Ok((session, device))
    }

    /// Shakes hands over the line that it has. The session can be closed if
    /// that fails, too.
    ///
    /// # Errors
    /// As [`Session::open`]; [`LinkError::Interrupted`].
    pub fn begin(&mut self, on: &mut dyn FnMut(Event<'_>)) -> Result<DeviceHello, LinkError> {
        self.shake_hands(self.goes_on, on)
    }

    /// Continues over a new transport after the old one was lost, for as long as `go_on`
    /// returns true. Returns the device, whose hello tells in `epoch` what it still held.
    ///
    /// # Errors
    /// As [`Session::open`]; [`LinkError::Interrupted`].
    pub fn resume(
        &mut self,
        transport: Box<dyn Transport + 't>,
        go_on: &dyn Fn() -> bool,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<DeviceHello, LinkError> {
        self.go_over(transport);
        self.shake_hands(go_on, on)
    }

    /// Goes over to another line, in the session that it is in.
    pub fn go_over(&mut self, transport: Box<dyn Transport + 't>) {
        self.line.replace(transport);
    }

    /// Closes the line. Some devices can be opened once only: another line to them comes
    /// after this one is closed.
    pub fn hang_up(&mut self) {
        self.line.hang_up();
    }

    /// Returns true if it has a line.
    #[must_use]
    pub const fn has_line(&self) -> bool {
        self.line.is_open()
    }

    /// The scene that is served.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        self.client.scene()
    }

    /// Statistics of the link.
    #[must_use]
    pub const fn tally(&self) -> &LinkStats {
        self.client.tally()
    }

    /// Time-outs.
    #[must_use]
    pub const fn patience(&self) -> &Timeouts {
        self.client.patience()
    }

    /// Asks for something; an event tells what came of it. It goes out with the next
    /// poll, or when what was asked for before is answered.
    pub fn ask(&mut self, ask: HostRequest) {
        self.client.ask(ask);
    }

    /// Asks for something to be done, as [`Session::ask`].
    pub fn request(&mut self, request: Request) {
        self.ask(HostRequest::Request(request));
    }

    /// Puts another view of the scene in, of this terrain; the clutch has to be open. An
    /// [`Event::Viewed`] tells what came of it.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn put_view(&mut self, view: SceneChange, terrain: Terrain<'t>) -> Result<(), LinkError> {
        let line = &mut self.line;
        self.client
            .put_view(line.now(), view, terrain, &mut line.out);
        self.flush()
    }

    /// Renders a point: an [`Event::Rendered`] reports the force there.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn step(&mut self, point: HipCommand) -> Result<(), LinkError> {
        self.client.step(self.line.now(), point, &mut self.line.out);
        self.flush()
    }

    /// Waits for bytes from the device for at most `wait`, answers what it asks,
    /// says what is due and reports what it tells.
    ///
    /// # Errors
    /// [`LinkError`]. After one that is passing the session can be taken up again with
    /// [`Session::resume`].
    pub fn poll(&mut self, wait: Duration, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        let line = &mut self.line;
        self.client.due(line.now(), &mut line.out, on)?;
        self.flush()?;
        let (now, bytes, out) = self.line.receive(wait)?;
        self.client.receive(now, bytes, out, on)?;
        self.flush()
    }

    /// Ends the session. The device has let its force out, switched its amplifiers off
    /// and dropped the scene when this returns; an emulated board ends its program.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`] where the device does not say so in time;
    /// [`LinkError::Taken`] where another host has taken the device.
    pub fn say_goodbye(&mut self, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        self.client.leave(self.line.now(), &mut self.line.out);
        // The user wants the end, and the end is to be heard.
        self.goes_on = &|| true;
        self.leaves_by = Some(self.line.now() + self.client.patience().goodbye);
        while self.client.state() != State::Closed {
            self.poll(LOOK, on).map_err(|error| {
                tracing::debug!(%error, "while closing the session");
                match error {
                    LinkError::Taken => error,
                    _ => LinkError::NotConfirmed,
                }
            })?;
        }
        Ok(())
    }

    /// As [`Session::say_goodbye`], to a device that was not greeted yet: what another
    /// host has left armed is disarmed.
    ///
    /// # Errors
    /// As [`Session::say_goodbye`].
    pub fn say_hello_and_goodbye(
        &mut self,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        self.client.greet(self.line.now(), &mut self.line.out);
        self.say_goodbye(on)
    }

    fn shake_hands(
        &mut self,
        go_on: &dyn Fn() -> bool,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<DeviceHello, LinkError> {
        self.client.greet(self.line.now(), &mut self.line.out);
        let mut opened = None;
        while go_on() {
            self.poll(LOOK, &mut |event| {
                if let Event::Opened { device, .. } = event {
                    opened = Some(device.clone());
                }
                on(event);
            })?;
            if let Some(device) = opened {
                return Ok(device);
            }
        }
        Err(LinkError::Interrupted)
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        self.line.flush_while(self.leaves_by, self.goes_on)
    }
}
