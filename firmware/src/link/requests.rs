//! What the link does with each message of the host.

use hapterra_core::phantom::{Calibration, Mechanism};
use hapterra_core::scene::{Point, Scene};
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::BadFrame;
use hapterra_core::wire::hello::{HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::status::{Refusal, Request, StackFigures, Status, TickFigures};

use super::{Link, ReplayProgress, SessionState, log};

impl<const D: usize> Link<'_, D> {
    pub(super) fn on_message(&mut self, message: ToDevice<'_>) {
        self.nothing_to_request_at = None;
        match (message, self.session) {
            (ToDevice::Hello(hello), _) => self.open(hello),
            (_, SessionState::Closed | SessionState::Ended) => {}
            (ToDevice::Scene(scene), _) => self.take_scene(scene),
            (ToDevice::Tile(tile), _) => self.take_tile(&tile),
            (ToDevice::Point(point), _) => self.take_point(point),
            (ToDevice::Bye, _) => {
                self.drop_scene();
                self.session = SessionState::Ended;
            }
            (ToDevice::DropScene, _) => {
                self.drop_scene();
                self.answer(Request::DropScene, Ok(()));
            }
            (ToDevice::Status, _) => self.say(&ToHost::Status(self.status())),
            (ToDevice::GetCalibration, _) => {
                self.say(&ToHost::Calibration(self.device.calibration));
            }
            (ToDevice::Arm, _) => {
                self.device.arming = Some(self.device.health.report.decision.count);
                self.command(Command::Arm);
            }
            (ToDevice::Disarm, _) => self.obey(Request::Disarm, Command::Disarm),
            (ToDevice::ClearFault, _) => self.obey(Request::ClearFault, Command::ClearFault),
            (ToDevice::Zero { counts }, _) => match self.device.may_change_settings() {
                Ok(()) => self.obey(Request::Zero, Command::Zero(counts)),
                refused => self.answer(Request::Zero, refused),
            },
            (ToDevice::SetCalibration { calibration, store }, _) => {
                let result = self.set_calibration(&calibration, store);
                self.answer(Request::SetCalibration, result);
            }
        }
    }

    /// Hands a command to the loop and says so.
    fn obey(&mut self, request: Request, command: Command<'static>) {
        self.command(command);
        self.answer(request, Ok(()));
    }

    /// Checks a calibration and hands it to the loop.
    fn set_calibration(&mut self, calibration: &Calibration, store: bool) -> Result<(), Refusal> {
        self.device.may_change_settings()?;
        let mechanism = Mechanism::new(calibration).map_err(Refusal::Calibration)?;
        if self.device.is_storing() {
            return Err(Refusal::Busy);
        }
        let handed_over = self.ends.settings.enqueue(mechanism);
        handed_over.map_err(|_| Refusal::Busy)?;
        self.device.set_calibration(calibration, store);
        Ok(())
    }

    /// Drops the scene. The loop lets the force out by itself.
    fn drop_scene(&mut self) {
        if self.scene.take().is_some() {
            self.command(Command::DropScene);
        }
        self.forget_positions();
        self.requester.forget_asked();
    }

    /// Forgets what belongs to the positions of one scene.
    fn forget_positions(&mut self) {
        self.focus = None;
        self.points.clear();
        self.replay = ReplayProgress::default();
    }

    pub(super) fn on_bad_frame(&mut self, bad: BadFrame) {
        self.nothing_to_request_at = None;
        log::bad_frame(bad);
        self.bad_frames = self.bad_frames.saturating_add(1);
        // It may have been a tile. Where time stands still until that tile is
        // there, the time-out would never come.
        if self.scene.is_some_and(|scene| scene.hold_clock) {
            self.requester.forget_asked();
        }
    }

    fn open(&mut self, hello: HostHello) {
        self.forget_conversation();
        self.packed = 0;
        let answer = if hello.protocol == PROTOCOL {
            self.session = SessionState::Open;
            log::opened(self.bad_frames);
            self.device.session_opened();
            ToHost::Hello(self.device.hello(self.scene))
        } else {
            self.session = SessionState::Closed;
            log::refused(hello.protocol);
            ToHost::Refused { protocol: PROTOCOL }
        };
        self.say(&answer);
    }

    /// Forgets what was said and requested; keeps the scene and what is held.
    pub(super) fn forget_conversation(&mut self) {
        self.nothing_to_request_at = None;
        self.tx.clear();
        self.samples.clear();
        self.points.clear();
        self.requester.forget_asked();
    }

    fn take_scene(&mut self, scene: Scene) {
        let accepted = scene.is_valid();
        // The very scene in force goes on: its host came back.
        if accepted && self.scene != Some(scene) {
            self.requester.reset(scene.level, scene.size);
            self.forget_positions();
            self.scene = Some(scene);
            self.command(Command::Scene(scene));
        }
        let epoch = scene.epoch;
        log::scene(epoch, accepted);
        self.say(&ToHost::SceneTaken { epoch, accepted });
    }

    /// Takes a point. Each is rendered once; one that was answered is answered
    /// again.
    fn take_point(&mut self, point: Point) {
        if self.renders_arm() || self.scene.is_none() {
            return;
        }
        let is = |seq: u32| seq == point.seq;
        if let Some(last) = self.replay.last.filter(|r| r.answers.is_some_and(is)) {
            return self.answer_point(last);
        }
        if self.replay.under_way.is_some_and(is) || self.points.iter().any(|p| is(p.seq)) {
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
            device: device.hello(self.scene),
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
            bad_frames: self.bad_frames,
            dropped: self.samples_dropped(),
        }
    }

    /// Samples that were dropped here and by the loop.
    pub(super) fn samples_dropped(&self) -> u32 {
        self.dropped.wrapping_add(self.ends.monitor.dropped())
    }
}
