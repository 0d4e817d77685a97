//! The host's states of [`hapterra_core::wire`], as a state machine without I/O and without a
//! clock: the caller passes the time.

use std::time::Duration;

use hapterra_core::force::MaterialTable;
use hapterra_core::scene::{Scene, SceneChange};
use hapterra_core::wire::hello::{DeviceHello, HostHello, PROTOCOL};
use hapterra_core::wire::materials::{MAX_TABLE_BYTES, MaterialScene, table_bytes};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::{Answer, Request};
use hapterra_core::wire::session::{InSession, SessionEnd, SessionNumber};
use hapterra_core::wire::version::VersionCheck;

use super::error::LinkError;
use super::host_request::HostRequest;
use super::messages::append;
use super::request_queue::RequestQueue;
use super::timeouts::Timeouts;

/// State of the session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing was sent yet, or the close or detach message was answered.
    Closed,
    /// The open message was sent.
    Greeting,
    /// The scene was sent.
    SceneSent,
    /// The scene is in force.
    Open,
    /// The close message was sent.
    Leaving,
    /// The detach message was sent: the arm stays as it is.
    Detaching,
}

/// Meaning of a device's message for the session.
#[derive(Debug)]
pub(super) enum ProtocolEvent {
    /// The device has introduced itself: its samples are numbered from zero. `restarted` is set if
    /// it was in this session before and has lost its state.
    HelloReceived {
        device: DeviceHello,
        restarted: bool,
    },
    /// The scene is in force.
    SceneAck,
    /// The scene change was answered.
    SceneChange { accepted: bool },
    /// This message answers the request.
    Answered(HostRequest, ToHost),
    /// A message that the protocol itself does not consume.
    Other(ToHost),
}

/// Change in contact that the device has accepted.
#[derive(Clone, Copy, Debug)]
struct ChangeInContact {
    /// The scene before, which the device has again after a cancel.
    before: Scene,
    number: u8,
    /// True if its cancel was requested.
    is_cancelled: bool,
}

/// The host's side of a session with a device, with or without a scene.
#[derive(Clone, Debug)]
pub(super) struct HostProtocol {
    numbers: fastrand::Rng,
    session: SessionNumber,
    /// The number of the open message that opened it; zero until the device has sent it.
    opened_by: u8,
    /// The session before, and the number of its open message; its last frames do not mean another
    /// host.
    previous: Option<(SessionNumber, u8)>,
    /// True if the device has answered in this session.
    confirmed: bool,
    scene: Option<Scene>,
    /// The scene's material table, if it has one.
    materials: Option<MaterialTable>,
    /// The unanswered scene change, and the times when it was first and last sent.
    view: Option<(SceneChange, Duration, Duration)>,
    /// The latest change in contact, until it is rendered.
    in_contact: Option<ChangeInContact>,
    /// True if the scene before a change was restored since the last call of
    /// [`HostProtocol::take_restored`].
    is_restored: bool,
    timeouts: Timeouts,
    state: State,
    /// The time when the state began, and when its message was last sent.
    since: Duration,
    sent_at: Duration,
    /// Time of the last answer.
    received: Duration,
    heartbeat_at: Duration,
    heartbeat_due: bool,
    /// Time of the last frame of another session.
    foreign: Option<Duration>,
    /// The number of the last open message; true if it was answered.
    hello_number: u8,
    hello_answered: bool,
    requests: RequestQueue,
}

impl HostProtocol {
    pub(super) fn new(
        scene: Option<Scene>,
        timeouts: Timeouts,
        mut numbers: fastrand::Rng,
    ) -> Self {
        let session = SessionNumber::new(numbers.u32(..));
        Self {
            numbers,
            session,
            opened_by: 0,
            previous: None,
            confirmed: false,
            scene,
            materials: None,
            view: None,
            in_contact: None,
            is_restored: false,
            timeouts,
            state: State::Closed,
            since: Duration::ZERO,
            sent_at: Duration::ZERO,
            received: Duration::ZERO,
            heartbeat_at: Duration::ZERO,
            heartbeat_due: false,
            foreign: None,
            hello_number: 0,
            hello_answered: true,
            requests: RequestQueue::default(),
        }
    }

