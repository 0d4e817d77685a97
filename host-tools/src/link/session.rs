//! A client with a transport and its clock.

use std::time::Duration;

use hapterra_core::scene::{HipCommand, Scene, SceneChange};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::request::Request;

use super::client::{Arming, Client, Event};
use super::error::LinkError;
use super::host_protocol::State;
use super::host_request::HostRequest;
use super::line::{Line, POLL_INTERVAL};
use super::link_stats::LinkStats;
use super::timeouts::Timeouts;
use super::transport::Transport;
use crate::terrain::Terrain;

/// A conversation with a device over a transport.
pub struct Session<'t> {
    client: Client<'t>,
    line: Line<'t>,
    /// Returns false if the session should stop waiting for the device to read.
    should_continue: &'t dyn Fn() -> bool,
    /// Deadline for the close message and its answer.
    close_deadline: Option<Duration>,
}

impl<'t> Session<'t> {
    /// Creates a session that has sent nothing yet.
    #[must_use]
    pub fn new(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        transport: Box<dyn Transport + 't>,
        timeouts: Timeouts,
    ) -> Self {
        Self {
            client: Client::new(terrain, scene, arming, timeouts),
            line: Line::new(transport),
            should_continue: &|| true,
            close_deadline: None,
        }
    }

    /// Stops opening, and stops waiting for a slow device, when `should_continue` returns false.
    #[must_use]
    pub fn continuing_while(mut self, should_continue: &'t dyn Fn() -> bool) -> Self {
        self.should_continue = should_continue;
        self
    }

    /// Opens the session, puts the scene in force and requests arming if `arming` is set.
    ///
    /// # Errors
    /// [`LinkError`]: no answer, a different protocol, or a refused scene.
    pub fn open(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        transport: Box<dyn Transport + 't>,
        timeouts: Timeouts,
    ) -> Result<(Self, DeviceHello), LinkError> {
        let mut session = Self::new(terrain, scene, arming, transport, timeouts);
        let device = session.begin(&mut |_| {})?;
        Ok((session, device))
    }

    /// Opens the session over its present line. The session can also be closed if that fails.
    ///
    /// # Errors
    /// As [`Session::open`]; [`LinkError::Interrupted`].
    pub fn begin(&mut self, on: &mut dyn FnMut(Event<'_>)) -> Result<DeviceHello, LinkError> {
        self.handshake(self.should_continue, on)
    }

    /// Continues over a new transport after the old one was lost, as long as `should_continue` returns true.
    /// Returns the device, whose `epoch` is that of the scene it still had.
    ///
    /// # Errors
    /// As [`Session::open`]; [`LinkError::Interrupted`].
    pub fn resume(
        &mut self,
        transport: Box<dyn Transport + 't>,
        should_continue: &dyn Fn() -> bool,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<DeviceHello, LinkError> {
        self.switch_line(transport);
        self.handshake(should_continue, on)
    }

    /// Continues the present session over another line.
    pub fn switch_line(&mut self, transport: Box<dyn Transport + 't>) {
        self.line.replace(transport);
    }

    /// Closes the line. Some devices can be opened only once: another line to them can be opened
    /// after this call.
    pub fn close_line(&mut self) {
        self.line.close();
    }

    /// Returns true if the line is open.
    #[must_use]
    pub const fn has_line(&self) -> bool {
        self.line.is_open()
    }

    /// Returns the served scene.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        self.client.scene()
    }

    /// Returns the statistics of the link.
    #[must_use]
    pub const fn stats(&self) -> &LinkStats {
        self.client.stats()
    }

    /// Returns the time-outs.
    #[must_use]
    pub const fn timeouts(&self) -> &Timeouts {
        self.client.timeouts()
    }

    /// Adds a request; an event reports its result. The request is sent in the next poll, or when
    /// the earlier ones are answered.
    pub fn enqueue(&mut self, request: HostRequest) {
        self.client.enqueue(request);
    }

    /// Requests an action, as [`Session::request`].
    pub fn request(&mut self, request: Request) {
        self.enqueue(HostRequest::Request(request));
    }

    /// Puts a scene change in force, with its terrain; the clutch has to be open. An
    /// [`Event::SceneChangeResult`] reports the result.
    ///
    /// # Errors
    /// [`LinkError::Disconnected`].
    pub fn put_view(&mut self, view: SceneChange, terrain: Terrain<'t>) -> Result<(), LinkError> {
        let line = &mut self.line;
        self.client
            .put_view(line.now(), view, terrain, &mut line.out);
        self.flush()
    }

    /// Renders a point: an [`Event::Rendered`] reports the force there.
    ///
    /// # Errors
    /// [`LinkError::Disconnected`].
    pub fn step(&mut self, point: HipCommand) -> Result<(), LinkError> {
        self.client.step(self.line.now(), point, &mut self.line.out);
        self.flush()
    }

    /// Waits for bytes from the device for at most `wait`, answers its requests, sends the messages
    /// that are due and reports events.
    ///
    /// # Errors
    /// [`LinkError`]. After a passing one the session can continue with [`Session::resume`].
    pub fn poll(&mut self, wait: Duration, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        let line = &mut self.line;
        self.client.append_due(line.now(), &mut line.out, on)?;
        self.flush()?;
        let (now, bytes, out) = self.line.receive(wait)?;
        self.client.receive(now, bytes, out, on)?;
        self.flush()
    }

    /// Ends the session. When this returns, the device has ramped its force down, switched its
    /// amplifiers off and dropped the scene; an emulated board ends its program.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`] if the device does not confirm in time; [`LinkError::Taken`] if
    /// another host controls the device.
    pub fn close(&mut self, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        self.client.leave(self.line.now(), &mut self.line.out);
        // The user has ended the session, but the device must still receive the close message.
        self.should_continue = &|| true;
        self.close_deadline = Some(self.line.now() + self.client.timeouts().goodbye);
        while self.client.state() != State::Closed {
            self.poll(POLL_INTERVAL, on).map_err(|error| {
                tracing::debug!(%error, "while closing the session");
                match error {
                    LinkError::Taken => error,
                    _ => LinkError::NotConfirmed,
                }
            })?;
        }
        Ok(())
    }

    /// As [`Session::close`], for a device that was not opened yet: it disarms an arm that
    /// another host has left armed.
    ///
    /// # Errors
    /// As [`Session::close`].
    pub fn open_and_close(&mut self, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        self.client.greet(self.line.now(), &mut self.line.out);
        self.close(on)
    }

    fn handshake(
        &mut self,
        should_continue: &dyn Fn() -> bool,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<DeviceHello, LinkError> {
        self.client.greet(self.line.now(), &mut self.line.out);
        let mut opened = None;
        while should_continue() {
            self.poll(POLL_INTERVAL, &mut |event| {
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
        self.line
            .flush_while(self.close_deadline, self.should_continue)
    }
}
