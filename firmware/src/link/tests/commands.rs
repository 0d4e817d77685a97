//! Commands to the loop where their queue is nearly full.

use hapterra_core::guard::Jog;
use hapterra_core::scene::Health;
use hapterra_core::tick::Command;
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::request::Request;

use super::buffers::link;
use super::rig::{HELLO, Rig};
use crate::queues::LoopReport;

#[test]
fn jog_is_answered_while_fourteen_commands_wait() {
    let jog = Jog {
        axis: 0,
        current_a: 0.1,
        hold_ms: 10,
    };
    let mut rig = Rig::new();
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(1);
    // All of it arrives before the loop accepts a command.
    for _ in 0..14 {
        rig.request(Request::Disarm);
    }
    rig.request(Request::Jog(jog));
    rig.run(2_000);
    let answers = rig.answers(|request| matches!(request, Request::Jog(_)));
    assert_eq!(answers.len(), 1, "{answers:?}");
}

#[test]
fn scene_that_the_loop_refuses_is_dropped_by_the_link() {
    let (mut link, mut loop_ends) = link();
    let mut report = |link: &mut crate::link::Link<'static, _>, epoch| {
        let accepted = core::iter::from_fn(|| loop_ends.commands.dequeue());
        let dropped = accepted
            .filter(|command| matches!(command, Command::DropScene))
            .count();
        link.poll();
        let health = Health::default();
        assert!(
            loop_ends
                .health
                .enqueue(LoopReport {
                    health,
                    epoch,
                    marked: Default::default(),
                })
                .is_ok()
        );
        link.poll();
        dropped
    };
    assert_eq!(report(&mut link, Some(7)), 0);
    assert!(link.scene.is_some(), "the scene is in force");
    report(&mut link, None);
    assert!(link.scene.is_none(), "it is not");
    assert_eq!(report(&mut link, None), 1, "nor is another one");
}