    /// Returns the same protocol, for a scene with materials.
    #[must_use]
    pub(super) fn with_materials(self, table: Option<&MaterialTable>) -> Self {
        Self {
            materials: table.cloned(),
            ..self
        }
    }

    pub(super) const fn state(&self) -> State {
        self.state
    }

    pub(super) const fn session(&self) -> SessionNumber {
        self.session
    }

    /// Returns the session before the present one, and the number of its open message.
    pub(super) const fn previous(&self) -> Option<(SessionNumber, u8)> {
        self.previous
    }

    pub(super) const fn timeouts(&self) -> &Timeouts {
        &self.timeouts
    }

    /// Begins a session, or begins again over a new line. Returns true if a new session number was
    /// drawn: an unanswered session keeps its number, so that the device opens no session that the
    /// host has forgotten.
    pub(super) fn greet(&mut self, now: Duration, out: &mut Vec<u8>) -> bool {
        let is_new = self.confirmed || self.foreign.is_some();
        if is_new {
            self.previous = Some((self.session, self.opened_by));
            self.session = SessionNumber::new(self.numbers.u32(..));
            self.confirmed = false;
            self.opened_by = 0;
        }
        self.foreign = None;
        self.requests.begin_session();
        self.enter(State::Greeting, now);
        self.append_state(now, out);
        is_new
    }

    /// Ends the session; the device disarms.
    pub(super) fn leave(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.begin_ending(State::Leaving, now, out);
    }

    /// Ends the session, and leaves the arm and the scene as they are.
    pub(super) fn detach(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.begin_ending(State::Detaching, now, out);
    }

    fn begin_ending(&mut self, state: State, now: Duration, out: &mut Vec<u8>) {
        if self.state == State::Closed || self.is_ending() {
            return;
        }
        self.requests.give_up();
        self.requests.take_unanswered();
        self.enter(state, now);
        self.append_state(now, out);
    }

    /// Returns true if the close or detach message was sent and is not answered.
    pub(super) const fn is_ending(&self) -> bool {
        matches!(self.state, State::Leaving | State::Detaching)
    }

    /// Puts a scene in force, in place of an earlier one.
    pub(super) fn put_scene(&mut self, scene: Scene, now: Duration, out: &mut Vec<u8>) {
        self.scene = Some(scene);
        self.enter(State::SceneSent, now);
        self.append_state(now, out);
    }

    /// Sends a scene change until it is answered; it replaces an unanswered one.
    pub(super) fn put_view(&mut self, view: SceneChange, now: Duration, out: &mut Vec<u8>) {
        self.view = Some((view, now, now));
        self.in_contact = None;
        self.requests.drop_cancels();
        if self.state == State::Open {
            self.append_message(&ToDevice::SceneChange(view), out);
        }
    }

    /// Removes and returns the scene change if it is still unanswered after `give_up`.
    pub(super) fn take_unanswered_view(&mut self, now: Duration) -> Option<SceneChange> {
        let give_up = self.timeouts.give_up;
        let is_lost = |since: Duration| now.saturating_sub(since) >= give_up;
        let lost = self.view.take_if(|(_, since, _)| is_lost(*since));
        lost.map(|(view, _, _)| view)
    }

    /// Repeats the scene change if it is due.
    fn repeat_view(&mut self, now: Duration, out: &mut Vec<u8>) {
        if let Some((view, since, sent_at)) = self.view
            && self.is_due(sent_at, now)
        {
            self.view = Some((view, since, now));
            self.append_message(&ToDevice::SceneChange(view), out);
        }
    }

    /// Determines from the device's scene whether the unanswered placement is in force.
    fn resolve_view(&mut self, epoch: Option<u32>) {
        if let Some((view, _, _)) = self.view.take()
            && epoch == Some(view.scene.epoch)
        {
            self.accept_view(&view);
        }
    }

