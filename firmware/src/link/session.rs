//! What the messages of one host mean, and what is sent to it.

use hapterra_core::contact::State;
use hapterra_core::phantom::{Calibration, Mechanism};
use hapterra_core::terrain::{Focus, IN_FLIGHT, Puller, Tile};
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::BadFrame;
use hapterra_core::wire::message::{
    BATCH, Heights, HostHello, PROTOCOL, Point, Scene, Source, Telemetry, TileMessage, ToDevice,
    ToHost,
};
use hapterra_core::wire::status::{Answer, Refusal, Request, Status};
use heapless::{Deque, Vec};

use super::desk::{Counts, Desk};
use super::focus::follow;
use super::log;
use super::outbox::Outbox;
use super::{Identity, LinkEnds};
use crate::channels::{Record, SPARES};
use crate::led::Signal;
use crate::vitals::Part;

/// Samples kept for the writer; beyond them, new ones are dropped.
const BACKLOG: usize = 16;
/// Samples on their way to the writer.
pub(crate) type Backlog = Deque<Record, BACKLOG>;
/// Points a host may send ahead; beyond them, they are dropped.
pub const POINTS_AHEAD: usize = 16;

/// Where the conversation stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// No host has said hello, or one of another protocol did.
    Closed,
    /// A session.
    Open,
    /// The host said goodbye.
    Ended,
}

/// Where a point of a replay stands.
#[derive(Clone, Copy, Debug, Default)]
struct Replay {
    /// The number of the point that the loop is feeling.
    under_way: Option<u32>,
    /// The last answer, for a host that missed it.
    last: Option<Record>,
}

/// The state of the link above the framing.
pub(crate) struct Session<'t, const D: usize> {
    stage: Stage,
    /// Everything about arming, calibration and status.
    pub(super) desk: Desk,
    scene: Option<Scene>,
    puller: Puller<D>,
    /// The millisecond in which the puller last had nothing to ask for, while
    /// nothing has changed since. It looks far around: not at every tick.
    content: Option<u32>,
    focus: Option<Focus>,
    previous: Record,
    spare: Vec<&'t mut Tile, SPARES>,
    ends: LinkEnds<'t>,
    points: Deque<Point, POINTS_AHEAD>,
    replay: Replay,
    outbox: &'t mut Outbox,
    backlog: &'t mut Backlog,
    /// Telemetry samples packed in this session.
    packed: u32,
    /// Samples dropped here; those dropped by the loop are in the vitals.
    dropped: u32,
    bad_frames: u32,
}

