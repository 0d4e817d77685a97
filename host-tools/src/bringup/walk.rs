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
pub enum Walked {
    /// The log is complete.
    ToTheEnd,
    /// The board was without power: open a new session, then continue.
    BoardWasOff,
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

/// Runs the steps that are not in the log, and calls `keep` with the log after each.
///
/// # Errors
/// [`BringupError`].
pub fn walk(
    control: &mut ControlSession<'_>,
    attendant: &mut dyn Attendant,
    log: &mut Log,
    keep: &mut dyn FnMut(&Log) -> Result<(), LogError>,
) -> Result<Walked, BringupError> {
    let mut board = Board::new(control, attendant.stops());
    let record = board.calibration().map_err(BringupError::Halt)?;
    if let Some(why) = log.meet(Identity::of(board.device(), record.as_ref())) {
        attendant.hear(&format!("{why}: what was found of it no longer counts"));
    }
    while let Some(step) = log.next() {
        let (number, of, title) = (step.number(), Step::ALL.len(), step.title());
        attendant.hear(&format!("step {number} of {of}: {title}"));
        let result = steps::go(step, &mut board, attendant);
        match &result {
            Ok(reported) => {
                attendant.hear(&format!("passed: {reported}"));
                log.take(step, true, reported.clone());
            }
            Err(Halt::Found(finding)) => log.take(step, false, finding.to_string()),
            Err(_) => {}
        }
        match &result {
            Ok(_) => attendant.may_be_armed(false),
            Err(_) => leave(&mut board, attendant),
        }
        keep(log)?;
        match result {
            Ok(_) if step == Step::EnableLine => return Ok(Walked::BoardWasOff),
            Ok(_) => {}
            Err(Halt::Found(finding)) => return Err(BringupError::Found { step, finding }),
            Err(halt) => return Err(BringupError::Halt(halt)),
        }
    }
    Ok(Walked::ToTheEnd)
}

/// Disarms the board after a failed step; informs the attendant unless the board confirms it.
fn leave(board: &mut Board<'_, '_>, attendant: &mut dyn Attendant) {
    match board.leave() {
        Ok(()) => attendant.may_be_armed(false),
        Err(not_confirmed) => attendant.hear(&not_confirmed.to_string()),
    }
}
