//! Which session is heard, since when its host was silent, and what became of the
//! session before: the device's table of states in [`hapterra_core::wire`].

use hapterra_core::wire::session::{
    LastSession, SILENCE_S, SampleCount, SessionEnd, SessionNumber,
};
use heapless::HistoryBuf;

/// Sessions that are over and are known: a hello of one of them, which some buffer has kept
/// or whose host has heard of no other, opens none.
const KNOWN: usize = 8;

/// A host that waits for a press sends something every half second. One that has sent nothing
/// for so long, ms, is not there to see what the press does.
const ABSENT_MS: u32 = 2_000;

/// State of the conversation with a host. [`Session`] alone changes it:
///
/// | from | to | by |
/// | --- | --- | --- |
/// | any | open | [`Session::open`] |
/// | open, detached, ended by silence | leaving | [`Session::leave`] |
/// | open | detached | [`Session::detach`] |
/// | leaving | ended by goodbye | [`Session::answer_goodbye`] |
/// | open, detached | ended by silence | [`Session::end_silent`] |
/// | ended by goodbye | gone | [`Session::close`] |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SessionState {
    /// No host has sent a hello.
    Closed,
    /// A host has sent a hello.
    Open,
    /// The host has sent a close, and was not answered yet.
    Leaving,
    /// It was answered, or the host was silent for too long.
    Ended(SessionEnd),
    /// The host has looked and is gone; the arm is as it was.
    Detached,
    /// The host has heard the answer.
    Gone,
}

/// Meaning of a hello.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Greeting {
    /// A session begins.
    Opens,
    /// The session is open already: the host has missed the answer.
    Again,
    /// Its session is over in a way that its host has not asked for.
    Over(SessionEnd),
    /// Its host has closed the session, and gets the answer.
    Stale,
}

/// The present session.
#[derive(Clone, Debug)]
pub(super) struct Session {
    state: SessionState,
    /// The session; any before the first.
    number: SessionNumber,
    /// The number of the hello that opened it.
    pub(super) opened_by: u8,
    last: LastSession,
    /// The last sessions that are over, the oldest first.
    over: HistoryBuf<SessionNumber, KNOWN>,
    /// Ticks for which the host may be silent.
    silence_ticks: u32,
    /// The tick of the last frame of this session.
    heard_at: u32,
    /// The host's silence was reported.
    told_absent: bool,
    /// Samples put into telemetry.
    pub(super) packed: u32,
    /// The device's count of dropped samples when the session was opened.
    dropped_before: u32,
}

impl Session {
    pub(super) const fn new() -> Self {
        Self {
            state: SessionState::Closed,
            number: SessionNumber::new(0),
            opened_by: 0,
            last: LastSession {
                session: 0,
                opened_by: 0,
                end: SessionEnd::None,
                count: SampleCount {
                    sent: 0,
                    dropped: 0,
                },
            },
            over: HistoryBuf::new(),
            silence_ticks: 0,
            heard_at: 0,
            told_absent: false,
            packed: 0,
            dropped_before: 0,
        }
    }

    pub(super) const fn number(&self) -> SessionNumber {
        self.number
    }

    /// The session before this one that was not detached.
    pub(super) const fn last(&self) -> LastSession {
        self.last
    }

    pub(super) const fn state(&self) -> SessionState {
        self.state
    }

    /// The host has closed the session.
    pub(super) const fn leave(&mut self) {
        self.state = SessionState::Leaving;
    }

    /// The host that leaves was answered.
    pub(super) const fn answer_goodbye(&mut self) {
        self.state = SessionState::Ended(SessionEnd::Goodbye);
    }

    /// The host was silent for too long.
    pub(super) const fn end_silent(&mut self) {
        self.state = SessionState::Ended(SessionEnd::HostSilent);
    }

    /// The host has looked and is gone.
    pub(super) const fn detach(&mut self) {
        self.state = SessionState::Detached;
    }

    /// The host has heard the answer to its goodbye.
    pub(super) const fn close(&mut self) {
        self.state = SessionState::Gone;
    }

    pub(super) fn is_leaving(&self) -> bool {
        self.state == SessionState::Leaving
    }

    pub(super) fn is_open(&self) -> bool {
        self.state == SessionState::Open
    }

    /// Returns true if there is a session of this number. What belongs to another is not
    /// heard.
    pub(super) fn is_of(&self, session: SessionNumber) -> bool {
        self.state != SessionState::Closed && self.number == session
    }

    pub(super) fn greeting(&self, session: SessionNumber) -> Greeting {
        match self.state {
            _ if self.over.as_slice().contains(&session) => Greeting::Over(SessionEnd::Replaced),
            _ if !self.is_of(session) => Greeting::Opens,
            SessionState::Open => Greeting::Again,
            SessionState::Ended(end @ SessionEnd::HostSilent) => Greeting::Over(end),
            _ => Greeting::Stale,
        }
    }

    /// Begins a session with the hello of this number. `dropped` samples were dropped since
    /// the device started.
    pub(super) fn open(&mut self, session: SessionNumber, hello: u8, dropped: u32) {
        let end = match self.state {
            // Who has only looked leaves no trace.
            SessionState::Closed | SessionState::Detached => SessionEnd::None,
            SessionState::Open | SessionState::Leaving => SessionEnd::Replaced,
            SessionState::Ended(end) => end,
            SessionState::Gone => SessionEnd::Goodbye,
        };
        if end != SessionEnd::None {
            self.last = LastSession {
                session: self.number.get(),
                opened_by: self.opened_by,
                end,
                count: self.count(0, dropped),
            };
        }
        if self.state != SessionState::Closed {
            self.over.write(self.number);
        }
        self.state = SessionState::Open;
        self.number = session;
        self.opened_by = hello;
        self.packed = 0;
        self.dropped_before = dropped;
    }

    /// The session's samples, of which some are packed and wait for the line.
    pub(super) const fn count(&self, waiting: u32, dropped: u32) -> SampleCount {
        SampleCount {
            sent: self.packed.wrapping_sub(waiting),
            dropped: dropped.wrapping_sub(self.dropped_before),
        }
    }

    /// A frame of this session came at this tick.
    pub(super) const fn heard(&mut self, tick: u32) {
        self.heard_at = tick;
        self.told_absent = false;
    }

    /// Takes for how long the host may be silent.
    pub(super) fn set_silence(&mut self, seconds: u16, tick_hz: u32) {
        let (least, most) = SILENCE_S;
        self.silence_ticks = u32::from(seconds.clamp(least, most)).saturating_mul(tick_hz);
    }

    /// Returns true if the host of the open session has been silent for [`ABSENT_MS`]; reported once
    /// until it is heard again.
    pub(super) fn is_absent(&mut self, tick: u32, ticks_per_ms: u32) -> bool {
        let silent = tick.wrapping_sub(self.heard_at);
        let is_absent = self.is_open() && silent >= ABSENT_MS.saturating_mul(ticks_per_ms);
        is_absent && !core::mem::replace(&mut self.told_absent, true)
    }

    /// Returns true if the host of the session that is open, or was detached, has been silent for
    /// too long.
    pub(super) fn is_forsaken(&self, tick: u32) -> bool {
        let has_begun = matches!(self.state, SessionState::Open | SessionState::Detached);
        has_begun && tick.wrapping_sub(self.heard_at) >= self.silence_ticks
    }
}
