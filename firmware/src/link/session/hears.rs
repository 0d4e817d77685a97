//! What the host says.

use hapterra_core::phantom::{Calibration, Mechanism};
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::BadFrame;
use hapterra_core::wire::message::{
    Heights, HostHello, PROTOCOL, Point, Scene, TileMessage, ToDevice, ToHost,
};
use hapterra_core::wire::status::{Refusal, Request};

use super::{Replay, Session, Stage};
use crate::link::log;

impl<'t, const D: usize> Session<'t, D> {
    pub(crate) fn on_message(&mut self, message: ToDevice<'_>) {
        self.content = None;
        match (message, self.stage) {
            (ToDevice::Hello(hello), _) => self.open(hello),
            (_, Stage::Closed | Stage::Ended) => {}
            (ToDevice::Scene(scene), _) => self.take_scene(scene),
            (ToDevice::Tile(tile), _) => self.take_tile(&tile),
            (ToDevice::Point(point), _) => self.take_point(point),
            (ToDevice::Bye, _) => self.end(),
            (ToDevice::DropScene, _) => {
                self.drop_scene();
                self.answer(Request::DropScene, Ok(()));
            }
            (ToDevice::Status, _) => {
                let status = self.status();
                self.say(&ToHost::Status(status));
            }
            (ToDevice::GetCalibration, _) => {
                self.say(&ToHost::Calibration(self.desk.calibration()));
            }
            (ToDevice::Arm, _) => {
                self.desk.arm();
                self.command(Command::Arm);
            }
            (ToDevice::Disarm, _) => {
                self.command(Command::Disarm);
                self.answer(Request::Disarm, Ok(()));
            }
            (ToDevice::ClearFault, _) => {
                self.command(Command::ClearFault);
                self.answer(Request::ClearFault, Ok(()));
            }
            (ToDevice::Zero { counts }, _) => self.take_zero(counts),
            (ToDevice::SetCalibration { calibration, store }, _) => {
                self.take_calibration(&calibration, store);
            }
        }
    }

    fn take_zero(&mut self, counts: [i32; 3]) {
        let result = self.desk.may_change_settings();
        if result.is_ok() {
            self.command(Command::Zero(counts));
        }
        self.answer(Request::Zero, result);
    }

    fn take_calibration(&mut self, calibration: &Calibration, store: bool) {
        let result = self.hand_over(calibration, store);
        self.answer(Request::SetCalibration, result);
    }

    /// Checks a calibration and hands it to the loop.
    fn hand_over(&mut self, calibration: &Calibration, store: bool) -> Result<(), Refusal> {
        self.desk.may_change_settings()?;
        let mechanism = Mechanism::new(calibration).map_err(Refusal::Calibration)?;
        if self.desk.is_storing() {
            return Err(Refusal::Busy);
        }
        let handed_over = self.ends.settings.enqueue(mechanism);
        handed_over.map_err(|_| Refusal::Busy)?;
        self.desk.set_calibration(calibration, store);
        Ok(())
    }

    fn end(&mut self) {
        self.drop_scene();
        self.stage = Stage::Ended;
    }

    /// The loop fades the force out by itself.
    fn drop_scene(&mut self) {
        if self.scene.take().is_some() {
            self.command(Command::DropScene);
        }
        self.focus = None;
        self.points.clear();
        self.replay = Replay::default();
        self.puller.forget_asked();
    }

    pub(crate) fn on_bad_frame(&mut self, bad: BadFrame) {
        self.content = None;
        log::bad_frame(bad);
        self.bad_frames = self.bad_frames.saturating_add(1);
        // It may have been a tile. Where time stands still until that tile is
        // there, the time-out would never come.
        if self.scene.is_some_and(|scene| scene.hold_clock) {
            self.puller.forget_asked();
        }
    }

    fn open(&mut self, hello: HostHello) {
        self.interrupted();
        self.packed = 0;
        let answer = if hello.protocol == PROTOCOL {
            self.stage = Stage::Open;
            log::opened(self.bad_frames);
            self.desk.opened();
            ToHost::Hello(self.desk.hello(self.scene.map(|scene| scene.epoch)))
        } else {
            self.stage = Stage::Closed;
            log::refused(hello.protocol);
            ToHost::Refused { protocol: PROTOCOL }
        };
        self.say(&answer);
    }

    /// Forgets what was said and asked, keeps the scene and what is held.
    pub(crate) fn interrupted(&mut self) {
        self.content = None;
        self.outbox.clear();
        self.backlog.clear();
        self.points.clear();
        self.puller.forget_asked();
    }

    fn take_scene(&mut self, scene: Scene) {
        let accepted = scene.is_valid();
        // The very scene in force goes on: its host came back.
        if accepted && self.scene != Some(scene) {
            self.puller.reset(scene.level, scene.size);
            self.focus = None;
            self.points.clear();
            self.replay = Replay::default();
            self.scene = Some(scene);
            self.command(Command::Scene(scene));
        }
        let epoch = scene.epoch;
        log::scene(epoch, accepted);
        self.say(&ToHost::SceneTaken { epoch, accepted });
    }

    fn take_tile(&mut self, message: &TileMessage<'_>) {
        let ours = self.scene.is_some_and(|s| s.epoch == message.epoch);
        if !ours || !self.puller.awaits(message.key) {
            return;
        }
        self.reclaim();
        let Some(tile) = self.spare.pop() else {
            return;
        };
        let key = message.key;
        let filled = match message.heights {
            Heights::Hole => tile.fill(key, 0, |_, _| f32::NAN),
            Heights::Flat { base, height } => tile.fill(key, base, |_, _| height),
            Heights::Samples { base, bytes } => tile.load(key, base, bytes),
        };
        if filled.is_err() {
            tile.vacate();
            self.give_back(tile);
            return self.on_bad_frame(BadFrame::Content);
        }
        self.puller.received(key);
        self.command(Command::Tile(tile));
    }

    /// A point is felt once; one that was answered is answered again.
    fn take_point(&mut self, point: Point) {
        if self.feels_arm() || self.scene.is_none() {
            return;
        }
        let is = |seq: u32| seq == point.seq;
        if let Some(last) = self.replay.last.filter(|r| r.answers.is_some_and(is)) {
            return self.say_felt(last);
        }
        if self.replay.under_way.is_some_and(is) || self.points.iter().any(|p| is(p.seq)) {
            return;
        }
        // A host that does not wait for answers loses points.
        let _ = self.points.push_back(point);
    }
}
