//! The steps of a bring-up; similar ones share a file.

mod clocks;
mod encoders;
mod gravity;
mod lines;
mod motors;
mod outputs;
mod plane;
mod ruler;
mod switches;
mod touch;

use hapterra_core::guard::{Blockers, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::CalibrationSource;

use super::attendant::{Attendant, Task};
use super::board::Board;
use super::finding::Finding;
use super::halt::Halt;
use super::step::Step;
use heightfield::printable_text::printable;

/// Runs a step. Returns the result for the log.
///
/// # Errors
/// [`Halt`].
pub(super) fn run_step(
    step: Step,
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    if let Some(how) = step.wiring() {
        attendant.finish(Task::Wire(how))?;
    }
    match step {
        Step::Board => check_response(board, attendant),
        Step::Switches => switches::check(board, attendant),
        Step::EnableLine => lines::check(board, attendant),
        Step::Outputs => outputs::check(board, attendant),
        Step::Encoders => encoders::check(board, attendant),
        Step::Calibration => ruler::check(board, attendant),
        Step::Motor1 => motors::check(board, attendant, 0),
        Step::Motor2 => motors::check(board, attendant, 1),
        Step::Motor3 => motors::check(board, attendant, 2),
        Step::Gravity => gravity::check(board, attendant),
        Step::FirstTouch => touch::check(board, attendant),
    }
}

/// Checks that the board responds, is disarmed and has no blocker, and that its clocks are right.
fn check_response(board: &mut Board<'_, '_>, attendant: &dyn Attendant) -> Result<String, Halt> {
    let status = board.poll_status()?;
    let report = status.health.report;
    if let Some(fault) = report.fault {
        return Err(Finding::Fault(fault).into());
    }
    let own = Blockers::HARDWARE | Blockers::WATCHDOG_NOT_LIVE;
    let wrong = report.blockers & own;
    if !wrong.is_empty() || report.mode != Mode::Disarmed {
        return Err(Finding::NotReady(wrong).into());
    }
    let hz = clocks::check_tick_rate(board, attendant)?;
    let device = &status.device;
    Ok(format!(
        "{} with firmware {}, {} ticks a second ({hz:.0} counted), disarmed",
        printable(&device.board),
        printable(&device.version),
        device.tick_hz
    ))
}

/// Returns the record stored in the board's memory.
fn stored_record(board: &mut Board<'_, '_>) -> Result<Calibration, Halt> {
    let source = board.poll_status()?.calibration;
    match board.calibration()? {
        Some(record) if source == CalibrationSource::Stored => Ok(record),
        _ => Err(Finding::NoCalibration.into()),
    }
}

/// Returns the record of the zeroed arm; zeroes it with the attendant if necessary.
fn zeroed_record(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<Calibration, Halt> {
    let record = stored_record(board)?;
    if board.poll_status()?.health.zero.is_none() {
        zero(board, attendant)?;
    }
    Ok(record)
}

/// Zeroes the arm in the zero pose, with the attendant's help. Returns the counts there.
fn zero(board: &mut Board<'_, '_>, attendant: &mut dyn Attendant) -> Result<[i32; 3], Halt> {
    attendant.finish(Task::ZeroPose)?;
    let counts = board.wait_for_rest(attendant)?;
    board.request(&Request::Zero { counts })?;
    Ok(counts)
}

/// Zeroes the arm, which the attendant holds loosely and still, activates a plane that many
/// millimetres below the tip, and arms. Returns the record.
fn armed_over_plane(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
    below_mm: f32,
) -> Result<Calibration, Halt> {
    let record = zeroed_record(board, attendant)?;
    attendant.finish(Task::HoldLoosely)?;
    board.wait_for_rest(attendant)?;
    let status = board.poll_status()?;
    board.put_scene(plane::below_tip(&record, &status, below_mm))?;
    board.arm(attendant)?;
    Ok(record)
}
