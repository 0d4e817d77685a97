//! The current session, the time since its host's last frame, and the end of the session before:
//! the device's table of states in [`hapterra_core::wire`].

use hapterra_core::wire::session::{
    LastSession, SILENCE_S, SampleCount, SessionEnd, SessionNumber,
};
use heapless::HistoryBuf;

/// Number of ended sessions that are stored: a late open message of one of them, from a buffer or a
/// host without an answer, does not open a session.
const MAX_ENDED_SESSIONS: usize = 8;

/// A host that waits for a press sends something every half second. A host that is silent for this
/// time, ms, cannot see the result of the press.
const ABSENT_MS: u32 = 2_000;

/// State of the session with a host. Only [`Session`] changes it:
///
/// | from | to | by |
/// | --- | --- | --- |
/// | any | open | [`Session::open`] |
/// | open, detached, ended by silence | closing | [`Session::begin_close`] |
/// | open | detached | [`Session::detach`] |
/// | closing | ended by its host | [`Session::answer_close`] |
/// | open, detached | ended by silence | [`Session::end_silent`] |
/// | ended by its host | acknowledged | [`Session::close`] |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SessionState {
    /// No host has sent an open message.
    Closed,
    /// A host has sent an open message.
    Open,
    /// The host has sent a close without an answer yet.
    Closing,
    /// The close was answered, or the host was silent for too long.
    Ended(SessionEnd),
    /// The host has only read the state and detached; the arm is unchanged.
    Detached,
    /// The host has received the answer.
    Acknowledged,
}

/// Meaning of an open message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OpenKind {
    /// A session begins.
    New,
    /// The session is open already: the host has missed the answer.
    Repeated,
    /// The session was ended without a request of its host.
    Ended(SessionEnd),
    /// The host has closed the session, and receives the answer.
    Stale,
}

/// The present session.
#[derive(Clone, Debug)]
pub(super) struct Session {
    state: SessionState,
    /// The session's number; arbitrary before the first session.
    number: SessionNumber,
    /// The number of the open message.
    pub(super) opened_by: u8,
    last: LastSession,
    /// The last sessions that have ended, the oldest first.
    ended_sessions: HistoryBuf<SessionNumber, MAX_ENDED_SESSIONS>,
    /// Maximum silence of the host, ticks.
    silence_ticks: u32,
    /// The tick of the last frame of this session.
    received_at: u32,
    /// True if the host's silence was reported.
    reported_absent: bool,
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
            ended_sessions: HistoryBuf::new(),
            silence_ticks: 0,
            received_at: 0,
            reported_absent: false,
            packed: 0,
            dropped_before: 0,
        }
    }

    pub(super) const fn number(&self) -> SessionNumber {
        self.number
    }

    /// Returns the end of the last session that was not detached.
    pub(super) const fn last(&self) -> LastSession {
        self.last
    }

    pub(super) const fn state(&self) -> SessionState {
        self.state
    }

    /// Records that the host has closed the session.
    pub(super) const fn begin_close(&mut self) {
        self.state = SessionState::Closing;
    }

    /// Records that the close was answered.
    pub(super) const fn answer_close(&mut self) {
        self.state = SessionState::Ended(SessionEnd::Goodbye);
    }

    /// Records that the host was silent for too long.
    pub(super) const fn end_silent(&mut self) {
        self.state = SessionState::Ended(SessionEnd::HostSilent);
    }

    /// Records that the host has detached.
    pub(super) const fn detach(&mut self) {
        self.state = SessionState::Detached;
    }

    /// Records that the host has received the answer to its close.
    pub(super) const fn close(&mut self) {
        self.state = SessionState::Acknowledged;
    }

    pub(super) fn is_closing(&self) -> bool {
        self.state == SessionState::Closing
    }

    pub(super) fn is_open(&self) -> bool {
        self.state == SessionState::Open
    }

    /// Returns true if the current session has this number. Messages of other sessions are ignored.
    pub(super) fn is_of(&self, session: SessionNumber) -> bool {
        self.state != SessionState::Closed && self.number == session
    }

    pub(super) fn classify_open(&self, session: SessionNumber) -> OpenKind {
        match self.state {
            _ if self.ended_sessions.as_slice().contains(&session) => {
                OpenKind::Ended(SessionEnd::Replaced)
            }
            _ if !self.is_of(session) => OpenKind::New,
            SessionState::Open => OpenKind::Repeated,
            SessionState::Ended(end @ SessionEnd::HostSilent) => OpenKind::Ended(end),
            _ => OpenKind::Stale,
        }
    }

    /// Begins a session by the open message of this number. `dropped` is the number of samples
    /// dropped since the device started.
    pub(super) fn open(&mut self, session: SessionNumber, hello: u8, dropped: u32) {
        let end = match self.state {
            // A detached session leaves no trace.
            SessionState::Closed | SessionState::Detached => SessionEnd::None,
            SessionState::Open | SessionState::Closing => SessionEnd::Replaced,
            SessionState::Ended(end) => end,
            SessionState::Acknowledged => SessionEnd::Goodbye,
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
            self.ended_sessions.write(self.number);
        }
        self.state = SessionState::Open;
        self.number = session;
        self.opened_by = hello;
        self.packed = 0;
        self.dropped_before = dropped;
    }

    /// Returns the count of the session's samples; `waiting` ones are packed but not sent yet.
    pub(super) const fn count(&self, waiting: u32, dropped: u32) -> SampleCount {
        SampleCount {
            sent: self.packed.wrapping_sub(waiting),
            dropped: dropped.wrapping_sub(self.dropped_before),
        }
    }

    /// Records a frame of this session in this tick.
    pub(super) const fn received(&mut self, tick: u32) {
        self.received_at = tick;
        self.reported_absent = false;
    }

    /// Sets the maximum silence of the host.
    pub(super) fn set_silence(&mut self, seconds: u16, tick_hz: u32) {
        let (min, max) = SILENCE_S;
        self.silence_ticks = u32::from(seconds.clamp(min, max)).saturating_mul(tick_hz);
    }

    /// Returns true if the host of the open session has been silent for [`ABSENT_MS`]; reported
    /// once until its next frame.
    pub(super) fn is_absent(&mut self, tick: u32, ticks_per_ms: u32) -> bool {
        let silent = tick.wrapping_sub(self.received_at);
        let is_absent = self.is_open() && silent >= ABSENT_MS.saturating_mul(ticks_per_ms);
        is_absent && !core::mem::replace(&mut self.reported_absent, true)
    }

    /// Returns true if the host of the session, open or detached, has been silent for too long.
    pub(super) fn is_timed_out(&self, tick: u32) -> bool {
        let has_begun = matches!(self.state, SessionState::Open | SessionState::Detached);
        has_begun && tick.wrapping_sub(self.received_at) >= self.silence_ticks
    }
}