impl<'t, const D: usize> Session<'t, D> {
    pub(crate) fn new(
        mut identity: Identity,
        spare: [&'t mut Tile; SPARES],
        ends: LinkEnds<'t>,
        outbox: &'t mut Outbox,
        backlog: &'t mut Backlog,
    ) -> Self {
        identity.hello.window = u8::try_from(D).unwrap_or(u8::MAX);
        Self {
            stage: Stage::Closed,
            desk: Desk::new(identity),
            scene: None,
            puller: Puller::new(),
            content: None,
            focus: None,
            previous: Record::default(),
            spare: spare.into_iter().collect(),
            ends,
            points: Deque::new(),
            replay: Replay::default(),
            outbox,
            backlog,
            packed: 0,
            dropped: 0,
            bad_frames: 0,
        }
    }

    /// Whether a message can be acted on: it may need one command and one answer.
    pub(crate) fn has_room(&self) -> bool {
        self.ends.commands.ready() && self.outbox.has_room()
    }

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

    fn status(&self) -> Status {
        let counts = Counts {
            bad_frames: self.bad_frames,
            dropped: self.dropped,
        };
        let epoch = self.scene.map(|scene| scene.epoch);
        self.desk
            .status(self.ends.vitals, &self.previous.sample, epoch, counts)
    }

    /// A calibration waits to be stored: see [`Self::stored`].
    pub(crate) fn to_store(&self) -> Option<Calibration> {
        self.desk.to_store()
    }

    /// How storing it went.
    pub(crate) fn stored(&mut self, result: Result<(), Refusal>) {
        self.desk.stored(result);
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

    pub(crate) const fn bad_frames(&self) -> u32 {
        self.bad_frames
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

    pub(crate) fn turn(&mut self) {
        self.ends.vitals.check_in(Part::Link);
        self.reclaim();
        self.collect();
        self.tell();
        self.feed_points();
        self.ask();
        self.pack();
    }

    /// Takes back the tile buffers that the loop is done with.
    fn reclaim(&mut self) {
        while let Some(tile) = self.ends.spent.dequeue() {
            self.content = None;
            // It bears its own name if the window would not have it, and the
            // name of what it pushed out otherwise: either is not held.
            if let Some(key) = tile.key() {
                self.puller.lost(key);
            }
            self.give_back(tile);
        }
    }

    fn give_back(&mut self, tile: &'t mut Tile) {
        // There are no more buffers than places.
        let _ = self.spare.push(tile);
    }

    /// Reads what the loop recorded since the last turn.
    fn collect(&mut self) {
        while self.outbox.has_room() {
            let Some(record) = self.ends.records.dequeue() else {
                return;
            };
            self.content = None;
            self.focus = Some(follow(&self.previous, &record, self.desk.ticks_per_ms()));
            self.previous = record;
            if record.answers.is_some() {
                self.replay.under_way = None;
                self.replay.last = Some(record);
                self.say_felt(record);
            } else if self.feels_arm() {
                self.keep(record);
            }
        }
    }

    /// Tells where the loop stands, and what became of requests.
    fn tell(&mut self) {
        while let Some(health) = self.ends.healths.dequeue() {
            self.desk.take(health);
        }
        while self.stage == Stage::Open && self.outbox.has_room() {
            let Some(message) = self.desk.next_to_say() else {
                return;
            };
            self.say(&message);
        }
    }

    fn keep(&mut self, record: Record) {
        if self.stage == Stage::Open && self.backlog.push_back(record).is_err() {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }

    /// One point at a time: the loop would forget a second.
    fn feed_points(&mut self) {
        if self.replay.under_way.is_some() || !self.ends.commands.ready() {
            return;
        }
        if let Some(point) = self.points.pop_front() {
            self.replay.under_way = Some(point.seq);
            self.command(Command::Point(point));
        }
    }

    /// Asks for tiles, each with a buffer waiting for it.
    fn ask(&mut self) {
        let (Stage::Open, Some(scene)) = (self.stage, self.scene) else {
            return;
        };
        let focus = self.focus.unwrap_or_else(|| Focus {
            proxy: scene.home.column(),
            hip: scene.home.column(),
            ..Focus::default()
        });
        let now = self.desk.milliseconds(self.ends.vitals.ticks());
        if self.content == Some(now) {
            return;
        }
        while self.outbox.has_room() && self.has_buffer_for_another() {
            let Some(key) = self.puller.next_request(now, &focus) else {
                self.content = Some(now);
                return;
            };
            let epoch = scene.epoch;
            self.say(&ToHost::Need { epoch, key });
        }
    }

    /// With all under way that may be, the puller only asks again.
    fn has_buffer_for_another(&self) -> bool {
        let in_flight = self.puller.in_flight();
        self.spare.len() > in_flight || in_flight == IN_FLIGHT
    }

    /// Packs the next telemetry message, once the last one has left.
    fn pack(&mut self) {
        let enough = self.backlog.len() >= BATCH || self.stage == Stage::Ended;
        if !enough || self.backlog.is_empty() || !self.outbox.wants_telemetry() {
            return;
        }
        let mut samples = Vec::new();
        while !samples.is_full() {
            let Some(record) = self.backlog.pop_front() else {
                break;
            };
            let _ = samples.push(record.sample);
        }
        let first = self.packed;
        self.packed = self.packed.wrapping_add(samples.len() as u32);
        let lost_by_loop = self.ends.vitals.dropped();
        self.outbox.push_telemetry(Telemetry {
            first,
            dropped: self.dropped.wrapping_add(lost_by_loop),
            samples,
        });
    }

    pub(crate) fn transmit(&mut self, into: &mut [u8]) -> usize {
        let mut n = 0;
        while let Some(rest) = into.get_mut(n..).filter(|rest| !rest.is_empty()) {
            n += match self.outbox.take(rest) {
                0 => {
                    self.pack();
                    if self.outbox.is_empty() {
                        break;
                    }
                    0
                }
                taken => taken,
            };
        }
        n
    }

    pub(crate) fn may_stand_still(&self) -> bool {
        let waits = match &self.scene {
            None => true,
            Some(scene) if scene.source == Source::Points => self.replay.under_way.is_none(),
            Some(scene) if scene.hold_clock && self.puller.in_flight() > 0 => return true,
            Some(_) => false,
        };
        // What was said to the loop is to reach it, and force to go out.
        waits
            && self.ends.commands.is_empty()
            && self.ends.settings.is_empty()
            && self.desk.is_at_rest()
    }

    pub(crate) fn feels_arm(&self) -> bool {
        self.scene.is_some_and(|s| s.source == Source::Encoders)
    }

    pub(crate) fn signal(&self) -> Signal {
        let touching = self.previous.sample.state == State::Touching;
        Signal::of(self.desk.report(), touching)
    }

    pub(crate) fn drives_arm(&self) -> bool {
        self.feels_arm() || self.desk.drives()
    }

    pub(crate) fn has_ended(&self) -> bool {
        let said = self.backlog.is_empty() && self.outbox.is_empty();
        self.stage == Stage::Ended && said && !self.desk.drives()
    }

    fn answer(&mut self, request: Request, result: Result<(), Refusal>) {
        self.say(&ToHost::Answer(Answer { request, result }));
    }

    fn command(&mut self, command: Command<'t>) {
        // `has_room` was asked before anything that leads here.
        let _ = self.ends.commands.enqueue(command);
    }

    fn say_felt(&mut self, record: Record) {
        if let Some(seq) = record.answers.filter(|_| self.stage == Stage::Open) {
            let sample = record.sample;
            self.say(&ToHost::Felt { seq, sample });
        }
    }

    fn say(&mut self, message: &ToHost) {
        // `has_room` was asked before anything that leads here.
        self.outbox.push(message);
    }
}