    fn accept_view(&mut self, view: &SceneChange) {
        let before = self.scene.replace(view.scene);
        // Equal scenes have equal epochs: a report of the epoch then does not mean a cancel.
        let is_before =
            |before: &Scene| view.in_contact.is_some() && before.epoch != view.scene.epoch;
        self.in_contact = before.filter(is_before).map(|before| ChangeInContact {
            before,
            number: view.number,
            is_cancelled: false,
        });
    }

    /// Records that the device renders the placement with this number. Returns true if it is that
    /// of the latest change, which can no longer be cancelled.
    pub(super) fn on_rendered(&mut self, number: u8) -> bool {
        let change = self.in_contact.take_if(|change| change.number == number);
        change.is_some()
    }

    /// Returns to the scene before the latest change if a cancel was requested and the device
    /// reports that scene's epoch.
    fn restore_reported_scene(&mut self, epoch: Option<u32>) {
        if let Some(change) = &self.in_contact
            && change.is_cancelled
            && epoch == Some(change.before.epoch)
        {
            self.restore_scene();
        }
    }

    /// Returns to the scene before the latest change.
    fn restore_scene(&mut self) {
        if let Some(change) = self.in_contact.take() {
            self.scene = Some(change.before);
            self.is_restored = true;
            self.requests.drop_cancels();
        }
    }

    /// Returns true if the scene before a change was restored since the last call.
    pub(super) const fn take_restored(&mut self) -> bool {
        std::mem::replace(&mut self.is_restored, false)
    }

    /// Returns the requested scene.
    pub(super) const fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// Forgets the scene, because the host requests its end.
    pub(super) const fn forget_scene(&mut self) {
        self.scene = None;
    }

    /// Adds a request after the earlier ones.
    pub(super) fn enqueue(&mut self, request: HostRequest) {
        if let HostRequest::Request(Request::CancelChange { epoch }) = request
            && self.scene.is_some_and(|scene| scene.epoch == epoch)
            && let Some(change) = &mut self.in_contact
        {
            change.is_cancelled = true;
        }
        self.requests.enqueue(request);
    }

    /// Restarts the silence time-out, after a time in which the line was not read.
    pub(super) fn reset_silence(&mut self, now: Duration) {
        self.received = now;
        self.heartbeat_at = now;
    }

    /// Returns the requests that were given up without an answer since the last call.
    pub(super) fn take_unanswered(&mut self) -> Vec<HostRequest> {
        self.requests.take_unanswered()
    }

    /// Appends the messages that are due.
    ///
    /// # Errors
    /// When a deadline has passed.
    pub(super) fn append_due(&mut self, now: Duration, out: &mut Vec<u8>) -> Result<(), LinkError> {
        let in_state = now.saturating_sub(self.since);
        match self.state {
            State::Closed => return Ok(()),
            State::Greeting | State::SceneSent if in_state >= self.timeouts.give_up => {
                return Err(LinkError::Silent(in_state));
            }
            State::Leaving if in_state >= self.timeouts.goodbye => {
                return Err(LinkError::NotConfirmed);
            }
            State::Detaching if in_state >= self.timeouts.goodbye => {
                return Err(LinkError::Silent(in_state));
            }
            State::Open => self.check_silence(now)?,
            _ => {}
        }
        let is_quiet = now.saturating_sub(self.received) >= self.timeouts.hello_retry;
        if self.is_due(self.sent_at, now) && (self.state != State::Open || is_quiet) {
            self.append_state(now, out);
        }
        if self.state == State::Open {
            self.append_heartbeat(now, out);
            self.repeat_view(now, out);
            self.append_pending(now, out);
        }
        Ok(())
    }

