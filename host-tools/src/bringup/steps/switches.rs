//! Check of the stop and dead-man inputs, in both positions.

use hapterra_core::wire::status::Status;

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, Task};

/// Checks each switch, and that a disconnected stop wire reads as pressed.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let stop = |status: &Status| status.health.sense.emergency_stop;
    let dead_man = |status: &Status| status.health.sense.dead_man;
    for (task, pressed) in [
        (Task::ReleaseStop, false),
        (Task::PressStop, true),
        (Task::ReleaseStop, false),
        (Task::PullStopWire, true),
        (Task::ConnectStopWire, false),
    ] {
        board.wait_for_task(attendant, task, |status| stop(status) == pressed)?;
    }
    for (task, pressed) in [
        (Task::ReleaseDeadMan, false),
        (Task::PressDeadMan, true),
        (Task::ReleaseDeadMan, false),
    ] {
        board.wait_for_task(attendant, task, |status| dead_man(status) == pressed)?;
    }
    Ok(
        "stop seen released, pressed and with a wire off; dead-man switch released and pressed"
            .into(),
    )
}
