//! The loop against a link that does not keep up.

use std::boxed::Box;
use std::vec::Vec;

use hapterra_core::Vec3;
use hapterra_core::contact::Rule;
use hapterra_core::force::ForceLaw;
use hapterra_core::grid::{Cell, GridPoint};
use hapterra_core::phantom::{Calibration, Mechanism};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{Point, Scene};
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
    haptics.configure(Mechanism::new(&Calibration::PREMIUM_1_5).expect("valid"));
    let haptic_loop = HapticLoop::new(
        haptics,
        loop_ends,
        VirtualEncoders::default(),
        VirtualAmplifiersOff,
        StoppedClock,
    );
    let scene = Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(640, 640),
        top: 3,
        cell_mm: 1.0,
        home: GridPoint::new([100, 100, 10], Vec3::ZERO),
        law: ForceLaw::PREMIUM,
        rule: Rule::Swept,
        source,
        hold_clock: false,
    };
    assert!(link_ends.commands.enqueue(Command::Scene(scene)).is_ok());
    (haptic_loop, link_ends)
}

fn drain(link_ends: &mut LinkEnds<'_>) -> Vec<TickRecord> {
    core::iter::from_fn(|| link_ends.records.dequeue()).collect()
}

#[test]
fn samples_that_find_no_room_are_counted() {
    let (mut haptic_loop, mut link_ends) = looped(Source::Encoders);
    for _ in 0..200 {
        haptic_loop.tick();
    }
    let dropped = link_ends.monitor.dropped();
    assert!(dropped > 100);
    assert_eq!(drain(&mut link_ends).len() as u32 + dropped, 200);
}

#[test]
fn an_answer_that_finds_no_room_is_kept_until_it_does() {
    let (mut haptic_loop, mut link_ends) = looped(Source::Points);
    let hip = GridPoint::new([100, 100, 2], Vec3::splat(0.5));
    let point = Point { seq: 9, hip };
    assert!(link_ends.commands.enqueue(Command::Point(point)).is_ok());
    // Without its tile the point waits, and what it waits for fills the queue.
    for _ in 0..100 {
        haptic_loop.tick();
    }
    let tile = Box::leak(Box::new(Tile::VACANT));
    let key = TileKey::holding(0, Cell::new(100, 100));
    tile.fill(key, 1, |_, _| 0.5).unwrap();
    assert!(link_ends.commands.enqueue(Command::Tile(tile)).is_ok());
    for _ in 0..5 {
        haptic_loop.tick();
    }
    let early = drain(&mut link_ends);
    assert!(early.iter().all(|record| record.answers.is_none()));
    for _ in 0..5 {
        haptic_loop.tick();
    }
    let late: Vec<_> = drain(&mut link_ends)
        .into_iter()
        .filter_map(|record| record.answers)
        .collect();
    assert_eq!(late, [9], "once, and only once");
}
