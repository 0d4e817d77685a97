//! Cancels of placements that wait to change under the pressing hand.

use std::vec::Vec;

use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::grid::{Cell, GridPoint};
use hapterra_core::guard::Mode;
use hapterra_core::scene::{ContactMap, Scene, SceneChange, Source};
use hapterra_core::terrain::{CoarseTile, Fallback, TileKey};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::session::SessionNumber;

use super::rig::{HELLO, Rig, frame, framed, scene, tile};

const TO_CANCEL: fn(&Request) -> bool = |r| matches!(r, Request::CancelChange { .. });
/// Counts of the second axis for a tip above the plane and below it.
const ABOVE: i32 = 0;
const BELOW: i32 = -380;

/// Returns a change to another level, under the hand.
fn change(rig: &Rig, number: u8, epoch: u32) -> SceneChange {
    let before = scene(Source::Encoders);
    let at = rig.latest().proxy;
    let wide = CoarseTile {
        first: Cell::new(0, 0),
        shift: 5,
    };
    SceneChange {
        number,
        scene: Scene {
            epoch,
            level: 1,
            fallback: Some(Fallback { wide, near: None }),
            ..before
        },
        hip: at,
        keeps_tiles: false,
        in_contact: Some(ContactMap {
            from: at,
            to: GridPoint::new([at.cell()[0], at.cell()[1], 1], Vec3::new(0.5, 0.5, 0.5)),
            scale: Vec3::ONE,
        }),
    }
}

/// Lowers or raises the tip to these counts of the second axis.
fn reach(rig: &mut Rig, to: i32) {
    while rig.sense.counts[1] != to {
        rig.sense.counts[1] += (to - rig.sense.counts[1]).signum();
        rig.run(1);
    }
    rig.run(20);
}

/// Returns the requested tiles with the epochs of their scenes.
fn requests(rig: &Rig) -> Vec<(u32, TileKey)> {
    let request = |message: &ToHost| match message {
        ToHost::TileRequest { epoch, key } => Some((*epoch, *key)),
        _ => None,
    };
    rig.received.iter().filter_map(request).collect()
}

#[test]
fn cancelled_change_restores_the_scene_and_its_tiles() {
    let mut rig = Rig::armed();
    let change_of = change(&rig, 1, 1_001);
    rig.send_message(&ToDevice::SceneChange(change_of));
    rig.run(20);
    assert_eq!(
        (rig.latest().view, rig.status().device.epoch),
        (0, Some(1_001))
    );
    rig.received.clear();
    // The epoch of the scene before, and an unknown one.
    for epoch in [7, 1_002] {
        rig.request(Request::CancelChange { epoch });
        rig.run(10);
    }
    let unknown = Err(Refusal::NoSuchChange);
    assert_eq!(rig.answers(TO_CANCEL), [unknown; 2]);
    assert_eq!(rig.status().device.epoch, Some(1_001));
    rig.received.clear();
    rig.request(Request::CancelChange { epoch: 1_001 });
    rig.run(10);
    assert_eq!(rig.answers(TO_CANCEL), [Ok(())]);
    let requests = requests(&rig);
    let is_before = |(epoch, key): &(u32, TileKey)| *epoch == 7 && key.level == 0;
    assert!(
        !requests.is_empty() && requests.iter().all(is_before),
        "{requests:?}"
    );
    reach(&mut rig, BELOW);
    let sample = rig.latest();
    assert_eq!((sample.view, sample.mode), (0, Mode::Armed));
    assert_eq!(
        (sample.state, sample.missing_tile),
        (ContactState::Touching, None)
    );
    assert_eq!(rig.status().device.epoch, Some(7));
    // It cannot be cancelled twice, and its number can be used again.
    rig.request(Request::CancelChange { epoch: 1_001 });
    rig.run(2_000);
    assert_eq!(rig.answers(TO_CANCEL), [Ok(()), unknown]);
    let again = change(&rig, 1, 2_001);
    rig.send_message(&ToDevice::SceneChange(again));
    rig.run(40);
    assert_eq!((rig.latest().view, rig.latest().mode), (1, Mode::Armed));
    assert_eq!(rig.status().device.epoch, Some(2_001));
}

/// The loop may make the change before the cancel arrives, or at any time until it does.
#[test]
fn cancel_and_change_agree_on_the_placement() {
    let mut outcomes = [0, 0];
    for delay in 0..8 {
        let mut rig = Rig::armed();
        reach(&mut rig, BELOW);
        let change = change(&rig, 1, 1_001);
        rig.send_message(&ToDevice::SceneChange(change));
        rig.run(delay);
        rig.request(Request::CancelChange { epoch: 1_001 });
        rig.run(300);
        let answers = rig.answers(TO_CANCEL);
        let is_made = rig.latest().view == 1;
        outcomes[usize::from(is_made)] += 1;
        let (answer, epoch) = match is_made {
            true => (Err(Refusal::NoSuchChange), 1_001),
            false => (Ok(()), 7),
        };
        assert_eq!(answers, [answer], "after {delay} ticks");
        assert_eq!(
            rig.status().device.epoch,
            Some(epoch),
            "after {delay} ticks"
        );
        reach(&mut rig, ABOVE);
        reach(&mut rig, BELOW);
        assert_eq!(rig.latest().mode, Mode::Armed);
        assert_eq!(rig.latest().state, ContactState::Touching);
        assert_eq!(usize::from(rig.latest().view), usize::from(is_made));
    }
    assert!(outcomes[0] > 0 && outcomes[1] > 0, "{outcomes:?}");
}

