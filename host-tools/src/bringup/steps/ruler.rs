//! Check of the record with a ruler: zero pose, ratios and signs.

use hapterra_core::phantom::Calibration;

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, Reading, Task};
use crate::bringup::finding::Finding;
use crate::calibrate::{Direction, RatioFit, RulerMove, fit_ratios};

/// Distance of the move, mm.
const MOVE_MM: u16 = 80;
/// Largest relative difference of a ratio from the ruler's: a reading to 1 mm has an error of 2 %.
const RATIO_SHARE: f64 = 0.05;

/// Zeroes the arm and compares the record with a ruler.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let record = super::stored_record(board)?;
    let zero = super::zero(board, attendant)?;
    let since_zero = |counts: [i32; 3]| std::array::from_fn(|i| counts[i].wrapping_sub(zero[i]));
    let mut moves = Vec::new();
    for direction in Direction::ALL {
        let from = since_zero(board.wait_for_rest(attendant)?);
        attendant.finish(Task::MoveAlong(direction, MOVE_MM))?;
        let to = since_zero(board.wait_for_rest(attendant)?);
        let mm = attendant.read(Reading::MovedMm(direction, MOVE_MM))?;
        moves.push(RulerMove {
            from,
            to,
            direction,
            mm,
        });
        attendant.finish(Task::ZeroPose)?;
    }
    board.wait_for_rest(attendant)?;
    let fit = fit_ratios(&record, &moves).map_err(Finding::Ruler)?;
    compare_with_record(&record, &fit)?;
    let found = fit.ratio;
    Ok(format!(
        "ratios {:.2} {:.2} {:.2} by the ruler, {:.2} {:.2} {:.2} in the record",
        found.x, found.y, found.z, record.ratio.x, record.ratio.y, record.ratio.z
    ))
}

/// Compares the record with the fit.
fn compare_with_record(record: &Calibration, fit: &RatioFit) -> Result<(), Finding> {
    for joint in 0..3 {
        let sign = record.encoder_sign[joint];
        if f64::from(sign) != fit.sign[joint] {
            return Err(Finding::InvertedEncoder {
                joint: joint + 1,
                record: sign as i8,
            });
        }
        let (record, found) = (f64::from(record.ratio[joint]), fit.ratio[joint]);
        if (found / record - 1.0).abs() > RATIO_SHARE {
            return Err(Finding::WrongRatio {
                joint: joint + 1,
                record,
                found,
            });
        }
    }
    Ok(())
}
