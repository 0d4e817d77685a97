//! What a session does when things go wrong.

use std::collections::HashSet;
use std::vec;
use std::vec::Vec;

use hapterra_core::scene::{Sample, Scene, Source};
use hapterra_core::terrain::RETRY_TICKS;
use hapterra_core::wire::hello::PROTOCOL;
use hapterra_core::wire::message::{BATCH, Heights, TileMessage, ToDevice, ToHost};

use super::rig::{Rig, frame, hello, point, scene, tile};

/// What the points of a descent feel like; nothing about ticks and costs.
fn forces(felt: &[(u32, Sample)]) -> Vec<(u32, hapterra_core::Vec3)> {
    felt.iter().map(|(seq, s)| (*seq, s.force_n)).collect()
}

fn undisturbed() -> Vec<(u32, hapterra_core::Vec3)> {
    forces(&Rig::in_scene(scene(Source::Points)).descend(40))
}

#[test]
fn another_protocol_is_refused_and_nothing_after_it_is_heeded() {
    let mut rig = Rig::new();
    rig.send(&hello(PROTOCOL + 1));
    rig.send(&frame(&ToDevice::Scene(scene(Source::Points))));
    rig.run(3);
    let refused = ToHost::Refused { protocol: PROTOCOL };
    assert_eq!(rig.heard, [refused]);
    rig.send(&hello(PROTOCOL));
    rig.run(1);
    assert!(matches!(rig.heard[1], ToHost::Hello(_)));
}

#[test]
fn nothing_is_heeded_before_hello() {
    let mut rig = Rig::new();
    rig.send(&frame(&ToDevice::Scene(scene(Source::Points))));
    rig.send(&point(0, 0.0, 0.0));
    rig.run(3);
    assert_eq!(rig.heard, []);
}

#[test]
fn every_flipped_bit_of_the_first_tile_costs_a_retry_and_nothing_else() {
    // One damaged bit in each rig; all bits would be 35,000 rigs.
    for bit in (0..8 * 4370).step_by(997) {
        let mut rig = Rig::asking(scene(Source::Points));
        let mut bytes = tile(7, rig.needs()[0]);
        if let Some(byte) = bytes.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
        rig.send(&bytes);
        rig.answers_tiles = true;
        let felt = rig.descend(40);
        assert_eq!(forces(&felt), undisturbed(), "bit {bit}");
        assert!(felt.last().unwrap().1.tick > RETRY_TICKS, "bit {bit}");
    }
}

#[test]
fn a_dropped_byte_costs_a_retry_and_nothing_else() {
    for at in [0, 1, 5, 100, 4000, 4369] {
        let mut rig = Rig::asking(scene(Source::Points));
        let mut bytes = tile(7, rig.needs()[0]);
        bytes.remove(at);
        rig.send(&bytes);
        rig.answers_tiles = true;
        let felt = rig.descend(40);
        assert_eq!(forces(&felt), undisturbed(), "byte {at}");
        assert!(felt.last().unwrap().1.tick > RETRY_TICKS, "byte {at}");
    }
}

#[test]
fn duplicated_frames_change_nothing() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.damage = |bytes| bytes.extend_from_within(..);
    for seq in 0..40 {
        let bytes = point(seq, seq as f32 * 0.9, 4.0 - seq as f32 * 0.1);
        rig.send(&[&*bytes, &*bytes].concat());
        rig.run(600);
    }
    let mut felt = rig.felt();
    // The second of each pair is answered, too, with the same words.
    assert!(felt.len() >= 40);
    felt.dedup();
    assert_eq!(forces(&felt), undisturbed());
}

#[test]
fn a_point_whose_answer_was_lost_is_answered_again_without_being_felt_again() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    let first = rig.descend(3)[2];
    rig.send(&point(2, 1.8, 3.8));
    rig.run(2);
    assert_eq!(rig.felt()[3..], [first]);
}

#[test]
fn a_point_repeated_while_it_is_felt_is_felt_once() {
    let mut rig = Rig::asking(scene(Source::Points));
    for _ in 0..3 {
        rig.send(&point(0, 0.0, 2.0));
        rig.run(5);
    }
    assert_eq!(rig.felt(), [], "its tile is not there yet");
    rig.send(&tile(7, rig.needs()[0]));
    rig.answers_tiles = true;
    rig.run(1000);
    assert_eq!(rig.felt().len(), 1);
}

#[test]
fn a_tile_that_was_received_is_not_replaced_by_a_late_double() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.descend(1);
    for key in rig.needs() {
        let heights = Heights::Flat {
            base: 2,
            height: 0.9,
        };
        let epoch = 7;
        rig.send(&frame(&ToDevice::Tile(TileMessage {
            epoch,
            key,
            heights,
        })));
    }
    // The first point is answered twice.
    let felt = rig.descend(40);
    let asked = rig.needs();
    let unique: HashSet<_> = asked
        .iter()
        .map(|key| (key.index.col, key.index.row))
        .collect();
    assert_eq!(
        asked.len(),
        unique.len(),
        "nothing had to be asked for twice"
    );
    assert_eq!(forces(&felt[1..]), undisturbed());
}

#[test]
fn joined_in_the_middle_of_a_frame() {
    for cut in [1, 2, 100, 4000] {
        let mut rig = Rig::new();
        let key = hapterra_core::terrain::TileKey::new(0, 0, 0);
        rig.send(&tile(7, key)[cut..]);
        rig.send(&hello(PROTOCOL));
        rig.run(1);
        assert!(matches!(rig.heard[0], ToHost::Hello(_)), "cut {cut}");
    }
}