/// The link has not read the records of the last ticks before the change when the cancel arrives.
#[test]
fn change_in_an_unread_record_is_made() {
    let mut rig = Rig::armed();
    reach(&mut rig, BELOW);
    rig.answers_tiles = false;
    let change = change(&rig, 1, 1_001);
    rig.received.clear();
    rig.send_message(&ToDevice::SceneChange(change));
    rig.run(20);
    let (_, key) = *requests(&rig).last().expect("the fallback");
    let tick = |rig: &mut Rig| rig.device.tick_alone(rig.sense);
    let _ = tick(&mut rig);
    let tile = tile(1_001, key);
    assert_eq!(rig.device.link.receive(&tile), tile.len());
    for _ in 0..3 {
        let _ = tick(&mut rig);
    }
    rig.request(Request::CancelChange { epoch: 1_001 });
    rig.run(20);
    let refused = Err(Refusal::NoSuchChange);
    assert_eq!(
        (rig.latest().view, rig.answers(TO_CANCEL)),
        (1, [refused].into())
    );
    assert_eq!(rig.status().device.epoch, Some(1_001));
}

/// A tick runs between the link's readings of records and of reports: the first report of the scene
/// before arrives ahead of the first record.
#[test]
fn early_report_of_a_cancel_keeps_the_arm_armed() {
    let mut rig = Rig::armed();
    for n in 0..200 {
        let change = change(&rig, 1, 2_000 + n);
        rig.send_message(&ToDevice::SceneChange(change));
        rig.run(2);
        rig.request(Request::CancelChange { epoch: 2_000 + n });
        rig.run(1);
        rig.device.link.read_records();
        let _ = rig.device.tick_alone(rig.sense);
        rig.device.link.report_state();
        // Seven ticks each: the report is due at every step in turn.
        rig.run(3);
        assert_eq!(rig.latest().mode, Mode::Armed, "{n}");
    }
    assert_eq!(rig.status().device.epoch, Some(7));
}

/// The loop's report of the scene before arrives at every time of a cancel.
#[test]
fn repeated_cancels_keep_the_arm_armed() {
    let mut rig = Rig::armed();
    for n in 0..200 {
        let change = change(&rig, 1, 2_000 + n);
        rig.send_message(&ToDevice::SceneChange(change));
        rig.run(2 + n % 3);
        rig.request(Request::CancelChange { epoch: 2_000 + n });
        rig.run(4);
        assert_eq!(rig.answers(TO_CANCEL).pop(), Some(Ok(())), "{n}");
        assert_eq!(rig.latest().mode, Mode::Armed, "{n}");
        rig.received
            .retain(|message| matches!(message, ToHost::Telemetry(_)));
        let old = rig.received.len().saturating_sub(2);
        rig.received.drain(..old);
    }
    assert_eq!(rig.status().device.epoch, Some(7));
}

/// The loop would store them in the placement before.
#[test]
fn tiles_of_a_cancelled_change_are_dropped() {
    let mut rig = Rig::armed();
    rig.answers_tiles = false;
    let change = change(&rig, 1, 1_001);
    rig.received.clear();
    rig.send_message(&ToDevice::SceneChange(change));
    rig.run(20);
    let (epoch, key) = *requests(&rig).last().expect("the fallback");
    assert_eq!(epoch, 1_001);
    let number = rig.number + 1;
    let request = Request::CancelChange { epoch: 1_001 };
    let cancel = frame(&ToDevice::Request { number, request });
    let bytes = [cancel, tile(1_001, key)].concat();
    assert_eq!(rig.device.receive(&bytes), bytes.len());
    let link = &rig.device.link;
    assert_eq!(
        (link.ends.commands.len(), link.requester.in_flight()),
        (1, 0)
    );
}

/// The open message of a host that returns is answered with the scene that stays.
#[test]
fn host_that_returns_during_a_cancel_finds_the_scene_that_stays() {
    let mut rig = Rig::armed();
    let change = change(&rig, 1, 1_001);
    rig.send_message(&ToDevice::SceneChange(change));
    rig.run(20);
    rig.request(Request::CancelChange { epoch: 1_001 });
    rig.received.clear();
    let next = SessionNumber::new(rig.session.get() + (1 << 8));
    rig.send(&framed(next, &ToDevice::Hello(HELLO)));
    // The device answers only the session before until the scene is decided.
    rig.run(10);
    assert_eq!(rig.answers(TO_CANCEL), [Ok(())]);
    (rig.session, rig.number) = (next, 0);
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(10);
    let hellos = rig.received.iter().filter_map(|message| match message {
        ToHost::Hello(hello) => Some(hello.epoch),
        _ => None,
    });
    let hellos: Vec<_> = hellos.collect();
    assert!(
        !hellos.is_empty() && hellos.iter().all(|epoch| *epoch == Some(7)),
        "{hellos:?}"
    );
    rig.send_message(&ToDevice::Scene(scene(Source::Encoders)));
    rig.run(200);
    assert_eq!(rig.latest().mode, Mode::Armed);
}
