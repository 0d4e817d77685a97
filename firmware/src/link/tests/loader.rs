//! The entry into the loader in the chip's ROM.

use hapterra_core::Vec3;
use hapterra_core::guard::Mode;
use hapterra_core::scene::Source;
use hapterra_core::wire::request::{Refusal, Request};

use super::rig::{Rig, scene};

const TO_ENTER: fn(&Request) -> bool = |r| matches!(r, Request::EnterLoader);
const TO_ARM: fn(&Request) -> bool = |r| matches!(r, Request::Arm);

/// Returns true if the board is to enter its loader.
fn is_loader_due(rig: &Rig) -> bool {
    rig.device.link.is_loader_due()
}

#[test]
fn enter_loader_is_refused_without_a_loader() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.request(Request::EnterLoader);
    rig.run(5);
    assert_eq!(rig.answers(TO_ENTER), [Err(Refusal::NoLoader)]);
    assert!(!is_loader_due(&rig));
}

/// Safety: 36.
#[test]
fn armed_device_does_not_enter_its_loader() {
    let mut rig = Rig::armed();
    rig.device.link.offer_loader();
    rig.request(Request::EnterLoader);
    rig.run(100);
    assert_eq!(rig.answers(TO_ENTER), [Err(Refusal::NotWhileArmed)]);
    assert!(!is_loader_due(&rig) && rig.device.tick(rig.sense).enabled);
    // Nor while there is force.
    rig.request(Request::Disarm);
    rig.run(1);
    rig.request(Request::EnterLoader);
    rig.run(3);
    assert_eq!(rig.answers(TO_ENTER)[1..], [Err(Refusal::NotWhileArmed)]);
    rig.run(300);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
    rig.request(Request::EnterLoader);
    rig.run(5);
    assert_eq!(rig.answers(TO_ENTER)[2..], [Ok(())]);
    assert!(is_loader_due(&rig));
}

#[test]
fn device_awaiting_a_press_does_not_enter_its_loader() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::Arm);
    rig.request(Request::EnterLoader);
    rig.run(30);
    assert_eq!(rig.answers(TO_ENTER), [Err(Refusal::NotWhileArmed)]);
    assert!(!is_loader_due(&rig));
}

/// Safety: 36.
#[test]
fn arming_is_refused_once_loader_entry_is_accepted() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.request(Request::Zero { counts: [0; 3] });
    rig.request(Request::EnterLoader);
    rig.run(5);
    assert_eq!(rig.answers(TO_ENTER), [Ok(())]);
    rig.request(Request::Arm);
    rig.run(10);
    rig.sense.dead_man = true;
    rig.run(500);
    assert_eq!(rig.answers(TO_ARM), [Err(Refusal::Busy)]);
    assert!(is_loader_due(&rig) && !rig.device.tick(rig.sense).enabled);
}

#[test]
fn loader_is_entered_only_after_the_answer_is_sent() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.writer = 0;
    rig.request(Request::EnterLoader);
    rig.run(50);
    assert!(rig.answers(TO_ENTER).is_empty() && !is_loader_due(&rig));
    rig.writer = usize::MAX;
    rig.run(1);
    assert_eq!(rig.answers(TO_ENTER), [Ok(())]);
    assert!(is_loader_due(&rig));
}

/// Safety: images.
#[test]
fn held_outputs_are_released_before_loader_entry() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.request(Request::HoldOutputs(Some([1.0; 3])));
    rig.run(5);
    assert_ne!(rig.device.tick(rig.sense).held, Vec3::ZERO, "held");
    rig.request(Request::EnterLoader);
    rig.run(5);
    assert!(is_loader_due(&rig));
    assert_eq!(rig.device.tick(rig.sense).held, Vec3::ZERO);
}
