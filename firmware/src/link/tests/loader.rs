//! The entry into the loader in the chip's ROM.

use hapterra_core::Vec3;
use hapterra_core::guard::Mode;
use hapterra_core::scene::Source;
use hapterra_core::wire::request::{Refusal, Request};

use super::rig::{Rig, scene};

const TO_ENTER: fn(&Request) -> bool = |r| matches!(r, Request::EnterLoader);
const TO_ARM: fn(&Request) -> bool = |r| matches!(r, Request::Arm);

/// Returns true if the board is to enter its loader.
fn enters(rig: &Rig) -> bool {
    rig.device.link.enters_loader()
}

#[test]
fn enter_loader_is_refused_without_a_loader() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.ask(Request::EnterLoader);
    rig.run(5);
    assert_eq!(rig.answers(TO_ENTER), [Err(Refusal::NoLoader)]);
    assert!(!enters(&rig));
}

#[test]
fn an_armed_device_does_not_enter_its_loader() {
    let mut rig = Rig::armed();
    rig.device.link.offer_loader();
    rig.ask(Request::EnterLoader);
    rig.run(100);
    assert_eq!(rig.answers(TO_ENTER), [Err(Refusal::NotWhileArmed)]);
    assert!(!enters(&rig) && rig.device.tick(rig.sense).enabled);
    // Nor while there is force.
    rig.ask(Request::Disarm);
    rig.run(1);
    rig.ask(Request::EnterLoader);
    rig.run(3);
    assert_eq!(rig.answers(TO_ENTER)[1..], [Err(Refusal::NotWhileArmed)]);
    rig.run(300);
    assert_eq!(rig.report().map(|r| r.mode), Some(Mode::Disarmed));
    rig.ask(Request::EnterLoader);
    rig.run(5);
    assert_eq!(rig.answers(TO_ENTER)[2..], [Ok(())]);
    assert!(enters(&rig));
}

#[test]
fn nor_one_that_waits_for_the_dead_man_switch() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.ask(Request::Zero { counts: [0; 3] });
    rig.ask(Request::Arm);
    rig.ask(Request::EnterLoader);
    rig.run(30);
    assert_eq!(rig.answers(TO_ENTER), [Err(Refusal::NotWhileArmed)]);
    assert!(!enters(&rig));
}

#[test]
fn arming_is_refused_once_loader_entry_is_accepted() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.ask(Request::Zero { counts: [0; 3] });
    rig.ask(Request::EnterLoader);
    rig.run(5);
    assert_eq!(rig.answers(TO_ENTER), [Ok(())]);
    rig.ask(Request::Arm);
    rig.run(10);
    rig.sense.dead_man = true;
    rig.run(500);
    assert_eq!(rig.answers(TO_ARM), [Err(Refusal::Busy)]);
    assert!(enters(&rig) && !rig.device.tick(rig.sense).enabled);
}

#[test]
fn loader_is_entered_only_after_the_answer_is_sent() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.writer = 0;
    rig.ask(Request::EnterLoader);
    rig.run(50);
    assert!(rig.answers(TO_ENTER).is_empty() && !enters(&rig));
    rig.writer = usize::MAX;
    rig.run(1);
    assert_eq!(rig.answers(TO_ENTER), [Ok(())]);
    assert!(enters(&rig));
}

#[test]
fn held_outputs_are_released_before_loader_entry() {
    let mut rig = Rig::in_scene(scene(Source::Encoders));
    rig.device.link.offer_loader();
    rig.ask(Request::HoldOutputs(Some([1.0; 3])));
    rig.run(5);
    assert_ne!(rig.device.tick(rig.sense).held, Vec3::ZERO, "held");
    rig.ask(Request::EnterLoader);
    rig.run(5);
    assert!(enters(&rig));
    assert_eq!(rig.device.tick(rig.sense).held, Vec3::ZERO);
}
