//! The sequence of steps, from the log's end.

use super::attendant::Attendant;
use super::board::Board;
use super::finding::Finding;
use super::halt::Halt;
use super::log::{Identity, Log, LogError};
use super::step::Step;
use super::steps;
use crate::link::ControlSession;

/// Progress of the sequence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SequenceEnd {
    /// The log is complete.
    Complete,
    /// The board was without power: open a new session, then continue.
    BoardPoweredOff,
}

/// Reason why the sequence ended early.
#[derive(Debug, thiserror::Error)]
pub enum BringupError {
    /// A step failed.
    #[error("step {} ({}): {finding}", .step.number(), .step.title())]
    Found {
        /// The step.
        step: Step,
        /// The finding.
        finding: Finding,
    },
    /// The attendant stopped, or the device was disconnected.
    #[error(transparent)]
    Halt(Halt),
    /// The log cannot be stored.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Runs the steps that are not in the log, and calls `save` with the log after each.
///
/// # Errors
/// [`BringupError`].
pub fn run_sequence(
    control: &mut ControlSession<'_>,
    attendant: &mut dyn Attendant,
    log: &mut Log,
    save: &mut dyn FnMut(&Log) -> Result<(), LogError>,
) -> Result<SequenceEnd, BringupError> {
    let mut board = Board::new(control, attendant.stop_check());
    let record = board.calibration().map_err(BringupError::Halt)?;
    if let Some(why) = log.update_identity(Identity::of(board.device(), record.as_ref())) {
        attendant.notify(&format!("{why}: its earlier results are discarded"));
    }
    while let Some(step) = log.next() {
        let (number, of, title) = (step.number(), Step::ALL.len(), step.title());
        attendant.notify(&format!("step {number} of {of}: {title}"));
        let result = steps::run_step(step, &mut board, attendant);
        match &result {
            Ok(reported) => {
                attendant.notify(&format!("passed: {reported}"));
                log.add(step, true, reported.clone());
            }
            Err(Halt::Found(finding)) => log.add(step, false, finding.to_string()),
            Err(_) => {}
        }
        match &result {
            Ok(_) => attendant.may_be_armed(false),
            Err(_) => disarm_or_report(&mut board, attendant),
        }
        save(log)?;
        match result {
            Ok(_) if step == Step::EnableLine => return Ok(SequenceEnd::BoardPoweredOff),
            Ok(_) => {}
            Err(Halt::Found(finding)) => return Err(BringupError::Found { step, finding }),
            Err(halt) => return Err(BringupError::Halt(halt)),
        }
    }
    Ok(SequenceEnd::Complete)
}

/// Disarms the board after a failed step; informs the attendant unless the board confirms it.
fn disarm_or_report(board: &mut Board<'_, '_>, attendant: &mut dyn Attendant) {
    match board.disarm_and_clear() {
        Ok(()) => attendant.may_be_armed(false),
        Err(not_confirmed) => attendant.notify(&not_confirmed.to_string()),
    }
}
