//! What the messages of one host mean, and what is sent to it.

mod hears;
mod turns;

use hapterra_core::contact::State;
use hapterra_core::phantom::Calibration;
use hapterra_core::terrain::{Focus, Puller, Tile};
use hapterra_core::tick::Command;
use hapterra_core::wire::message::{Point, Scene, Source, ToHost};
use hapterra_core::wire::status::{Answer, Refusal, Request, Status};
use heapless::{Deque, Vec};

use crate::channels::{Record, SPARES};
use crate::led::Signal;
use crate::link::desk::{Counts, Desk};
use crate::link::outbox::Outbox;
use crate::link::{Identity, LinkEnds};

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

    pub(crate) const fn bad_frames(&self) -> u32 {
        self.bad_frames
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
