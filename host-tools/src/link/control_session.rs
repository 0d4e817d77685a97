//! Queries and requests to a device, without a terrain: identity, status, calibration, arming.

use std::time::Duration;

use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::{Answer, Refusal, Request};
use hapterra_core::wire::session::READ_ONLY_SILENCE_S;
use hapterra_core::wire::status::Status;

use super::error::LinkError;
use super::host_protocol::{HostProtocol, ProtocolEvent, State};
use super::host_request::HostRequest;
use super::line::{Line, POLL_INTERVAL};
use super::messages::{FromDevice, from_device, next_frame};
use super::timeouts::Timeouts;
use super::transport::Transport;

/// A device sends its telemetry at least once in this time.
const TELEMETRY_INTERVAL: Duration = Duration::from_millis(150);

/// Handler of an unrequested message; the returned message is sent in answer.
type OnMessage<'o> = &'o mut dyn FnMut(&ToHost) -> Option<ToDevice<'static>>;

/// A session with a device, without a terrain. It always sends its end to the device. A session
/// that has set a scene or driven the arm closes, which disarms the arm. A session that has only
/// read, or changed settings, detaches and leaves arm and scene as they are.
/// [`ControlSession::end`] waits for the answer and returns it. A dropped session also waits, up to
/// [`Timeouts::goodbye`], and logs that the arm may still be armed if there is no answer.
pub struct ControlSession<'t> {
    exchange: Exchange<'t>,
    device: DeviceHello,
}

/// Messages both ways, and their end.
struct Exchange<'t> {
    line: Line<'t>,
    protocol: HostProtocol,
    reader: Box<FrameReader<MAX_FRAME>>,
    /// True if the session has put a scene in force, or sent a request that drives the arm.
    has_driven: bool,
    /// True if its end was sent, or the other end is closed.
    is_over: bool,
}

impl<'t> ControlSession<'t> {
    /// Opens a session.
    ///
    /// # Errors
    /// [`LinkError`]: no answer within `timeout`, or a different protocol.
    pub fn open(transport: Box<dyn Transport + 't>, timeout: Duration) -> Result<Self, LinkError> {
        Self::with(transport, Timeouts::for_control(timeout))
    }

    /// Opens a read-only session: the device answers status and calibration queries, ignores
    /// requests, and keeps its present host.
    ///
    /// # Errors
    /// As [`ControlSession::open`].
    pub fn open_read_only(
        transport: Box<dyn Transport + 't>,
        timeout: Duration,
    ) -> Result<Self, LinkError> {
        Self::with(transport, Timeouts::read_only(timeout))
    }

    fn with(transport: Box<dyn Transport + 't>, timeouts: Timeouts) -> Result<Self, LinkError> {
        // A read-only session is never opened, so it needs no end.
        let is_over = timeouts.silence_s == READ_ONLY_SILENCE_S;
        let mut exchange = Exchange {
            line: Line::new(transport),
            protocol: HostProtocol::new(None, timeouts, fastrand::Rng::new()),
            reader: Box::default(),
            has_driven: false,
            is_over,
        };
        let line = &mut exchange.line;
        exchange.protocol.greet(line.now(), &mut line.out);
        let device = exchange.wait_for(|event| match event {
            ProtocolEvent::HelloReceived { device, .. } => Some(device),
            _ => None,
        })?;
        Ok(Self { exchange, device })
    }

    /// Returns the device's introduction.
    #[must_use]
    pub const fn device(&self) -> &DeviceHello {
        &self.device
    }

    /// Ends the session, and returns when the device has confirmed it.
    ///
    /// # Errors
    /// [`LinkError::NotConfirmed`] and [`LinkError::Taken`] if the arm may be armed; otherwise
    /// another [`LinkError`].
    pub fn end(mut self) -> Result<(), LinkError> {
        self.exchange.end()
    }

    /// As [`ControlSession::end`], and disarms the device, even if another host has armed it.
    ///
    /// # Errors
    /// As [`ControlSession::end`].
    pub fn disarm(mut self) -> Result<(), LinkError> {
        self.exchange.has_driven = true;
        self.end()
    }

