//! The steps in their order, from where the log ends.

use super::attendant::Attendant;
use super::board::Board;
use super::finding::Finding;
use super::halt::Halt;
use super::log::{Identity, Log, LogError};
use super::step::Step;
use super::steps;
use crate::link::ControlSession;

/// Progress of a walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walked {
    /// To the end: the log is complete.
    ToTheEnd,
    /// The board was without power meanwhile: greet it again, and continue.
    BoardWasOff,
}

/// Reason for which a walk ended early.
#[derive(Debug, thiserror::Error)]
pub enum BringupError {
    /// A step found something wrong.
    #[error("step {} ({}): {finding}", .step.number(), .step.title())]
    Found {
        /// The step.
        step: Step,
        /// The fault.
        finding: Finding,
    },
    /// The attendant stopped, or the device is gone.
    #[error(transparent)]
    Halt(Halt),
    /// The log cannot be kept.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Walks through the steps that the log does not have yet, and has `keep` keep the log
/// after each.
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
            Ok(told) => {
                attendant.hear(&format!("passed: {told}"));
                log.take(step, true, told.clone());
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

/// Has the board disarm after a step that was not passed; tells the attendant where it
/// does not confirm that.
fn leave(board: &mut Board<'_, '_>, attendant: &mut dyn Attendant) {
    match board.leave() {
        Ok(()) => attendant.may_be_armed(false),
        Err(not_confirmed) => attendant.hear(&not_confirmed.to_string()),
    }
}
