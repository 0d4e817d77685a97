//! Commands to the loop where their queue is nearly full.

use hapterra_core::guard::Jog;
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::request::Request;

use super::rig::{HELLO, Rig};

#[test]
fn jog_is_answered_while_fourteen_commands_wait() {
    let jog = Jog {
        axis: 0,
        current_a: 0.1,
        hold_ms: 10,
    };
    let mut rig = Rig::new();
    rig.say(&ToDevice::Hello(HELLO));
    rig.run(1);
    // All of it arrives before the loop takes a command.
    for _ in 0..14 {
        rig.ask(Request::Disarm);
    }
    rig.ask(Request::Jog(jog));
    rig.run(2_000);
    let answers = rig.answers(|request| matches!(request, Request::Jog(_)));
    assert_eq!(answers.len(), 1, "{answers:?}");
}