    /// Queries the state of the device: guard, calibration, ticks, stack.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn status(&mut self) -> Result<Status, LinkError> {
        self.exchange
            .query(HostRequest::Status, |message| match message {
                ToHost::Status { status, .. } => Some(status),
                _ => None,
            })
    }

    /// As [`ControlSession::status`], after a short wait for messages in transit, so that the
    /// status is newer than everything before the call.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn fresh_status(&mut self) -> Result<Status, LinkError> {
        self.exchange.receive_for(TELEMETRY_INTERVAL)?;
        self.status()
    }

    /// Queries the calibration in force on the device; `None` if there is none.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn calibration(&mut self) -> Result<Option<Calibration>, LinkError> {
        self.exchange
            .query(HostRequest::Calibration, |message| match message {
                ToHost::Calibration { calibration, .. } => Some(calibration),
                _ => None,
            })
    }

    /// Sends a request; the device executes it once, or returns the reason for a refusal.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn request(&mut self, request: &Request) -> Result<Result<(), Refusal>, LinkError> {
        if matches!(request, Request::DropScene | Request::Jog(_)) {
            self.exchange.protocol.forget_scene();
        }
        self.exchange.has_driven |= is_driving(request);
        self.exchange
            .query(HostRequest::Request(*request), |message| match message {
                ToHost::Answer(Answer { result, .. }) => Some(result),
                _ => None,
            })
            .inspect(|result| {
                // A device in its loader does not read the link any more.
                self.exchange.is_over |= *request == Request::EnterLoader && result.is_ok();
            })
    }

    /// Puts a scene in force.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn put_scene(&mut self, scene: Scene) -> Result<(), LinkError> {
        let exchange = &mut self.exchange;
        exchange.has_driven = true;
        let now = exchange.line.now();
        exchange.protocol.reset_silence(now);
        let out = &mut exchange.line.out;
        exchange.protocol.put_scene(scene, now, out);
        exchange.wait_for(|event| matches!(event, ProtocolEvent::SceneAck).then_some(()))
    }

    /// Lets `ms` of the device's time pass, or less if `is_done` returns true; calls `on` for each
    /// unrequested message, and sends the message that `on` returns. Returns the last state of the
    /// device.
    ///
    /// # Errors
    /// [`LinkError`]; also if the device's time stands still.
    pub fn run_for(
        &mut self,
        ms: u32,
        is_done: &dyn Fn() -> bool,
        on: OnMessage<'_>,
    ) -> Result<Status, LinkError> {
        let exchange = &mut self.exchange;
        let start = exchange.line.now();
        exchange.protocol.reset_silence(start);
        let first = exchange.status(on)?;
        let ticks = ms * (first.device.tick_hz / 1000).max(1);
        let timeout = exchange.protocol.timeouts().give_up + Duration::from_millis(u64::from(ms));
        loop {
            exchange.exchange_messages(&mut |_| {}, on)?;
            let status = exchange.status(on)?;
            if is_done() || status.ticks.run.wrapping_sub(first.ticks.run) >= ticks {
                return Ok(status);
            }
            let waited = exchange.line.now().saturating_sub(start);
            if waited > timeout {
                return Err(LinkError::Silent(waited));
            }
        }
    }

    /// Puts a calibration in force and requests its storage, which needs the user's dead-man press.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn store(&mut self, calibration: Calibration) -> Result<Result<(), Refusal>, LinkError> {
        match self.request(&Request::SetCalibration { calibration })? {
            Ok(()) => self.request(&Request::StoreCalibration),
            refused => Ok(refused),
        }
    }
}

