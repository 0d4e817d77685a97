//! The steps of a calibration in order, for a real or simulated user.

use hapterra_core::phantom::Calibration;

use super::arm::Arm;
use super::fit_error::FitError;
use super::gravity::{StaticPose, fit_gravity};
use super::ratios::{Direction, RulerMove, fit_ratios};
use super::review::Review;

/// Distance of the move along the ruler, mm.
const MOVE_MM: f64 = 80.0;
/// Largest change between two readings of an encoder at rest.
const STILL_COUNTS: u32 = 3;
/// Number of poses for the weight.
const POSES: usize = 4;

/// The user's side of a calibration: moves the arm, and reads ruler and scale.
pub trait Attendant {
    /// Receives a message.
    fn notify(&mut self, line: &str);

    /// Moves the arm into its zero pose and holds it there.
    ///
    /// # Errors
    /// [`Stopped`].
    fn zero_pose(&mut self) -> Result<(), Stopped>;

    /// Moves the tip along a ruler by approximately `about_mm`. Returns the distance by the ruler,
    /// mm; negative in the opposite direction.
    ///
    /// # Errors
    /// [`Stopped`].
    fn move_along(&mut self, direction: Direction, about_mm: f64) -> Result<f64, Stopped>;

    /// Holds the tip still with a scale, in a different pose each time. Returns the holding force,
    /// N, upwards and towards the user; `None` ends the measurement of gravity.
    ///
    /// # Errors
    /// [`Stopped`].
    fn hold_still(&mut self, number: usize) -> Result<Option<[f64; 2]>, Stopped>;

    /// Returns true if the user accepts the record.
    ///
    /// # Errors
    /// [`Stopped`].
    fn confirm_record(&mut self, review: &Review) -> Result<bool, Stopped>;
}

/// The attendant stopped the calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped: nothing was changed on the device")]
pub struct Stopped;

/// Reason why a calibration ends without a record.
#[derive(Debug, thiserror::Error)]
pub enum ProcedureError<E: std::error::Error + 'static> {
    /// The attendant stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The measurements are inconsistent.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The device does not report its counts.
    #[error(transparent)]
    Counts(E),
    /// The attendant did not accept the record.
    #[error("the record was not accepted: nothing was changed on the device")]
    Refused,
}

/// The measured parts of the record; the zero pose is always measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// True if the cable ratios and encoder signs are measured.
    pub ratios: bool,
    /// True if the weights on joints 2 and 3 are measured.
    pub gravity: bool,
}

/// Runs a calibration from a record. `counts` reads the encoders.
///
/// # Errors
/// [`ProcedureError`].
pub fn run_procedure<E: std::error::Error + 'static>(
    before: &Calibration,
    plan: Plan,
    attendant: &mut dyn Attendant,
    counts: &mut dyn FnMut() -> Result<[i32; 3], E>,
) -> Result<Review, ProcedureError<E>> {
    let mut procedure = Procedure {
        attendant,
        counts,
        zero: [0; 3],
    };
    procedure.zero()?;
    let mut review = Review {
        before: *before,
        after: *before,
        zero: procedure.zero,
        ratios: None,
        gravity: None,
    };
    if plan.ratios {
        let fit = fit_ratios(before, &procedure.moves()?)?;
        fit.apply(&mut review.after);
        review.ratios = Some(fit);
    }
    if plan.gravity {
        let poses = procedure.poses(&review.after)?;
        if !poses.is_empty() {
            let fit = fit_gravity(&review.after, &poses)?;
            fit.apply(&mut review.after);
            review.gravity = Some(fit);
        }
    }
    match procedure.attendant.confirm_record(&review)? {
        true => Ok(review),
        false => Err(ProcedureError::Refused),
    }
}

struct Procedure<'a, E> {
    attendant: &'a mut dyn Attendant,
    counts: &'a mut dyn FnMut() -> Result<[i32; 3], E>,
    zero: [i32; 3],
}

impl<E: std::error::Error + 'static> Procedure<'_, E> {
    fn zero(&mut self) -> Result<(), ProcedureError<E>> {
        self.attendant.zero_pose()?;
        self.zero = self.counts_at_rest()?;
        Ok(())
    }

    fn moves(&mut self) -> Result<Vec<RulerMove>, ProcedureError<E>> {
        let mut moves = Vec::new();
        for direction in Direction::ALL {
            if direction != Direction::ALL[0] {
                self.attendant.zero_pose()?;
            }
            let from = self.since_zero()?;
            let mm = self.attendant.move_along(direction, MOVE_MM)?;
            let to = self.since_zero()?;
            moves.push(RulerMove {
                from,
                to,
                direction,
                mm,
            });
        }
        Ok(moves)
    }

    fn poses(&mut self, record: &Calibration) -> Result<Vec<StaticPose>, ProcedureError<E>> {
        let arm = Arm::of(record);
        let rad_per_count = 1.0 / record.counts_per_radian().as_dvec3();
        let mut poses = Vec::new();
        for number in 1..=POSES {
            let Some([up, towards]) = self.attendant.hold_still(number)? else {
                break;
            };
            poses.push(StaticPose {
                q_rad: arm.angles(rad_per_count, self.since_zero()?).to_array(),
                force_n: [towards, 0.0, up],
            });
        }
        Ok(poses)
    }

    fn since_zero(&mut self) -> Result<[i32; 3], ProcedureError<E>> {
        let counts = self.counts_at_rest()?;
        Ok(std::array::from_fn(|i| {
            counts[i].wrapping_sub(self.zero[i])
        }))
    }

    /// Returns the counts once the arm is at rest.
    fn counts_at_rest(&mut self) -> Result<[i32; 3], ProcedureError<E>> {
        let mut reported = false;
        loop {
            let once = (self.counts)().map_err(ProcedureError::Counts)?;
            let again = (self.counts)().map_err(ProcedureError::Counts)?;
            if (0..3).all(|i| once[i].abs_diff(again[i]) <= STILL_COUNTS) {
                return Ok(again);
            }
            if !reported {
                self.attendant.notify("the arm moves: hold it still");
            }
            reported = true;
        }
    }
}