#[test]
fn a_zero_before_hello_ends_what_the_last_host_left_unfinished() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.run(3);
    rig.heard.clear();
    rig.send(&point(0, 0.0, 2.0)[..4]);
    rig.send(&[0]);
    rig.send(&hello(PROTOCOL));
    rig.run(1);
    assert!(matches!(rig.heard[0], ToHost::Hello(_)));
}

#[test]
fn a_storm_of_garbage_passes() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    let mut noise = 1u32;
    let storm: Vec<u8> = (0..200_000)
        .map(|_| {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (noise >> 24) as u8
        })
        .collect();
    rig.send(&storm);
    rig.send(&[0]);
    rig.run(2);
    assert!(rig.on_the_way.is_empty(), "all was taken");
    assert_eq!(forces(&rig.descend(40)), undisturbed());
}

#[test]
fn a_host_that_dies_is_felt_on_and_one_that_returns_goes_on() {
    let mut rig = Rig::armed();
    let asked = rig.needs().len();
    // Gone: nothing is read, nothing is sent.
    rig.writer = 0;
    for _ in 0..1000 {
        assert!(rig.device.tick(rig.sense).enabled, "rendering goes on");
    }
    rig.device.link.interrupted();
    rig.writer = usize::MAX;
    rig.heard.clear();
    rig.send(&hello(PROTOCOL));
    rig.send(&frame(&ToDevice::Scene(scene(Source::Encoders))));
    rig.run(300);
    let ToHost::Hello(device) = &rig.heard[0] else {
        panic!("{:?}", rig.heard[0]);
    };
    assert_eq!(device.epoch, Some(7), "it says what it still holds");
    assert!(
        asked > 0 && rig.needs().is_empty(),
        "and asks for none of it"
    );
    let first = &rig.telemetry()[0];
    assert_eq!(first.first, 0, "a session counts its samples from zero");
    assert!(first.samples[0].tick > 1000, "but the scene went on");
}

#[test]
fn a_host_that_returns_with_another_scene_starts_afresh() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    rig.descend(5);
    rig.heard.clear();
    rig.send(&hello(PROTOCOL));
    let other = Scene {
        epoch: 8,
        ..scene(Source::Points)
    };
    rig.send(&frame(&ToDevice::Scene(other)));
    rig.run(5);
    assert!(!rig.needs().is_empty(), "what it held is of another scene");
    assert_eq!(forces(&rig.descend(40)), undisturbed());
}

#[test]
fn tiles_of_another_scene_and_tiles_nobody_asked_for_are_dropped() {
    let mut rig = Rig::asking(scene(Source::Points));
    let asked = rig.needs()[0];
    let unasked = hapterra_core::terrain::TileKey::new(asked.level, 9, asked.index.row);
    rig.send(&tile(6, asked));
    rig.send(&tile(7, unasked));
    rig.send(&point(0, 0.0, 2.0));
    rig.run(20);
    assert_eq!(rig.felt(), [], "the point still waits for its tile");
    rig.send(&tile(7, asked));
    rig.answers_tiles = true;
    rig.run(20);
    assert_eq!(rig.felt().len(), 1);
}

#[test]
fn a_slow_link_drops_telemetry_and_counts_it_and_nothing_else() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    // A sample takes about 60 bytes a tick.
    rig.writer = 20;
    rig.run(3000);
    let dropped = rig.telemetry().last().unwrap().dropped;
    assert!(dropped > 1000, "{dropped}");
    let needs = rig.needs();
    // Caught up, every sample was either delivered or counted.
    rig.writer = usize::MAX;
    rig.run(100);
    let mut next = 0;
    for telemetry in rig.telemetry() {
        assert_eq!(telemetry.first, next, "no gap on the link itself");
        next += telemetry.samples.len() as u32;
    }
    let last = rig.telemetry().last().unwrap().clone();
    assert_eq!(next + last.dropped, last.samples[BATCH - 1].tick);
    let fast = {
        let mut rig = Rig::in_scene(scene(Source::Encoders));
        rig.run(3000);
        rig.needs()
    };
    assert_eq!(needs, fast, "every tile was asked for once");
}

#[test]
fn a_tile_that_never_comes_is_asked_for_again_and_again() {
    let mut rig = Rig::asking(scene(Source::Encoders));
    let first = rig.needs()[0];
    rig.run(4 * RETRY_TICKS + 1);
    let again = rig.needs();
    assert_eq!(again.iter().filter(|key| **key == first).count(), 5);
}

#[test]
fn where_time_stands_still_a_damaged_tile_is_asked_for_at_once() {
    let held = Scene {
        hold_clock: true,
        ..scene(Source::Encoders)
    };
    let mut rig = Rig::asking(held);
    assert!(rig.device.link.may_stand_still());
    let mut bytes = tile(7, rig.needs()[0]);
    bytes[9] ^= 1;
    rig.send(&bytes);
    rig.answers_tiles = true;
    rig.run(20);
    assert!(!rig.device.link.may_stand_still(), "time goes on");
}

#[test]
fn a_host_that_floods_is_held_back_not_obeyed() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(100);
    rig.writer = 0;
    let same = frame(&ToDevice::Scene(scene(Source::Encoders)));
    rig.send(&vec![&*same; 500].concat());
    rig.run(50);
    assert!(!rig.on_the_way.is_empty(), "answers have nowhere to go");
    rig.writer = usize::MAX;
    rig.run(600);
    assert!(rig.on_the_way.is_empty());
    let taken = |m: &&ToHost| matches!(m, ToHost::SceneTaken { accepted: true, .. });
    assert_eq!(rig.heard.iter().filter(taken).count(), 501);
}