impl Exchange<'_> {
    /// Sends a request and waits for the answer.
    fn query<T>(
        &mut self,
        request: HostRequest,
        mut read: impl FnMut(ToHost) -> Option<T>,
    ) -> Result<T, LinkError> {
        // The line is not read between two queries: the user may think for a while.
        self.protocol.reset_silence(self.line.now());
        self.protocol.enqueue(request);
        self.wait_for(|event| match event {
            ProtocolEvent::Answered(answered, message) if answered.is_like(&request) => {
                read(message)
            }
            _ => None,
        })
    }

    /// Queries the status and runs the conversation until the answer arrives.
    fn status(&mut self, on: OnMessage<'_>) -> Result<Status, LinkError> {
        self.protocol.enqueue(HostRequest::Status);
        loop {
            let mut found = None;
            let mut answered = |event| {
                if let ProtocolEvent::Answered(HostRequest::Status, ToHost::Status { status, .. }) =
                    event
                {
                    found = Some(status);
                }
            };
            self.exchange_messages(&mut answered, on)?;
            if let Some(status) = found {
                return Ok(status);
            }
        }
    }

    /// Processes received messages, and sends the answers that `on` returns for unrequested ones.
    fn exchange_messages(
        &mut self,
        answered: &mut dyn FnMut(ProtocolEvent),
        on: OnMessage<'_>,
    ) -> Result<(), LinkError> {
        let mut replies = vec![];
        self.poll(POLL_INTERVAL, &mut |event| match event {
            ProtocolEvent::Other(message) => replies.extend(on(&message)),
            event => answered(event),
        })?;
        for reply in replies {
            self.protocol.append_message(&reply, &mut self.line.out);
        }
        self.line.flush()
    }

    fn wait_for<T>(
        &mut self,
        mut read: impl FnMut(ProtocolEvent) -> Option<T>,
    ) -> Result<T, LinkError> {
        loop {
            let mut found = None;
            self.poll(POLL_INTERVAL, &mut |event| {
                found = found.take().or_else(|| read(event));
            })?;
            if let Some(found) = found {
                return Ok(found);
            }
        }
    }

    /// Processes the device's messages for `time`.
    fn receive_for(&mut self, time: Duration) -> Result<(), LinkError> {
        self.protocol.reset_silence(self.line.now());
        let end = self.line.now() + time;
        while self.line.now() < end {
            self.poll(POLL_INTERVAL, &mut |_| {})?;
        }
        Ok(())
    }

    fn poll(&mut self, wait: Duration, on: &mut dyn FnMut(ProtocolEvent)) -> Result<(), LinkError> {
        let polled = self.try_poll(wait, on);
        // Another host controls the device: this session must not close it.
        self.is_over |= matches!(polled, Err(LinkError::Taken));
        polled
    }

    fn try_poll(
        &mut self,
        wait: Duration,
        on: &mut dyn FnMut(ProtocolEvent),
    ) -> Result<(), LinkError> {
        let line = &mut self.line;
        self.protocol.append_due(line.now(), &mut line.out)?;
        if let Some(request) = self.protocol.take_unanswered().pop() {
            tracing::debug!(?request, "given up");
            return Err(LinkError::Silent(self.protocol.timeouts().give_up));
        }
        line.flush()?;
        let (now, mut bytes, out) = line.receive(wait)?;
        while let Some(frame) = next_frame(&mut self.reader, &mut bytes, from_device) {
            match frame {
                Ok(FromDevice::Version(check)) => self.protocol.on_version_check(check)?,
                Ok(FromDevice::Message(message)) => {
                    if let Some(event) = self.protocol.on_frame(now, message, out)? {
                        on(event);
                    }
                }
                // The rest of an earlier message.
                Err(_) => {}
            }
        }
        line.flush()
    }

    /// Sends the close or detach message that fits the session, and waits for the answer, once.
    fn end(&mut self) -> Result<(), LinkError> {
        if std::mem::replace(&mut self.is_over, true) {
            return Ok(());
        }
        let has_opened = self.protocol.state() != State::Greeting;
        let line = &mut self.line;
        match self.has_driven {
            true => self.protocol.leave(line.now(), &mut line.out),
            false => self.protocol.detach(line.now(), &mut line.out),
        }
        if !has_opened {
            // The delivery is unknown, but a second wait would not help.
            return line.flush();
        }
        while self.protocol.state() != State::Closed {
            let polled = self.poll(POLL_INTERVAL, &mut |_| {});
            polled.map_err(|error| {
                tracing::debug!(%error, "while closing the session");
                match error {
                    LinkError::Taken => error,
                    _ if self.has_driven => LinkError::NotConfirmed,
                    _ => error,
                }
            })?;
        }
        Ok(())
    }
}

/// Returns true if a request may drive the arm.
const fn is_driving(request: &Request) -> bool {
    matches!(
        request,
        Request::Arm | Request::Jog(_) | Request::HoldOutputs(Some(_))
    )
}

