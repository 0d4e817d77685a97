//! The loop with a link that is too slow.

use std::boxed::Box;
use std::vec::Vec;

use hapterra_core::Vec3;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::{Cell, GridPoint};
use hapterra_core::guard::{Blockers, Limits};
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{HipCommand, Scene, Source};
use hapterra_core::terrain::{FieldSize, Tile, TileKey};

use super::*;
use crate::app::{TileBuffers, WorkingMemory};
use crate::native::{StoppedClock, VirtualAmplifiersOff, VirtualEncoders};
use crate::queues::LinkEnds;

type Loop = HapticLoop<'static, VirtualEncoders, VirtualAmplifiersOff, StoppedClock, 4>;

fn looped(source: Source) -> (Loop, LinkEnds<'static>) {
    let tiles = Box::leak(Box::new(TileBuffers::<4>::VACANT));
    let memory = Box::leak(Box::new(WorkingMemory::new()));
    let (loop_ends, mut link_ends) = memory.queues.split();
    let mut haptics = Haptics::new(tiles.split().0, TickRate::DEFAULT, None);
    haptics.configure(Kinematics::new(&Calibration::PREMIUM_1_5).expect("valid"));
    let haptic_loop = HapticLoop::new(
        haptics,
        loop_ends,
        VirtualEncoders::default(),
        VirtualAmplifiersOff,
        StoppedClock,
    );
    let scene = scene(source);
    assert!(link_ends.commands.enqueue(Command::Scene(scene)).is_ok());
    (haptic_loop, link_ends)
}

fn scene(source: Source) -> Scene {
    Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(640, 640),
        top: 3,
        fallback: None,
        cell_mm: 1.0,
        home: GridPoint::new([100, 100, 10], Vec3::ZERO),
        params: SurfaceParams::PREMIUM,
        source,
        hold_clock: false,
        materials: None,
    }
}

fn drain(link_ends: &mut LinkEnds<'_>) -> Vec<QueuedTick> {
    core::iter::from_fn(|| link_ends.records.dequeue()).collect()
}

#[test]
fn samples_without_room_are_counted() {
    let (mut haptic_loop, mut link_ends) = looped(Source::Encoders);
    for _ in 0..200 {
        haptic_loop.tick();
    }
    let dropped = link_ends.monitor.dropped();
    assert!(dropped > 100);
    assert_eq!(drain(&mut link_ends).len() as u32 + dropped, 200);
}

/// Moves the arm by 100 counts a tick and returns its position.
fn wave(haptic_loop: &mut Loop, from: i32, ticks: i32) -> i32 {
    for n in 1..=ticks {
        haptic_loop.encoders_mut().0.counts = [from + 100 * n; 3];
        assert_eq!(haptic_loop.tick(), GuardOutputs::default());
    }
    from + 100 * ticks
}

/// Safety: 35.
#[test]
fn arm_is_monitored_in_every_tick_of_a_replay() {
    let (mut haptic_loop, mut link_ends) = looped(Source::Encoders);
    assert!(link_ends.commands.enqueue(Command::Zero([0; 3])).is_ok());
    let at = wave(&mut haptic_loop, 0, 2);
    let points = Command::Scene(scene(Source::Points));
    assert!(link_ends.commands.enqueue(points).is_ok());
    // Between two points.
    let at = wave(&mut haptic_loop, at, 50);
    // While a point waits for its tile; tile requests fill the queue.
    let hip = GridPoint::new([100, 100, 2], Vec3::splat(0.5));
    let point = HipCommand { seq: 9, hip };
    assert!(link_ends.commands.enqueue(Command::Hip(point)).is_ok());
    let at = wave(&mut haptic_loop, at, 50);
    // While its answer has no room in the queue.
    let tile = Box::leak(Box::new(Tile::VACANT));
    let key = TileKey::containing(0, Cell::new(100, 100));
    tile.fill(key, 1, |_, _| 0.5).unwrap();
    assert!(link_ends.commands.enqueue(Command::Tile(tile)).is_ok());
    let at = wave(&mut haptic_loop, at, 50);
    assert!(haptic_loop.unsent.is_some(), "the case under test");
    drain(&mut link_ends);
    let at = wave(&mut haptic_loop, at, 2);
    // And then the arm is rendered.
    assert!(link_ends.commands.enqueue(Command::DropScene).is_ok());
    wave(&mut haptic_loop, at, 2);
    assert_eq!(haptic_loop.haptics.report().fault, None);
    let report = || link_ends.health.dequeue();
    let latest = core::iter::from_fn(report).last().expect("a report");
    assert_eq!(latest.health.zero, Some([0; 3]));
    haptic_loop.encoders_mut().0.counts = [0; 3];
    haptic_loop.tick();
    let fault = haptic_loop.haptics.report().fault;
    assert_eq!(fault, Some(Fault::EncoderJump), "a true one is noticed");
}

