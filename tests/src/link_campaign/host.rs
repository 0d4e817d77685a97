//! An honest host: the product's own client, and the messages to its user.
//!
//! It goes through the steps of `hapterra run`: it opens a session, zeroes and arms, and
//! takes its leave. All its deadlines are the client's own; the judge holds it to them.

use std::time::Duration;

use hapterra::link::{Client, Event, HostRequest, LinkError, LinkStats, State, Timeouts};
use hapterra::terrain::Terrain;
use hapterra_core::guard::{Mode, Report};
use hapterra_core::scene::{Scene, TickRecord};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{SessionEnd, SessionNumber};

use crate::random::Random;

/// For how many seconds the device lets an armed arm be while the host is silent: the
/// least that there is.
pub const SILENCE_S: u16 = 5;
const PATIENCE: Timeouts = Timeouts {
    silence_s: SILENCE_S,
    ..Timeouts::REAL_TIME
};

/// End of a host.
#[derive(Debug)]
pub enum End {
    /// It has taken its leave, and says that all is well.
    Agreed,
    /// It reported a fault to its user.
    Told(LinkError),
}

/// Report of arming to the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Told {
    /// Nothing yet.
    Nothing,
    /// That the device arms, when the switch is pressed.
    Accepted,
    /// That it does not: refused, or not known.
    No,
}

/// A host.
pub struct Host<'t> {
    client: Client<'t>,
    /// End of the session before, by the device's introduction.
    pub last_end: Option<SessionEnd>,
    /// True if the scene is in force.
    pub opened: bool,
    /// True if it has asked to arm.
    pub asked: bool,
    /// Its user's report of that.
    pub told: Told,
    /// State of the device's guard, as its user sees it.
    pub view: Option<Report>,
    /// Samples that came since they were last taken.
    pub samples: Vec<TickRecord>,
    /// Its end.
    pub end: Option<End>,
}

impl<'t> Host<'t> {
    /// A host that says hello at `now`, ms; what it says goes to `out`.
    #[must_use]
    pub fn start(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        now: u64,
        random: &mut Random,
        out: &mut Vec<u8>,
    ) -> Self {
        let mut client = Client::numbered(terrain, scene, None, PATIENCE, random.bits());
        client.greet(Duration::from_millis(now), out);
        Self {
            client,
            last_end: None,
            opened: false,
            asked: false,
            told: Told::Nothing,
            view: None,
            samples: Vec::new(),
            end: None,
        }
    }

    /// The counts that its user is shown.
    #[must_use]
    pub fn tally(&self) -> &LinkStats {
        self.client.tally()
    }

    /// Its session.
    #[must_use]
    pub fn session(&self) -> SessionNumber {
        self.client.session()
    }

    /// Asks to clear a fault, to zero the arm and to arm it.
    pub fn arm(&mut self) {
        self.asked = true;
        let zero = Request::Zero { counts: [0; 3] };
        let seen = self.view.and_then(|view| view.fault);
        let clear = Request::ClearFault { seen };
        for request in [clear, zero, Request::Arm] {
            self.client.ask(HostRequest::Request(request));
        }
    }

    /// Takes its leave at `now`, ms; what it says goes to `out`.
    pub fn leave(&mut self, now: u64, out: &mut Vec<u8>) {
        self.client.leave(Duration::from_millis(now), out);
    }

    /// Takes what has come by `now`, ms, and lets time pass; what it says goes to `out`.
    pub fn step(&mut self, now: u64, bytes: &[u8], out: &mut Vec<u8>) {
        if self.end.is_some() {
            return;
        }
        let was_leaving = self.client.state() == State::Leaving;
        let gone_on = self.go_on(Duration::from_millis(now), bytes, out);
        self.end = match gone_on {
            Err(error) => Some(End::Told(error)),
            Ok(()) if was_leaving && self.client.state() == State::Closed => Some(End::Agreed),
            Ok(()) => None,
        };
    }

    fn go_on(&mut self, now: Duration, bytes: &[u8], out: &mut Vec<u8>) -> Result<(), LinkError> {
        let Self {
            client,
            last_end,
            opened,
            told,
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
                *told = match result {
                    Ok(()) => Told::Accepted,
                    Err(_) => Told::No,
                };
            }
            Event::Unanswered(HostRequest::Request(Request::Arm)) => *told = Told::No,
            _ => {}
        };
        client.receive(now, bytes, out, &mut on)?;
        client.due(now, out, &mut on)
    }

    /// Returns true if its user sees that the arm waits for the dead-man switch.
    #[must_use]
    pub fn waits_for_the_hand(&self) -> bool {
        self.sees(&[Mode::Requested])
    }

    /// Returns true if its user sees that the device is in one of these modes.
    #[must_use]
    pub fn sees(&self, modes: &[Mode]) -> bool {
        self.view.is_some_and(|view| modes.contains(&view.mode))
    }
}
