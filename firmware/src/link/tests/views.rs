//! Changes of a scene's placement while the clutch is open.

use std::vec::Vec;

use hapterra_core::clutch::ClutchMode;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{Limits, Mode};
use hapterra_core::scene::{Scene, SceneChange, Source};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::Request;

use super::rig::{Rig, scene};

const TO_CLUTCH: fn(&Request) -> bool = |r| matches!(r, Request::Clutch { .. });

fn view(number: u8, hip: GridPoint) -> SceneChange {
    SceneChange {
        number,
        scene: Scene {
            epoch: 1_000 + u32::from(number),
            cell_mm: 2.0,
            ..scene(Source::Encoders)
        },
        hip,
        keeps_tiles: false,
        in_contact: None,
    }
}

/// Returns the outcomes of scene changes, in the order of the answers, from the first.
fn scene_answers(rig: &Rig) -> Vec<(u32, bool)> {
    let answer = |message: &ToHost| match message {
        ToHost::SceneAck { epoch, accepted } => Some((*epoch, *accepted)),
        _ => None,
    };
    rig.received.iter().filter_map(answer).skip(1).collect()
}

fn with_an_open_clutch() -> Rig {
    let mut rig = Rig::armed();
    rig.request(Request::Clutch {
        hold: ClutchMode::WithHand,
    });
    rig.run(150);
    assert_eq!(rig.answers(TO_CLUTCH), [Ok(())]);
    assert!(rig.latest().limits.contains(Limits::CLUTCH_OPEN));
    rig
}

#[test]
fn placement_change_with_open_clutch_keeps_the_arm_armed() {
    let mut rig = with_an_open_clutch();
    let wanted = view(1, rig.latest().hip);
    rig.received
        .retain(|message| !matches!(message, ToHost::TileRequest { .. }));
    rig.send_message(&ToDevice::SceneChange(wanted));
    rig.run(40);
    assert_eq!(scene_answers(&rig), [(1_001, true)]);
    assert!(
        !rig.tile_requests().is_empty(),
        "its own tiles are requested"
    );
    assert_eq!((rig.latest().view, rig.latest().mode), (1, Mode::Armed));
    // Repeated, because the answer was lost.
    rig.send_message(&ToDevice::SceneChange(wanted));
    rig.run(10);
    assert_eq!(scene_answers(&rig), [(1_001, true); 2]);
    rig.request(Request::Clutch {
        hold: ClutchMode::Released,
    });
    rig.run(600);
    let sample = rig.latest();
    assert_eq!((sample.view, sample.mode), (1, Mode::Armed));
    assert_eq!(sample.limits, Limits::empty());
    assert_eq!(rig.status().device.epoch, Some(1_001));
    // Repeated once more, late: it is already active, and nothing is done.
    rig.send_message(&ToDevice::SceneChange(wanted));
    rig.run(10);
    assert_eq!(scene_answers(&rig), [(1_001, true); 3]);
    assert_eq!(rig.latest().mode, Mode::Armed);
    // An earlier one, late.
    rig.send_message(&ToDevice::SceneChange(view(0, sample.hip)));
    rig.send_message(&ToDevice::SceneChange(view(200, sample.hip)));
    rig.run(10);
    assert_eq!(
        scene_answers(&rig).len(),
        3,
        "an earlier change gets no answer"
    );
}

/// Safety: 15.
#[test]
fn placement_during_contact_is_refused() {
    let mut rig = Rig::armed();
    rig.run(20);
    let before = rig.latest();
    rig.send_message(&ToDevice::SceneChange(view(1, before.hip)));
    rig.run(20);
    assert_eq!(scene_answers(&rig), [(1_001, false)]);
    assert_eq!((rig.latest().view, rig.latest().mode), (0, Mode::Armed));
    // The clutch was held and then released: the change is still refused.
    let mut rig = with_an_open_clutch();
    rig.request(Request::Clutch {
        hold: ClutchMode::Released,
    });
    rig.send_message(&ToDevice::SceneChange(view(1, before.hip)));
    rig.run(20);
    assert_eq!(scene_answers(&rig), [(1_001, false)]);
    assert_eq!(rig.latest().mode, Mode::Armed);
    // It is held, and has not opened yet.
    let mut rig = Rig::armed();
    rig.request(Request::Clutch {
        hold: ClutchMode::InPlace,
    });
    rig.run(20);
    rig.send_message(&ToDevice::SceneChange(view(1, before.hip)));
    rig.run(20);
    assert_eq!(scene_answers(&rig), [(1_001, false)]);
    assert_eq!((rig.latest().view, rig.latest().mode), (0, Mode::Armed));
    // It is open, but the loop's last report is from the previous placement.
    let mut rig = with_an_open_clutch();
    rig.send_message(&ToDevice::SceneChange(view(1, before.hip)));
    rig.send_message(&ToDevice::SceneChange(view(2, before.hip)));
    rig.run(20);
    assert_eq!(scene_answers(&rig), [(1_001, true), (1_002, false)]);
    // Nor can a replay be changed like this.
    let mut rig = with_an_open_clutch();
    let mut points = view(1, before.hip);
    points.scene.source = Source::Points;
    rig.send_message(&ToDevice::SceneChange(points));
    rig.run(20);
    assert_eq!(scene_answers(&rig), [(1_001, false)]);
    assert_eq!(rig.latest().mode, Mode::Armed);
}

/// Safety: 15.
#[test]
fn clutch_hold_ends_with_the_session_of_its_host() {
    let closed = |rig: &mut Rig| {
        rig.run(700);
        rig.latest().limits == Limits::empty()
    };
    let mut rig = with_an_open_clutch();
    assert!(!closed(&mut rig), "the host is there");
    rig.open_new_session();
    assert!(closed(&mut rig), "another session");
    let mut rig = with_an_open_clutch();
    rig.send_message(&ToDevice::Detach);
    rig.run(1_000);
    rig.open_new_session();
    assert!(closed(&mut rig), "a host that detached");
    assert_eq!(rig.latest().mode, Mode::Armed);
}
