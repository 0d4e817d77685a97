//! Handling of the host's messages.

use hapterra_core::scene::{HipCommand, Scene};
use hapterra_core::terrain::RETRY_TICKS;
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::{FrameError, decode};
use hapterra_core::wire::hello::{HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::{InSession, READ_ONLY_SILENCE_S, SessionEnd, SessionNumber};
use hapterra_core::wire::status::{StackFigures, Status, TickFigures};
use hapterra_core::wire::version::VersionCheck;

use super::commands::CommandRoom;
use super::session::{OpenKind, SessionState};
use super::views::HostClutch;
use super::{Link, ReplayProgress, log};

impl<const D: usize> Link<'_, D> {
    /// Handles the decoded bytes of a frame.
    pub(super) fn on_content(
        &mut self,
        content: &[u8],
        room: CommandRoom,
    ) -> Result<(), FrameError> {
        self.nothing_to_request_at = None;
        if VersionCheck::is_in(content) {
            self.on_version_check(decode(content)?);
        } else {
            let InSession { session, message } = decode(content)?;
            self.on_message(session, message, room);
        }
        Ok(())
    }

    /// Answers a host of another protocol. A host of this protocol also sends a hello.
    fn on_version_check(&mut self, check: VersionCheck) {
        if let VersionCheck::Query { protocol } = check
            && protocol != PROTOCOL
        {
            self.refuse(protocol);
        }
    }

    fn refuse(&mut self, theirs: u16) {
        log::refused(theirs);
        let protocol = PROTOCOL;
        self.tx.push_refusal(&VersionCheck::Refused { protocol });
    }

    fn on_message(&mut self, session: SessionNumber, message: ToDevice<'_>, room: CommandRoom) {
        if let ToDevice::Hello(hello) = message {
            return self.on_hello(session, hello, room);
        }
        if !self.session.is_of(session) && self.read_only_session == Some(session) {
            return self.on_read_only(session, &message);
        }
        if !self.session.is_of(session) {
            self.foreign_frames = self.foreign_frames.saturating_add(1);
            return;
        }
        self.session.received(self.ends.monitor.ticks());
        match (message, self.session.state()) {
            (ToDevice::Bye, state) => self.on_bye(state, room),
            (ToDevice::Detach, state) => self.on_detach(state, room),
            (ToDevice::Close, SessionState::Ended(SessionEnd::Goodbye)) => self.session.close(),
            (
                _,
                SessionState::Closed
                | SessionState::Ended(_)
                | SessionState::Detached
                | SessionState::Acknowledged,
            ) => {}
            (ToDevice::Heartbeat, _) => self.on_heartbeat(),
            (ToDevice::Status { number }, _) => self.send_status(session, number),
            (ToDevice::GetCalibration { number }, _) => self.send_calibration(session, number),
            (_, SessionState::Closing) => {}
            (ToDevice::Scene(scene), _) => self.on_scene(scene, room),
            (ToDevice::SceneChange(view), _) => self.on_scene_change(view, room),
            (ToDevice::Tile(tile), _) => self.on_tile(&tile, None, room),
            (ToDevice::MaterialScene(scene), _) => self.on_material_scene(&scene, room),
            (ToDevice::MaterialTile(message), _) => {
                self.on_tile(&message.tile, Some(message.materials), room);
            }
            (ToDevice::Hip(point), _) => self.on_point(point),
            (ToDevice::Request { number, request }, _) => {
                self.on_request(number, &request, room);
            }
            (ToDevice::Hello(_) | ToDevice::Close, _) => {}
        }
    }

    fn on_hello(&mut self, session: SessionNumber, hello: HostHello, room: CommandRoom) {
        if hello.protocol != PROTOCOL {
            return self.refuse(hello.protocol);
        }
        // The scene to report is not decided yet; the host sends its open message again.
        if self.is_cancelling() {
            return;
        }
        if hello.silence_s == READ_ONLY_SILENCE_S && !self.session.is_of(session) {
            self.read_only_session = Some(session);
            let hello = self.device.hello(hello.number, self.scene, &self.session);
            return self.send_in(session, &ToHost::Hello(hello));
        }
        match self.session.classify_open(session) {
            OpenKind::Stale => {
                self.foreign_frames = self.foreign_frames.saturating_add(1);
                return;
            }
            OpenKind::Ended(end) => {
                self.foreign_frames = self.foreign_frames.saturating_add(1);
                let number = hello.number;
                return self.send_in(session, &ToHost::SessionClosed { number, end });
            }
            OpenKind::Repeated => {}
            OpenKind::New => self.open(session, hello.number, room),
        }
        self.session.received(self.ends.monitor.ticks());
        let tick_hz = self.device.tick_hz();
        self.session.set_silence(hello.silence_s, tick_hz);
        let hello = self.device.hello(hello.number, self.scene, &self.session);
        self.send(&ToHost::Hello(hello));
    }

    /// Answers a host that only reads, without an effect on the open session or its time-out.
    fn on_read_only(&mut self, session: SessionNumber, message: &ToDevice<'_>) {
        match *message {
            ToDevice::Status { number } => self.send_status(session, number),
            ToDevice::GetCalibration { number } => self.send_calibration(session, number),
            _ => {}
        }
    }

    fn send_status(&mut self, session: SessionNumber, number: u8) {
        let status = self.status();
        self.send_in(session, &ToHost::Status { number, status });
    }

    fn send_calibration(&mut self, session: SessionNumber, number: u8) {
        let calibration = self.device.calibration;
        let answer = ToHost::Calibration {
            number,
            calibration,
        };
        self.send_in(session, &answer);
    }

    /// Opens a session; the scene and its stored tiles stay.
    fn open(&mut self, session: SessionNumber, hello: u8, room: CommandRoom) {
        self.clear_messages();
        self.abandon_clutch();
        let dropped = self.samples_dropped();
        self.session.open(session, hello, dropped);
        self.device.session_opened();
        log::opened(session, self.session.last().end, self.bad_frames);
        // An arming that the previous host requested, and that still waits, is cancelled.
        if self.device.is_being_armed() {
            self.command(room, Command::Disarm);
        }
    }

    fn on_heartbeat(&mut self) {
        let (count, report) = (self.sample_count(), self.device.report());
        let epoch = self.scene.map(|scene| scene.epoch);
        self.send(&ToHost::Heartbeat {
            count,
            epoch,
            report,
        });
        // If the clock stands still until a tile arrives, its request would never time out.
        if self.may_stop_clock() {
            self.requester.age(RETRY_TICKS / 2);
        }
    }

    fn on_bye(&mut self, state: SessionState, room: CommandRoom) {
        match state {
            SessionState::Open
            | SessionState::Detached
            | SessionState::Ended(SessionEnd::HostSilent) => {
                self.read_records();
                self.device.cancel_press();
                self.drop_scene(room);
                self.session.begin_close();
            }
            // The host has missed the answer.
            SessionState::Ended(_) | SessionState::Acknowledged => {
                self.send(&ToHost::Goodbye(self.sample_count()));
            }
            SessionState::Closed | SessionState::Closing => {}
        }
    }

    /// Detaches the host: an armed arm stays armed; arming or storing that still waits is
    /// cancelled.
    fn on_detach(&mut self, state: SessionState, room: CommandRoom) {
        match state {
            SessionState::Closed | SessionState::Closing => return,
            SessionState::Open => {
                self.device.cancel_press();
                self.drop_samples();
                self.abandon_clutch();
                if self.device.is_being_armed() {
                    self.command(room, Command::Disarm);
                }
                self.session.detach();
            }
            // The host has missed the answer.
            SessionState::Detached | SessionState::Ended(_) | SessionState::Acknowledged => {}
        }
        self.send(&ToHost::Detached);
    }

    /// Disarms and drops the scene; the loop ramps the force down.
    pub(super) fn drop_scene(&mut self, room: CommandRoom) {
        let command = match self.scene {
            Some(_) => Command::DropScene,
            None => Command::Disarm,
        };
        self.clear_scene();
        self.command(room, command);
    }

    /// Discards the link's copy of the scene, which the loop drops or has dropped.
    pub(super) fn clear_scene(&mut self) {
        self.scene = None;
        self.clear_positions();
        self.requester.clear_pending();
    }

    /// Discards the state that depends on positions in one scene.
    fn clear_positions(&mut self) {
        self.view = 0;
        self.forget_change();
        self.clutch = HostClutch::Released;
        self.request_hint = None;
        self.points.clear();
        self.replay = ReplayProgress::default();
    }

    pub(super) fn on_bad_frame(&mut self, bad: FrameError) {
        log::bad_frame(bad);
        self.bad_frames = self.bad_frames.saturating_add(1);
    }

    /// Drops pending messages and requests; keeps the scene and the stored tiles.
    pub(super) fn clear_messages(&mut self) {
        self.nothing_to_request_at = None;
        self.tx.clear();
        self.drop_samples();
        self.points.clear();
        self.requester.clear_pending();
    }

    /// Drops the samples that are not packed yet, and counts them.
    fn drop_samples(&mut self) {
        self.dropped = self.dropped.wrapping_add(self.samples.len() as u32);
        self.samples.clear();
    }

    /// Drops and counts the samples of a scene that another replaces.
    fn drop_scene_samples(&mut self) {
        if self.is_arm_scene() && self.session.is_open() {
            while self.ends.records.dequeue().is_some() {
                self.dropped = self.dropped.wrapping_add(1);
            }
            self.drop_samples();
        }
    }

    pub(super) fn on_scene(&mut self, scene: Scene, room: CommandRoom) {
        let accepted = scene.is_valid() && self.has_materials_of(&scene);
        // The same scene continues: its host has returned.
        if accepted && self.scene != Some(scene) {
            self.drop_scene_samples();
            self.requester.reset(scene.level, scene.size);
            self.requester.set_fallback(scene.fallback);
            self.clear_positions();
            self.scene = Some(scene);
            self.command(room, Command::Scene(scene));
        }
        let epoch = scene.epoch;
        log::scene(epoch, accepted);
        self.send(&ToHost::SceneAck { epoch, accepted });
    }

    /// Queues a point. Each is rendered once; the last answer is repeated if its point arrives
    /// again.
    fn on_point(&mut self, point: HipCommand) {
        if self.is_arm_scene() || self.scene.is_none() {
            return;
        }
        let is = |seq: u32| seq == point.seq;
        if let Some(last) = self.replay.last.filter(|r| r.answered_seq.is_some_and(is)) {
            return self.answer_point(last);
        }
        if self.replay.current.is_some_and(is) || self.points.iter().any(|p| is(p.seq)) {
            return;
        }
        // A host that does not wait for answers loses points.
        let _ = self.points.push_back(point);
    }

    fn status(&self) -> Status {
        let (device, monitor) = (&self.device, self.ends.monitor);
        let latest = &self.last_record.sample;
        let (size, high_water) = monitor.stack();
        Status {
            device: device.hello(0, self.scene, &self.session),
            boot: device.boot.clone(),
            calibration: device.source,
            model: device.calibration.map(|calibration| calibration.model),
            health: device.health,
            ticks: TickFigures {
                run: monitor.ticks(),
                cost: latest.cost,
                worst_cost: latest.worst_cost,
                late: latest.late,
            },
            stack: StackFigures { size, high_water },
            usb_clock: monitor.usb_clock(),
            bad_frames: self.bad_frames,
            foreign_frames: self.foreign_frames,
            dropped: self.samples_dropped(),
        }
    }

    /// Returns the number of samples dropped here and by the loop.
    pub(super) fn samples_dropped(&self) -> u32 {
        self.dropped.wrapping_add(self.ends.monitor.dropped())
    }
}
