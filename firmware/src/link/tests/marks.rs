//! Marks: each request makes one pulse, and its answer contains the tick.

use std::vec::Vec;

use hapterra_core::scene::{MARK_GAP_MS, MARK_PULSE_MS};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::Request;

use super::rig::Rig;

fn marked(rig: &Rig) -> Vec<(u8, u32)> {
    let answer = |message: &ToHost| match message {
        ToHost::Marked { number, tick } => Some((*number, *tick)),
        _ => None,
    };
    rig.received.iter().filter_map(answer).collect()
}

fn latest_tick(rig: &Rig) -> u32 {
    let reported = rig.telemetry();
    let last = reported
        .last()
        .and_then(|telemetry| telemetry.samples.last());
    last.expect("samples").tick
}

#[test]
fn mark_is_answered_with_its_tick_after_its_pulse() {
    let mut rig = Rig::armed();
    rig.run(16);
    let before = latest_tick(&rig);
    let number = rig.requests.last().map_or(0, |(number, _)| number + 1);
    let request = Request::Mark;
    // Repeated, as by a host that receives no answer.
    for _ in 0..4 {
        rig.send_message(&ToDevice::Request { number, request });
        rig.run(1);
    }
    rig.run(MARK_PULSE_MS + MARK_GAP_MS - 8);
    assert_eq!(marked(&rig), [], "the pulse is not over");
    rig.run(8);
    let [(answered, tick)] = marked(&rig)[..] else {
        panic!("{:?}", marked(&rig));
    };
    assert_eq!(answered, number);
    assert!((before..before + 20).contains(&tick), "{before} {tick}");
    // Repeated once more, it is answered again and marks no other tick.
    rig.send_message(&ToDevice::Request { number, request });
    rig.run(40);
    assert_eq!(marked(&rig), [(number, tick); 2]);
}
