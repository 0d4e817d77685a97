//! The link's tile buffers, with a loop that the test simulates.

use std::boxed::Box;
use std::vec::Vec;

use hapterra_core::scene::Source;
use hapterra_core::terrain::{Tile, TileKey};
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::{FrameReader, decode};
use hapterra_core::wire::hello::SerialNumber;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::InSession;
use hapterra_core::wire::status::{BootReport, CalibrationSource};

use super::rig::{D, HELLO, frame, scene, tile};
use crate::app::{TileBuffers, WorkingMemory};
use crate::link::{ArmConfig, DeviceState, Link};
use crate::native::{FULL_SCALE_A, StoppedClock};
use crate::queues::{LoopEnds, QueuedTick, SPARES};

/// Returns a link in a session, and the loop's ends of its queues.
pub(super) fn link() -> (Link<'static, D>, LoopEnds<'static>) {
    let tiles = Box::leak(Box::new(TileBuffers::<D>::VACANT));
    let memory = Box::leak(Box::new(WorkingMemory::new()));
    let (loop_ends, link_ends) = memory.queues.split();
    let arm = ArmConfig {
        calibration: None,
        source: CalibrationSource::None,
        full_scale_a: FULL_SCALE_A,
        latency_us: 190,
    };
    let device = DeviceState::new::<StoppedClock, D>(
        ("test", SerialNumber::NONE),
        BootReport::default(),
        arm,
    );
    let mut link = Link::new(device, tiles.split().1, link_ends, &mut memory.link);
    let scene = scene(Source::Encoders);
    for message in [
        frame(&ToDevice::Hello(HELLO)),
        frame(&ToDevice::Scene(scene)),
    ] {
        assert_eq!(link.receive(&message), message.len());
    }
    (link, loop_ends)
}

/// Polls the link and returns the tiles that it requests.
fn requested_tiles(link: &mut Link<'static, D>) -> Vec<TileKey> {
    link.poll();
    let mut reader = FrameReader::<2048>::new();
    let mut bytes = [0; 4096];
    let n = link.transmit(&mut bytes);
    let mut rest = &bytes[..n];
    let mut keys = Vec::new();
    while !rest.is_empty() {
        let (consumed, frame) = reader.push(rest);
        let content = frame.map(|f| f.and_then(decode));
        if let Some(Ok(InSession {
            message: ToHost::TileRequest { key, .. },
            ..
        })) = content
        {
            keys.push(key);
        }
        rest = &rest[consumed..];
    }
    keys
}

fn answer(link: &mut Link<'static, D>, key: TileKey) {
    let bytes = tile(7, key);
    assert_eq!(link.receive(&bytes), bytes.len());
}

fn tiles_handed_over(loop_ends: &mut LoopEnds<'static>) -> Vec<&'static mut Tile> {
    let mut tiles = Vec::new();
    while let Some(command) = loop_ends.commands.dequeue() {
        if let Command::Tile(tile) = command {
            tiles.push(tile);
        }
    }
    tiles
}

/// Returns the loop's record with the HIP `column` tiles east of the first.
fn at(column: i32) -> QueuedTick {
    let mut record = QueuedTick::default();
    let cell = [column * 32 + 16, 100, 5];
    record.sample.hip = hapterra_core::grid::GridPoint::new(cell, hapterra_core::Vec3::ZERO);
    record.sample.proxy = record.sample.hip;
    record
}

#[test]
fn tile_requests_never_exceed_free_buffers() {
    let (mut link, mut loop_ends) = link();
    let mut total = 0;
    // The loop sleeps: no buffer returns, wherever the HIP moves.
    for column in 0..12 {
        assert!(loop_ends.records.enqueue(at(column)).is_ok());
        for key in requested_tiles(&mut link) {
            total += 1;
            answer(&mut link, key);
        }
    }
    assert_eq!(total, SPARES);
    let tiles = tiles_handed_over(&mut loop_ends);
    assert_eq!(tiles.len(), SPARES, "every answer found its buffer");
    // The loop wakes: the buffers return, and requests continue.
    for tile in tiles {
        tile.vacate();
        assert!(loop_ends.spent.enqueue(tile).is_ok());
    }
    assert!(!requested_tiles(&mut link).is_empty());
}

#[test]
fn rejected_tile_is_requested_again() {
    let (mut link, mut loop_ends) = link();
    let first = requested_tiles(&mut link);
    answer(&mut link, first[0]);
    assert!(
        !requested_tiles(&mut link).contains(&first[0]),
        "it counts as stored"
    );
    for tile in tiles_handed_over(&mut loop_ends) {
        assert!(loop_ends.spent.enqueue(tile).is_ok());
    }
    assert!(requested_tiles(&mut link).contains(&first[0]));
}