    fn check_silence(&self, now: Duration) -> Result<(), LinkError> {
        let quiet = now.saturating_sub(self.received);
        // A frame right after the last answer may have been in transit before it.
        let late = self.received + self.timeouts.hello_retry;
        let others = self.foreign.is_some_and(|at| at > late);
        if others && quiet >= 2 * self.timeouts.hello_retry {
            return Err(LinkError::Taken);
        }
        match quiet >= self.timeouts.give_up {
            true => Err(LinkError::Silent(quiet)),
            false => Ok(()),
        }
    }

    fn is_due(&self, sent_at: Duration, now: Duration) -> bool {
        now.saturating_sub(sent_at) >= self.timeouts.retry
    }

    fn enter(&mut self, state: State, now: Duration) {
        self.state = state;
        (self.since, self.sent_at) = (now, now);
    }

    /// Appends the messages that the state repeats.
    fn append_state(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.sent_at = now;
        match self.state {
            State::Closed => {}
            State::Greeting => {
                // A zero ends any incomplete frame.
                out.push(0);
                append(&VersionCheck::Query { protocol: PROTOCOL }, out);
                self.append_hello(out);
            }
            State::SceneSent => {
                if let Some(scene) = self.scene {
                    self.append_scene(scene, out);
                }
                if now.saturating_sub(self.received) >= self.timeouts.hello_retry {
                    self.append_hello(out);
                }
            }
            State::Open => self.append_hello(out),
            State::Leaving => {
                // A device that was restarted, or has not received this session's open message yet,
                // has to receive it before the close message.
                self.append_hello(out);
                self.append_message(&ToDevice::Bye, out);
            }
            State::Detaching => {
                self.append_hello(out);
                self.append_message(&ToDevice::Detach, out);
            }
        }
    }

    /// Appends a scene, with its materials if it has some.
    fn append_scene(&self, scene: Scene, out: &mut Vec<u8>) {
        let Some(table) = self
            .materials
            .as_ref()
            .filter(|_| scene.materials.is_some())
        else {
            return self.append_message(&ToDevice::Scene(scene), out);
        };
        let mut room = [0; MAX_TABLE_BYTES];
        let table = table_bytes(table, &mut room);
        self.append_message(
            &ToDevice::MaterialScene(MaterialScene { scene, table }),
            out,
        );
    }

    fn append_hello(&mut self, out: &mut Vec<u8>) {
        // Zero stands for an open message that was never answered.
        self.hello_number = self.hello_number.checked_add(1).unwrap_or(1);
        self.hello_answered = false;
        out.push(0);
        let hello = HostHello {
            protocol: PROTOCOL,
            number: self.hello_number,
            silence_s: self.timeouts.silence_s,
        };
        self.append_message(&ToDevice::Hello(hello), out);
    }

    /// Appends a sign of life if it is due.
    fn append_heartbeat(&mut self, now: Duration, out: &mut Vec<u8>) {
        if self.heartbeat_due || now.saturating_sub(self.heartbeat_at) >= self.timeouts.heartbeat {
            (self.heartbeat_due, self.heartbeat_at) = (false, now);
            self.append_message(&ToDevice::Heartbeat, out);
        }
    }

    /// Makes the next sign of life due at once: time has passed on the device.
    pub(super) const fn make_heartbeat_due(&mut self) {
        self.heartbeat_due = true;
    }

    /// Appends the pending request if it is due.
    pub(super) fn append_pending(&mut self, now: Duration, out: &mut Vec<u8>) {
        if self.state != State::Open {
            return;
        }
        if let Some(message) = self.requests.next_message(now, &self.timeouts) {
            self.append_message(&message, out);
        }
    }

    /// Appends a message of this session.
    pub(super) fn append_message(&self, message: &ToDevice<'_>, out: &mut Vec<u8>) {
        let session = self.session;
        append(&InSession { session, message }, out);
    }

    /// Processes a protocol refusal, which counts only before the device has answered.
    pub(super) fn on_version_check(&self, check: VersionCheck) -> Result<(), LinkError> {
        match check {
            VersionCheck::Refused { protocol }
                if self.state == State::Greeting && protocol != PROTOCOL =>
            {
                Err(LinkError::version(protocol))
            }
            _ => Ok(()),
        }
    }

