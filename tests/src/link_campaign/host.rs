//! A correct host: the product's own client, and the messages to its user.
//!
//! It follows the steps of `hapterra run`: it opens a session, zeroes and arms, and closes the
//! session. All its deadlines are the client's own; the oracle checks them.

use std::time::Duration;

use hapterra::link::{Client, Event, HostRequest, LinkError, LinkStats, State, Timeouts};
use hapterra::terrain::Terrain;
use hapterra_core::guard::{Mode, Report};
use hapterra_core::scene::{Scene, TickRecord};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{SessionEnd, SessionNumber};

use crate::random::Random;

/// Seconds of a silent host after which the device disarms: the smallest value allowed.
pub const SILENCE_S: u16 = 5;
const TIMEOUTS: Timeouts = Timeouts {
    silence_s: SILENCE_S,
    ..Timeouts::REAL_TIME
};

/// End of a host.
#[derive(Debug)]
pub enum End {
    /// It closed the session, and reports success.
    Agreed,
    /// It reported a fault to its user.
    Reported(LinkError),
}

/// Report on arming to the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reported {
    /// Nothing yet.
    Nothing,
    /// The device will arm when the switch is pressed.
    Accepted,
    /// The device does not arm: refused, or unknown.
    No,
}

/// A host and its user.
pub struct Host<'t> {
    client: Client<'t>,
    /// End of the previous session, from the device's introduction.
    pub last_end: Option<SessionEnd>,
    /// True if the scene is active.
    pub opened: bool,
    /// True if it has requested arming.
    pub requested_arming: bool,
    /// The report to its user on that request.
    pub reported: Reported,
    /// State of the device's guard, as shown to its user.
    pub view: Option<Report>,
    /// Samples received since the last read.
    pub samples: Vec<TickRecord>,
    /// Its end.
    pub end: Option<End>,
}

impl<'t> Host<'t> {
    /// Starts a host that opens a session at `now`, ms, and writes its bytes to `out`.
    #[must_use]
    pub fn start(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        now: u64,
        random: &mut Random,
        out: &mut Vec<u8>,
    ) -> Self {
        let mut client = Client::numbered(terrain, scene, None, TIMEOUTS, random.bits());
        client.greet(Duration::from_millis(now), out);
        Self {
            client,
            last_end: None,
            opened: false,
            requested_arming: false,
            reported: Reported::Nothing,
            view: None,
            samples: Vec::new(),
            end: None,
        }
    }

    /// Returns the counts that its user sees.
    #[must_use]
    pub fn stats(&self) -> &LinkStats {
        self.client.stats()
    }

    /// Returns its session.
    #[must_use]
    pub fn session(&self) -> SessionNumber {
        self.client.session()
    }

    /// Requests to clear a fault, to zero the arm and to arm it.
    pub fn arm(&mut self) {
        self.requested_arming = true;
        let zero = Request::Zero { counts: [0; 3] };
        let fault = self.view.and_then(|view| view.fault);
        let clear = Request::ClearFault { fault };
        for request in [clear, zero, Request::Arm] {
            self.client.enqueue(HostRequest::Request(request));
        }
    }

    /// Closes the session at `now`, ms, and writes its bytes to `out`.
    pub fn leave(&mut self, now: u64, out: &mut Vec<u8>) {
        self.client.leave(Duration::from_millis(now), out);
    }

    /// Processes the bytes received by `now`, ms, and writes its own to `out`.
    pub fn step(&mut self, now: u64, bytes: &[u8], out: &mut Vec<u8>) {
        if self.end.is_some() {
            return;
        }
        let was_leaving = self.client.state() == State::Leaving;
        let result = self.process(Duration::from_millis(now), bytes, out);
        self.end = match result {
            Err(error) => Some(End::Reported(error)),
            Ok(()) if was_leaving && self.client.state() == State::Closed => Some(End::Agreed),
            Ok(()) => None,
        };
    }

    fn process(&mut self, now: Duration, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), LinkError> {
        let Self {
            client,
            last_end,
            opened,
            reported,
            view,
            samples,
            ..
        } = self;
        let mut on = |event: Event<'_>| match event {
            Event::Opened { device, .. } => {
                *opened = true;
                *last_end = Some(device.last.end);
            }
            Event::Sample(sample) => samples.push(*sample),
            Event::Guard(report) => *view = Some(*report),
            Event::Answered { request, result } if *request == Request::Arm => {
                *reported = match result {
                    Ok(()) => Reported::Accepted,
                    Err(_) => Reported::No,
                };
            }
            Event::Unanswered(HostRequest::Request(Request::Arm)) => *reported = Reported::No,
            _ => {}
        };
        client.receive(now, bytes, out, &mut on)?;
        client.append_due(now, out, &mut on)
    }

    /// Returns true if its user sees that the arm waits for the dead-man switch.
    #[must_use]
    pub fn is_waiting_for_press(&self) -> bool {
        self.is_in_mode(&[Mode::Requested])
    }

    /// Returns true if its user sees that the device is in one of these modes.
    #[must_use]
    pub fn is_in_mode(&self, modes: &[Mode]) -> bool {
        self.view.is_some_and(|view| modes.contains(&view.mode))
    }
}
