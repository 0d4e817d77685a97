//! A client over a transport, and the clock that it is told.

use std::time::Duration;

use hapterra_core::scene::{Point, Scene};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::request::Request;

use super::client::{Arming, Client, Event};
use super::conversation::{Ask, State};
use super::error::LinkError;
use super::line::{LOOK, Line};
use super::patience::Patience;
use super::tally::Tally;
use super::transport::Transport;
use crate::terrain::Terrain;

/// A conversation with a device over a transport.
pub struct Session<'t> {
    client: Client<'t>,
    line: Line<'t>,
}

impl<'t> Session<'t> {
    /// Shakes hands, puts the scene in force and asks the device to arm, if
    /// `arming` says how.
    ///
    /// # Errors
    /// [`LinkError`]: nobody answers, another protocol, a scene refused.
    pub fn open(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        transport: Box<dyn Transport + 't>,
        patience: Patience,
    ) -> Result<(Self, DeviceHello), LinkError> {
        let mut session = Self {
            client: Client::new(terrain, scene, arming, patience),
            line: Line::new(transport),
        };
        let device = session.shake_hands(&|| true, &mut |_| {})?;
        Ok((session, device))
    }

    /// Goes on over a new transport after the old one was lost, for as long as `go_on`
    /// says so. Returns the device, whose hello tells in `epoch` what it still held.
    ///
    /// # Errors
    /// As [`Session::open`]; [`LinkError::Interrupted`].
    pub fn resume(
        &mut self,
        transport: Box<dyn Transport + 't>,
        go_on: &dyn Fn() -> bool,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<DeviceHello, LinkError> {
        self.line.replace(transport);
        self.shake_hands(go_on, on)
    }

    /// The scene that is served.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        self.client.scene()
    }

    /// Counts of what went over the link so far.
    #[must_use]
    pub const fn tally(&self) -> &Tally {
        self.client.tally()
    }

    /// How long it waits for what.
    #[must_use]
    pub const fn patience(&self) -> &Patience {
        self.client.patience()
    }

    /// Asks for something; an event tells what came of it. It goes out with the next
    /// poll, or when what was asked for before is answered.
    pub fn ask(&mut self, ask: Ask) {
        self.client.ask(ask);
    }

    /// Asks for something to be done, as [`Session::ask`].
    pub fn request(&mut self, request: Request) {
        self.ask(Ask::Request(request));
    }

    /// Has a point felt: an [`Event::Felt`] tells what is felt there.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn feel(&mut self, point: Point) -> Result<(), LinkError> {
        let line = &mut self.line;
        self.client.feel(line.now(), point, &mut line.out);
        line.flush()
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
        line.flush()?;
        let (now, bytes, out) = line.receive(wait)?;
        self.client.receive(now, bytes, out, on)?;
        line.flush()
    }

    /// Ends the session. The device has let its force out, switched its amplifiers off
    /// and dropped the scene when this returns; an emulated board ends its program.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`] where the device does not say so in time.
    pub fn say_goodbye(&mut self, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        self.client.leave(self.line.now(), &mut self.line.out);
        while self.client.state() != State::Closed {
            self.poll(LOOK, on).map_err(|error| {
                tracing::debug!(%error, "on the way to goodbye");
                LinkError::NotConfirmed
            })?;
        }
        Ok(())
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
}