impl Drop for Exchange<'_> {
    fn drop(&mut self) {
        if let Err(not_confirmed @ (LinkError::NotConfirmed | LinkError::Taken)) = self.end() {
            tracing::error!("{not_confirmed}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{FaultInjector, Native};
    use crate::terrain::{Scale, Terrain};
    use crate::timeouts;
    use hapterra_core::force::SurfaceParams;
    use hapterra_core::grid::GridPoint;
    use hapterra_core::scene::Source;
    use hapterra_core::wire::frame::encode;
    use hapterra_core::wire::session::SessionEnd;
    use hapterra_core::wire::version::VersionCheck;
    use hapterra_firmware::native::StoppedClock;
    use heightfield::Raster;
    use std::cell::Cell;
    use std::io;
    use std::rc::Rc;

    const TIMEOUT: Duration = timeouts::HANG;

    #[test]
    fn device_reports_board_status_and_calibration() {
        let device = Box::new(Native::for_replay().free_running());
        let mut control = ControlSession::open(device, TIMEOUT).expect("it answers");
        assert_eq!(control.device().board.as_str(), "native");
        let status = control.fresh_status().expect("it answers");
        assert!(!status.health.report.blockers.is_empty());
        let known = control.calibration().expect("it answers");
        assert_eq!(known, Some(Calibration::PREMIUM_1_5));
    }

    /// Safety: 32.
    #[test]
    fn read_only_session_is_not_recorded_as_a_host() {
        let mut device = Native::for_replay().free_running();
        let mut control =
            ControlSession::open_read_only(Box::new(&mut device), TIMEOUT).expect("it answers");
        let known = control.calibration().expect("it answers");
        assert_eq!(known, Some(Calibration::PREMIUM_1_5));
        let status = control.fresh_status().expect("it answers");
        assert!(!status.health.report.blockers.is_empty());
        drop(control);
        let host = ControlSession::open(Box::new(&mut device), TIMEOUT).expect("it answers");
        let before = host.device().last.end;
        assert_eq!(before, SessionEnd::None, "it had no host before");
    }

    #[test]
    fn calibration_is_stored_or_refused_with_a_reason() {
        let press: FaultInjector = Box::new(|tick, sense, _| sense.dead_man = tick % 1_000 >= 500);
        let device = Box::new(
            Native::for_replay()
                .free_running()
                .with_fault_injector(press),
        );
        let mut control = ControlSession::open(device, TIMEOUT).expect("it answers");
        let mut calibration = Calibration::OMNI;
        assert_eq!(control.store(calibration).expect("it answers"), Ok(()));
        assert_eq!(control.calibration().expect("answers"), Some(calibration));
        calibration.l1_mm = -1.0;
        let refused = control.store(calibration).expect("it answers");
        assert!(
            matches!(refused, Err(Refusal::Calibration(_))),
            "{refused:?}"
        );
        let blocked = control.request(&Request::Arm).expect("it answers");
        assert!(matches!(blocked, Err(Refusal::Blocked(_))), "{blocked:?}");
    }

    /// A device that repeats all its answers before each new one, as on a line that is slower than
    /// the host's repetition.
    struct Late(Native<StoppedClock>, Vec<u8>);

    impl Transport for Late {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.0.send(bytes)
        }

        fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
            let again = self.1.len().min(into.len() / 2);
            let (repeated, fresh) = into.split_at_mut(again);
            repeated.copy_from_slice(&self.1[self.1.len() - again..]);
            let new = self.0.receive(fresh, wait)?;
            self.1.extend(&fresh[..new]);
            Ok(again + new)
        }
    }

    /// Safety: 32.
    #[test]
    fn repeated_old_answers_are_not_mistaken_for_new_ones() {
        let device = Late(Native::for_replay().free_running(), vec![]);
        let mut control = ControlSession::open(Box::new(device), TIMEOUT).expect("it answers");
        let check_record = |control: &mut ControlSession<'_>, expected: Calibration| {
            let known = control.calibration().expect("it answers");
            assert_eq!(known, Some(expected));
            let status = control.status().expect("it answers");
            assert_eq!(status.model, Some(expected.model));
        };
        check_record(&mut control, Calibration::PREMIUM_1_5);
        let calibration = Calibration::OMNI;
        let request = Request::SetCalibration { calibration };
        let result = control.request(&request).expect("it answers");
        assert_eq!(result, Ok(()));
        check_record(&mut control, calibration);
    }

    /// Returns a scene for the arm.
    fn scene() -> Scene {
        let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let home = GridPoint::default();
        terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home)
    }

    fn open<'t>(device: &'t mut Native<StoppedClock>) -> ControlSession<'t> {
        ControlSession::open(Box::new(device), TIMEOUT).expect("it answers")
    }

    #[test]
    fn recorded_session_end_ignores_sessions_that_only_query() {
        let mut device = Native::for_replay().free_running();
        open(&mut device).put_scene(scene()).expect("taken");
        for _ in 0..3 {
            let mut reading = open(&mut device);
            let (last, epoch) = (reading.device().last, reading.device().epoch);
            assert_eq!((last.end, epoch), (SessionEnd::Goodbye, None));
            assert!(reading.status().is_ok());
        }
        // A session that has requested arming, even if it was refused, closes, so the device
        // records it.
        let before = open(&mut device).device().last.session;
        let mut arming = open(&mut device);
        let blocked = arming.request(&Request::Arm).expect("it answers");
        assert!(blocked.is_err());
        arming.end().expect("confirmed");
        let last = open(&mut device).device().last;
        assert_eq!(last.end, SessionEnd::Goodbye);
        assert_ne!(last.session, before);
    }

    #[test]
    fn query_session_keeps_the_scene_and_recorded_session_end() {
        let mut device = Native::for_replay().free_running();
        let held = scene();
        let mut vanishes = open(&mut device);
        vanishes.put_scene(held).expect("taken");
        // As if its program were killed.
        vanishes.exchange.is_over = true;
        drop(vanishes);
        for _ in 0..3 {
            let reading = open(&mut device);
            let (last, epoch) = (reading.device().last, reading.device().epoch);
            let expected = (SessionEnd::Replaced, Some(held.epoch));
            assert_eq!((last.end, epoch), expected);
            reading.end().expect("confirmed");
        }
    }

    /// A device that ignores everything after a number of sends, and the time.
    struct Deaf(Native<StoppedClock>, usize, Rc<Cell<Duration>>);

    impl Transport for Deaf {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.1 = self.1.saturating_sub(1);
            match self.1 {
                0 => Ok(()),
                _ => self.0.send(bytes),
            }
        }

        fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
            self.2.set(self.2.get() + wait / 10);
            self.0.receive(into, wait)
        }

        fn now(&self) -> Duration {
            self.2.get()
        }
    }

    /// Safety: 26.
    #[test]
    fn unconfirmed_close_is_an_error_within_bounded_time() {
        let timeout = Duration::from_millis(300);
        let time = Rc::new(Cell::new(Duration::ZERO));
        let open = || {
            let deaf = Deaf(Native::for_replay().free_running(), 3, Rc::clone(&time));
            ControlSession::open(Box::new(deaf), timeout).expect("it answers")
        };
        let within = |start: Duration| {
            let took = time.get() - start;
            assert!(took >= timeout && took < 10 * timeout, "{took:?}");
        };
        let mut control = open();
        assert!(control.request(&Request::Arm).is_ok(), "the second send");
        let start = time.get();
        let end = control.end();
        assert!(matches!(end, Err(LinkError::NotConfirmed)), "{end:?}");
        within(start);
        let mut control = open();
        assert!(control.status().is_ok());
        let start = time.get();
        drop(control);
        within(start);
    }

    /// A transport that sends one message, then only receives.
    struct OneMessage(Vec<u8>);

    impl Transport for OneMessage {
        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            Ok(())
        }

        fn receive(&mut self, into: &mut [u8], _: Duration) -> io::Result<usize> {
            let n = self.0.len().min(into.len());
            into[..n].copy_from_slice(&self.0[..n]);
            self.0.drain(..n);
            Ok(n)
        }
    }

    #[test]
    fn protocol_mismatch_is_distinguished_from_silence() {
        let open_after = |bytes: Vec<u8>| {
            let opened =
                ControlSession::open(Box::new(OneMessage(bytes)), Duration::from_millis(5));
            opened.map(|_| ())
        };
        assert!(matches!(open_after(vec![]), Err(LinkError::Silent(_))));
        let nonsense = b"HTTP/1.1 400\0\0".to_vec();
        assert!(matches!(open_after(nonsense), Err(LinkError::Silent(_))));
        let mut frame = [0; MAX_FRAME];
        let refused = VersionCheck::Refused { protocol: 77 };
        let bytes = encode(&refused, &mut frame).expect("fits").to_vec();
        assert!(matches!(
            open_after(bytes),
            Err(LinkError::Version { theirs: 77, .. })
        ));
    }
}
