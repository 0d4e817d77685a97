//! A client over a transport: greets, waits, and greets again after silence.

use std::time::{Duration, Instant};

use hapterra_core::scene::Scene;
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::ToDevice;

use super::client::{Arming, Client, Event};
use super::error::LinkError;
use super::tally::Tally;
use super::transport::Transport;
use crate::terrain::Terrain;

/// How long a device may be quiet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// After this much silence the host says hello again: what was lost on the
    /// way is asked for and answered anew, and nothing else changes.
    pub greet_again: Duration,
    /// After this much silence the device counts as gone.
    pub give_up: Duration,
}

impl Patience {
    /// For a device that runs in real time.
    pub const REAL_TIME: Self = Self {
        greet_again: Duration::from_millis(750),
        give_up: Duration::from_secs(4),
    };

    /// For an emulated board, whose speed is that of a shared machine.
    pub const EMULATED: Self = Self {
        greet_again: Duration::from_secs(20),
        give_up: Duration::from_secs(120),
    };
}

/// A conversation with a device over a transport.
pub struct Session<'t> {
    client: Client<'t>,
    transport: Box<dyn Transport + 't>,
    patience: Patience,
    heard: Instant,
    greeted: Instant,
    incoming: Box<[u8; 4096]>,
    out: Vec<u8>,
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
        let now = Instant::now();
        let mut session = Self {
            client: Client::new(terrain, scene, arming),
            transport,
            patience,
            heard: now,
            greeted: now,
            incoming: Box::new([0; 4096]),
            out: Vec::new(),
        };
        let device = session.shake_hands()?;
        Ok((session, device))
    }

    /// Goes on over a new transport after the old one was lost. Returns the
    /// device, whose hello tells in `epoch` what it still held.
    ///
    /// # Errors
    /// As [`Session::open`].
    pub fn resume(&mut self, transport: Box<dyn Transport + 't>) -> Result<DeviceHello, LinkError> {
        self.transport = transport;
        self.shake_hands()
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

    /// Sends a message.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn say(&mut self, message: &ToDevice<'_>) -> Result<(), LinkError> {
        self.client.say(message, &mut self.out);
        self.flush()
    }

    /// Waits for bytes from the device for at most `wait`, answers what it asks
    /// and reports what it tells.
    ///
    /// # Errors
    /// [`LinkError`], after which the session can be taken up again with
    /// [`Session::resume`].
    pub fn poll(&mut self, wait: Duration, on: &mut dyn FnMut(Event<'_>)) -> Result<(), LinkError> {
        let received = self
            .transport
            .receive(self.incoming.as_mut_slice(), wait)
            .map_err(LinkError::Gone)?;
        if received == 0 {
            return self.be_patient();
        }
        self.heard = Instant::now();
        let bytes = self.incoming.get(..received).unwrap_or(&[]);
        self.client.receive(bytes, &mut self.out, on)?;
        self.flush()
    }

    /// Ends the session; an emulated board ends its program.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn say_goodbye(&mut self) -> Result<(), LinkError> {
        self.say(&ToDevice::Bye)
    }

    fn shake_hands(&mut self) -> Result<DeviceHello, LinkError> {
        self.heard = Instant::now();
        self.greet()?;
        let mut opened = None;
        loop {
            self.poll(Duration::from_millis(100), &mut |event| {
                if let Event::Opened { device, .. } = event {
                    opened = Some(device.clone());
                }
            })?;
            if let Some(device) = opened {
                return Ok(device);
            }
        }
    }

    fn greet(&mut self) -> Result<(), LinkError> {
        self.greeted = Instant::now();
        self.client.greet(&mut self.out);
        self.flush()
    }

    fn be_patient(&mut self) -> Result<(), LinkError> {
        let quiet = self.heard.elapsed();
        if quiet >= self.patience.give_up {
            return Err(LinkError::Silent(quiet));
        }
        if quiet.min(self.greeted.elapsed()) >= self.patience.greet_again {
            tracing::debug!(?quiet, "saying hello again");
            return self.greet();
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), LinkError> {
        if self.out.is_empty() {
            return Ok(());
        }
        let sent = self.transport.send(&self.out);
        self.out.clear();
        sent.map_err(LinkError::Gone)
    }
}
