//! Check of the amplifiers' ready lines, and of the enable line with a meter.

use hapterra_core::guard::Blockers;
use hapterra_core::wire::status::Status;

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, BoardState, Question, Reading, Task};
use crate::bringup::finding::Finding;

/// Voltage below which every amplifier's enable input reads low, V.
const LOW_V: f64 = 0.8;

/// Checks each ready wire and measures the enable line. The board has no power at the end.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let ready = match attendant.confirm(Question::ReadyIsWired)? {
        true => ready_lines(board, attendant)?,
        false => "no ready line is wired",
    };
    Ok(format!("{ready}; {}", enable_line(attendant)?))
}

/// Checks each ready line with its wire disconnected, because an input that reads ready without a
/// wire is useless.
fn ready_lines(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<&'static str, Halt> {
    let not_ready = |status: &Status| {
        let blockers = status.health.report.blockers;
        blockers.contains(Blockers::AMPLIFIER_NOT_READY)
    };
    if not_ready(&board.poll_status()?) {
        return Err(Finding::NotReady(Blockers::AMPLIFIER_NOT_READY).into());
    }
    for axis in 0..3 {
        board.wait_for_task(attendant, Task::PullReadyWire(axis), not_ready)?;
        let ready = |status: &Status| !not_ready(status);
        board.wait_for_task(attendant, Task::ConnectReadyWire(axis), ready)?;
    }
    Ok("each ready line seen ready and with its wire off")
}

fn enable_line(attendant: &mut dyn Attendant) -> Result<String, Halt> {
    let mut reported = Vec::new();
    for is in [
        BoardState::Running,
        BoardState::InReset,
        BoardState::Unplugged,
    ] {
        let volts = attendant.read(Reading::EnableVolts(is))?;
        if volts.is_nan() || volts.abs() > LOW_V {
            return Err(Finding::EnableHigh(volts).into());
        }
        reported.push(format!("{volts:.2} V"));
    }
    Ok(format!(
        "enable at {} running, in reset, unplugged",
        reported.join(", ")
    ))
}