    /// Processes a frame; returns `None` if it belongs to another session or nothing waits for it.
    pub(super) fn on_frame(
        &mut self,
        now: Duration,
        frame: InSession<ToHost>,
        out: &mut Vec<u8>,
    ) -> Result<Option<ProtocolEvent>, LinkError> {
        if frame.session != self.session || self.state == State::Closed {
            self.note_foreign_frame(now, &frame);
            return Ok(None);
        }
        self.confirmed = true;
        Ok(match frame.message {
            ToHost::Hello(device) => self.on_hello(now, device, out)?,
            ToHost::SessionClosed { number, end } => self.on_session_closed(now, number, end)?,
            ToHost::SceneAck { epoch, accepted } => self.on_scene_ack(now, epoch, accepted)?,
            message @ (ToHost::Answer(Answer { number, .. }) | ToHost::Marked { number, .. }) => {
                self.on_answer(now, number, message)
            }
            message @ ToHost::Status { number, .. } => {
                self.on_query_answer(now, (HostRequest::Status, number), message)
            }
            message @ ToHost::Calibration { number, .. } => {
                self.on_query_answer(now, (HostRequest::Calibration, number), message)
            }
            ToHost::Goodbye(count) => self
                .on_goodbye(now, out)
                .then_some(ProtocolEvent::Other(ToHost::Goodbye(count))),
            ToHost::Detached => {
                self.on_detached(now);
                None
            }
            message @ ToHost::Heartbeat { .. } => {
                self.on_heartbeat(now, &message, out);
                Some(ProtocolEvent::Other(message))
            }
            message @ ToHost::PointAnswer { .. } => {
                self.received = now;
                Some(ProtocolEvent::Other(message))
            }
            ToHost::TileRequest { epoch, .. } => {
                // The device requests tiles of the scene before only after a cancel.
                if self.state == State::Open {
                    self.restore_reported_scene(Some(epoch));
                }
                Some(ProtocolEvent::Other(frame.message))
            }
            message => Some(ProtocolEvent::Other(message)),
        })
    }

    /// Records a frame of another session as a sign of another host, unless it reports that its
    /// session is over or belongs to the session before.
    fn note_foreign_frame(&mut self, now: Duration, frame: &InSession<ToHost>) {
        let previous = self.previous.map(|(session, _)| session);
        let is_over = matches!(frame.message, ToHost::SessionClosed { .. });
        if !is_over && previous != Some(frame.session) {
            self.foreign = Some(now);
        }
    }

    /// Returns true if a message is the first answer to the last open message. Answers to earlier
    /// ones, and repeated answers, report an old state.
    fn accept_hello_answer(&mut self, number: u8) -> bool {
        number == self.hello_number && !std::mem::replace(&mut self.hello_answered, true)
    }

    /// Processes the device's report that it has ended this session.
    fn on_session_closed(
        &mut self,
        now: Duration,
        number: u8,
        end: SessionEnd,
    ) -> Result<Option<ProtocolEvent>, LinkError> {
        if !self.accept_hello_answer(number) {
            return Ok(None);
        }
        self.received = now;
        match (self.state, end) {
            (State::Detaching, _) => self.enter(State::Closed, now),
            // The close message after the open message is answered with it.
            (State::Leaving, SessionEnd::HostSilent) => {}
            (_, SessionEnd::HostSilent) => return Err(LinkError::HostSilent),
            _ => return Err(LinkError::Taken),
        }
        Ok(None)
    }