#[test]
fn unsent_answer_is_sent_once_there_is_room() {
    let (mut haptic_loop, mut link_ends) = looped(Source::Points);
    let hip = GridPoint::new([100, 100, 2], Vec3::splat(0.5));
    let point = HipCommand { seq: 9, hip };
    assert!(link_ends.commands.enqueue(Command::Hip(point)).is_ok());
    // Without its tile the point waits, and tile requests fill the queue.
    for _ in 0..100 {
        haptic_loop.tick();
    }
    let tile = Box::leak(Box::new(Tile::VACANT));
    let key = TileKey::containing(0, Cell::new(100, 100));
    tile.fill(key, 1, |_, _| 0.5).unwrap();
    assert!(link_ends.commands.enqueue(Command::Tile(tile)).is_ok());
    for _ in 0..5 {
        haptic_loop.tick();
    }
    let early = drain(&mut link_ends);
    assert!(early.iter().all(|record| record.answered_seq.is_none()));
    for _ in 0..5 {
        haptic_loop.tick();
    }
    let late: Vec<_> = drain(&mut link_ends)
        .into_iter()
        .filter_map(|record| record.answered_seq)
        .collect();
    assert_eq!(late, [9], "once, and only once");
}

/// Amplifiers that store the last command where a test can read it.
#[derive(Clone, Default)]
struct RecordedAmplifiers(std::rc::Rc<core::cell::RefCell<(bool, [f32; 3])>>);

impl Amplifiers for RecordedAmplifiers {
    type Enabled = RecordedAmplifiersOn;

    fn enable(self) -> RecordedAmplifiersOn {
        *self.0.borrow_mut() = (true, [0.0; 3]);
        RecordedAmplifiersOn(self)
    }

    fn set_held_outputs(&mut self, held: [f32; 3]) {
        *self.0.borrow_mut() = (false, held);
    }
}

struct RecordedAmplifiersOn(RecordedAmplifiers);

impl EnabledAmplifiers for RecordedAmplifiersOn {
    type Disabled = RecordedAmplifiers;

    fn write(&mut self, _currents_a: [f32; 3]) {}

    fn disable(self) -> RecordedAmplifiers {
        *self.0.0.borrow_mut() = (false, [0.0; 3]);
        self.0
    }
}

#[test]
fn held_outputs_reach_the_amplifiers_and_leave_them_off() {
    let tiles = Box::leak(Box::new(TileBuffers::<4>::VACANT));
    let memory = Box::leak(Box::new(WorkingMemory::new()));
    let (loop_ends, mut link_ends) = memory.queues.split();
    let haptics = Haptics::new(tiles.split().0, TickRate::DEFAULT, None);
    let recorded = RecordedAmplifiers::default();
    let encoders = VirtualEncoders::default();
    let mut haptic_loop = HapticLoop::new(
        haptics,
        loop_ends,
        encoders,
        recorded.clone(),
        StoppedClock::<1>,
    );
    let held = [0.5, -1.0, 0.25];
    // This needs neither a calibration nor a scene.
    for (command, expected) in [(Some(held), held), (None, [0.0; 3])] {
        let command = Command::HoldOutputs(command);
        assert!(link_ends.commands.enqueue(command).is_ok());
        haptic_loop.tick();
        assert_eq!(*recorded.0.borrow(), (false, expected));
    }
}

/// Returns the clutch's state after `ticks` ticks with this reading of the input.
fn limits_after(
    haptic_loop: &mut Loop,
    ends: &mut LinkEnds<'_>,
    ticks: u32,
    reads: bool,
) -> Limits {
    for _ in 0..ticks {
        haptic_loop.encoders_mut().0.clutch = reads;
        let _ = haptic_loop.tick();
    }
    drain(ends).last().expect("records").sample.limits
}

#[test]
fn debounced_clutch_input_opens_the_clutch() {
    let (mut haptic_loop, mut ends) = looped(Source::Encoders);
    let of_clutch = Limits::CLUTCH_INPUT | Limits::CLUTCH_OPEN | Limits::CLUTCH_MOVES;
    let mut limits =
        |ticks, reads| limits_after(&mut haptic_loop, &mut ends, ticks, reads) & of_clutch;
    assert_eq!(limits(4, true), Limits::empty());
    assert_eq!(limits(10, false), Limits::empty());
    let opening = Limits::CLUTCH_INPUT | Limits::CLUTCH_MOVES;
    assert_eq!(limits(6, true), opening);
    let open = Limits::CLUTCH_INPUT | Limits::CLUTCH_OPEN;
    for _ in 0..3 {
        assert_eq!(limits(30, true), opening, "the clutch opens in 0.1 s");
    }
    assert_eq!(limits(30, true), open);
    assert_eq!(limits(19, false), open);
    assert_eq!(limits(2, false), Limits::CLUTCH_MOVES);
}

/// Safety: 7.
#[test]
fn refused_scene_leaves_nothing_to_render() {
    for source in [Source::Encoders, Source::Points] {
        let (mut haptic_loop, mut link_ends) = looped(source);
        haptic_loop.tick();
        assert_ne!(haptic_loop.haptics.source(), HipSource::None);
        drain(&mut link_ends);
        let refused = Scene {
            cell_mm: f32::NAN,
            ..scene(Source::Encoders)
        };
        assert!(link_ends.commands.enqueue(Command::Scene(refused)).is_ok());
        assert!(link_ends.commands.enqueue(Command::Arm).is_ok());
        for _ in 0..100 {
            assert_eq!(haptic_loop.tick(), GuardOutputs::default());
        }
        // Loop and guard agree, so the guard refuses to arm.
        assert_eq!(haptic_loop.haptics.source(), HipSource::None);
        assert!(drain(&mut link_ends).is_empty());
        let refused = haptic_loop.haptics.report().decision.refused;
        assert!(refused.contains(Blockers::NO_SCENE), "{refused:?}");
    }
}
