//! Sessions without faults.

use std::vec::Vec;

use hapterra_core::contact::ContactState;
use hapterra_core::guard::{Fault, Limits};
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::wire::message::{Telemetry, ToDevice, ToHost};

use super::rig::{D, FIRST, HELLO, Rig, frame, point, scene};
use crate::link::tx_queue::{MAX_URGENT, TxQueue};
use hapterra_core::terrain::TileIndex;

#[test]
fn device_answers_hello_with_its_properties() {
    let mut rig = Rig::new();
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(1);
    let [ToHost::Hello(device), ToHost::Guard(_)] = &rig.received[..] else {
        panic!("{:?}", rig.received);
    };
    assert_eq!((device.board.as_str(), device.epoch), ("native", None));
    assert_eq!((usize::from(device.window), device.tick_hz), (D, 1000));
}

#[test]
fn replay_renders_every_point_once_in_order() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    let rendered = rig.descend(40);
    let numbers: Vec<u32> = rendered.iter().map(|(seq, _)| *seq).collect();
    assert_eq!(numbers, Vec::from_iter(0..40));
    // The plane is at 1.5: point 30 is 0.5 below it.
    let (_, sample) = rendered[30];
    assert_eq!(sample.state, ContactState::Touching);
    assert!((sample.force_n.z - 0.25).abs() < 1e-5, "{sample:?}");
}

#[test]
fn points_sent_ahead_equal_points_sent_singly() {
    let singly = Rig::in_scene(scene(Source::Points)).descend(12);
    let mut ahead = Rig::in_scene(scene(Source::Points));
    for seq in 0..12 {
        ahead.send(&point(seq, seq as f32 * 0.9, 4.0 - seq as f32 * 0.1));
    }
    ahead.run(100);
    let forces = |rendered: Vec<(u32, TickRecord)>| -> Vec<_> {
        rendered.iter().map(|(_, s)| (s.proxy, s.force_n)).collect()
    };
    assert_eq!(forces(ahead.rendered()), forces(singly));
}

#[test]
fn invalid_scene_is_refused_and_the_previous_one_stays() {
    let mut rig = Rig::in_scene(scene(Source::Points));
    let bad = Scene {
        epoch: 8,
        cell_mm: f32::NAN,
        ..scene(Source::Points)
    };
    rig.send(&frame(&ToDevice::Scene(bad)));
    rig.run(1);
    let answer = ToHost::SceneAck {
        epoch: 8,
        accepted: false,
    };
    assert_eq!(rig.received.last(), Some(&answer));
    assert_eq!(rig.descend(3).len(), 3);
}

#[test]
fn arm_is_rendered_and_reported_without_a_gap() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(400);
    let telemetry = rig.telemetry();
    let ticks: Vec<u32> = telemetry
        .iter()
        .flat_map(|t| t.samples.iter().map(|s| s.tick))
        .collect();
    assert!(ticks.len() > 380, "{}", ticks.len());
    assert_eq!(ticks, Vec::from_iter(1..=ticks.len() as u32));
    assert!(telemetry.iter().all(|t| t.dropped == 0));
}

#[test]
fn clock_waits_for_a_missing_tile_only_with_hold_clock() {
    for hold_clock in [false, true] {
        let mut rig = Rig::new();
        rig.answers_tiles = false;
        assert!(rig.device.link.may_stop_clock(), "without a scene");
        rig.send_message(&ToDevice::Hello(HELLO));
        rig.send(&frame(&ToDevice::Scene(Scene {
            hold_clock,
            ..scene(Source::Encoders)
        })));
        rig.run(10);
        assert!(!rig.tile_requests().is_empty());
        assert_eq!(rig.device.link.may_stop_clock(), hold_clock);
        let key = rig.tile_requests()[0];
        for key in rig.tile_requests() {
            rig.send(&super::rig::tile(7, key));
        }
        rig.answers_tiles = true;
        rig.run(10);
        assert!(!rig.device.link.may_stop_clock(), "{key:?} was sent");
    }
}

#[test]
fn close_is_confirmed_after_all_samples_are_sent() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.run(21);
    // The writer stops for a while: more than one message is waiting.
    rig.writer = 0;
    rig.run(20);
    rig.send_bye();
    let Some(ToHost::Goodbye(count)) = rig.received.last() else {
        panic!("{:?}", rig.received.last());
    };
    let count = *count;
    let samples: usize = rig.telemetry().iter().map(|t| t.samples.len()).sum();
    assert_eq!(samples, count.sent as usize);
    assert!(
        samples >= 40,
        "the last, short batch was also sent: {samples}"
    );
}

#[test]
fn longest_messages_fit_their_buffers() {
    let sample = TickRecord {
        tick: u32::MAX,
        missing_tile: Some(TileIndex::new(i32::MIN, i32::MIN)),
        fault: Some(Fault::Hardware),
        limits: Limits::all(),
        work: u32::MAX,
        cost: u32::MAX,
        worst_cost: u32::MAX,
        late: u32::MAX,
        hip: far(),
        proxy: far(),
        ..TickRecord::default()
    };
    let mut queue = TxQueue::new();
    let seq = u32::MAX;
    assert!(queue.push(FIRST, &ToHost::PointAnswer { seq, sample }));
    let length = queue.take(&mut [0; 4096]);
    assert!(length <= MAX_URGENT, "{length}");
    let telemetry = ToHost::Telemetry(Telemetry {
        first: u32::MAX,
        dropped: u32::MAX,
        samples: [sample; 8].into_iter().collect(),
    });
    assert!(queue.push_telemetry(FIRST, &telemetry));
}

fn far() -> hapterra_core::grid::GridPoint {
    hapterra_core::grid::GridPoint::new([i32::MIN; 3], hapterra_core::Vec3::ZERO)
}