    fn on_hello(
        &mut self,
        now: Duration,
        device: DeviceHello,
        out: &mut Vec<u8>,
    ) -> Result<Option<ProtocolEvent>, LinkError> {
        if !self.accept_hello_answer(device.number) {
            return Ok(None);
        }
        self.received = now;
        if device.protocol != PROTOCOL {
            return Err(LinkError::version(device.protocol));
        }
        let is_first = self.opened_by == 0;
        if self.opened_by == device.opened_by && self.state != State::Greeting {
            return Ok(None);
        }
        self.opened_by = device.opened_by;
        // A new session, or a restarted device: the epoch of its scene shows whether the scene
        // change is in force.
        self.resolve_view(device.epoch);
        self.restore_reported_scene(device.epoch);
        let restarted = !is_first;
        if self.is_ending() {
            return Ok(Some(ProtocolEvent::HelloReceived { device, restarted }));
        }
        if restarted {
            self.requests.give_up();
        }
        let next = match self.scene {
            Some(_) => State::SceneSent,
            None => State::Open,
        };
        if self.state != next {
            self.enter(next, now);
        }
        if next == State::SceneSent {
            self.append_state(now, out);
        }
        Ok(Some(ProtocolEvent::HelloReceived { device, restarted }))
    }

    /// Returns true if a scene is to be rendered and the device has another epoch.
    fn lacks_scene(&self, epoch: Option<u32>) -> bool {
        self.scene.is_some_and(|scene| epoch != Some(scene.epoch))
    }

    fn on_scene_ack(
        &mut self,
        now: Duration,
        epoch: u32,
        accepted: bool,
    ) -> Result<Option<ProtocolEvent>, LinkError> {
        let is_this = |(view, _, _): &mut (SceneChange, _, _)| view.scene.epoch == epoch;
        if self.state == State::Open
            && let Some((view, _, _)) = self.view.take_if(is_this)
        {
            self.received = now;
            if accepted {
                self.accept_view(&view);
            }
            return Ok(Some(ProtocolEvent::SceneChange { accepted }));
        }
        if self.state != State::SceneSent || self.lacks_scene(Some(epoch)) {
            return Ok(None);
        }
        self.received = now;
        if !accepted {
            return Err(LinkError::SceneRefused);
        }
        self.enter(State::Open, now);
        Ok(Some(ProtocolEvent::SceneAck))
    }

    fn on_answer(&mut self, now: Duration, number: u8, message: ToHost) -> Option<ProtocolEvent> {
        let request = self.requests.request_answered(number)?;
        self.received = now;
        if let (HostRequest::Request(Request::CancelChange { epoch }), ToHost::Answer(answer)) =
            (&request, &message)
            && answer.result.is_ok()
            && self.scene.is_some_and(|scene| scene.epoch == *epoch)
        {
            self.restore_scene();
        }
        Some(ProtocolEvent::Answered(request, message))
    }

    fn on_query_answer(
        &mut self,
        now: Duration,
        (query, number): (HostRequest, u8),
        message: ToHost,
    ) -> Option<ProtocolEvent> {
        let request = self.requests.query_answered(query, number)?;
        self.received = now;
        Some(ProtocolEvent::Answered(request, message))
    }

    fn on_heartbeat(&mut self, now: Duration, message: &ToHost, out: &mut Vec<u8>) {
        self.received = now;
        if let ToHost::Heartbeat { epoch, .. } = message {
            self.restore_reported_scene(*epoch);
        }
        if let ToHost::Heartbeat { epoch, .. } = message
            && self.state == State::Open
            && self.lacks_scene(*epoch)
            // The answer to a scene change will arrive, or it is sent again.
            && self.view.is_none_or(|(view, _, _)| *epoch != Some(view.scene.epoch))
        {
            // The device has no scene, or lost it, and the message about that was lost.
            self.enter(State::SceneSent, now);
            self.append_state(now, out);
        }
    }

    fn on_detached(&mut self, now: Duration) {
        if self.state == State::Detaching {
            self.received = now;
            self.enter(State::Closed, now);
        }
    }

    fn on_goodbye(&mut self, now: Duration, out: &mut Vec<u8>) -> bool {
        let leaves = self.state == State::Leaving;
        if leaves {
            self.received = now;
            self.enter(State::Closed, now);
            self.append_message(&ToDevice::Close, out);
        }
        leaves
    }
}
