//! The motors carry the arm's weight, with nothing to touch in its reach.

use hapterra_core::guard::Fault;
use hapterra_core::wire::request::Request;

use super::{Board, Halt, plane};
use crate::bringup::attendant::{Attendant, Task};
use crate::bringup::finding::Finding;

/// The plane that a scene has to have lies so far below the tip, mm.
const OUT_OF_REACH_MM: f32 = 1_000.0;
/// For so many looks (a tenth of a second each) the tip is left to itself.
const LOOKS: usize = 30;
/// So far the tip may drift meanwhile, mm.
const DRIFT_MM: f64 = 20.0;

/// Has the tip let go and watches that it stays; then has the switch let go.
pub(super) fn carried(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let record = super::zeroed(board, attendant)?;
    attendant.finish(Task::HoldLoosely)?;
    board.still(attendant)?;
    let status = board.look()?;
    board.put(plane::below_tip(&record, &status, OUT_OF_REACH_MM))?;
    board.arm(attendant)?;
    let from = plane::tip_mm(&record, &board.look()?);
    attendant.begin(Task::LetGoOfTip);
    let mut drift_mm = 0.0_f64;
    for look in 1..=LOOKS {
        let status = board.look()?;
        if let Some(fault) = status.health.report.fault {
            return Err(Finding::Fault(fault).into());
        }
        drift_mm = drift_mm.max(from.distance(plane::tip_mm(&record, &status)));
        if drift_mm > DRIFT_MM {
            board.ask(&Request::Disarm)?;
            attendant.begin(Task::HoldTip);
            return Err(Finding::Drifts {
                mm: drift_mm,
                seconds: 0.1 * look as f64,
            }
            .into());
        }
    }
    attendant.begin(Task::HoldTip);
    board.trips(attendant, Task::ReleaseDeadMan, Fault::DeadManReleased)?;
    board.leave();
    Ok(format!(
        "the tip stayed within {drift_mm:.1} mm for 3 s; letting the switch go gave fault 6"
    ))
}
