//! Cable ratios and encoder signs from moves along a ruler.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};
use hapterra_core::phantom::Calibration;

use super::arm::Arm;
use super::fit_error::FitError;

/// A move of the tip along a ruler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RulerMove {
    /// Counts from the zero pose to the move's start.
    pub from: [i32; 3],
    /// Counts from the zero pose to the move's end.
    pub to: [i32; 3],
    /// Direction of the move.
    pub direction: Direction,
    /// Length of the move by the ruler, mm; negative in the opposite direction.
    pub mm: f64,
}

/// Direction of a move along a ruler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the user's right: joint 1.
    Right,
    /// Up: joint 2.
    Up,
    /// Towards the user: joint 3.
    TowardsUser,
}

impl Direction {
    /// All directions.
    pub const ALL: [Self; 3] = [Self::Right, Self::Up, Self::TowardsUser];

    /// Returns the unit vector, device frame.
    #[must_use]
    pub const fn unit(self) -> DVec3 {
        match self {
            Self::TowardsUser => DVec3::X,
            Self::Right => DVec3::Y,
            Self::Up => DVec3::Z,
        }
    }

    /// Returns the direction in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Right => "to your right",
            Self::Up => "straight up",
            Self::TowardsUser => "towards you",
        }
    }
}

/// The ratios and signs that fit the checks best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatioFit {
    /// Motor turns per joint turn.
    pub ratio: DVec3,
    /// +1 if counts increase with the joint's angle, −1 if they decrease.
    pub sign: DVec3,
    /// Root mean square of the residuals, mm.
    pub residual_mm: f64,
}

impl RatioFit {
    /// Sets ratios and signs in a record. A change of an encoder's sign leaves the motor's sign
    /// unchanged, because that depends on the motor's wiring.
    pub fn apply(&self, record: &mut Calibration) {
        record.ratio = self.ratio.as_vec3();
        record.encoder_sign = self.sign.as_vec3();
    }
}

/// Counts that each joint must move in one of the checks.
const MIN_COUNTS: u32 = 400;
/// Largest residual of a fit, mm; a ruler is read to 1 mm.
const MAX_RESIDUAL_MM: f64 = 4.0;
/// Weight of a move's component across its direction, because a hand leads it.
const CROSS_WEIGHT: f64 = 0.25;
/// Maximum Gauss-Newton steps; usually three or four are enough.
const MAX_STEPS: usize = 20;

/// Fits the ratios to the checks by least squares. Starts at a record's ratios and tries all signs.
///
/// Recovers ratios within 0.1 % from exact readings, within 1 % from readings 0.5 mm off over 80 mm
/// (`tests/tests/sessions/calibrate.rs`).
///
/// # Errors
/// [`FitError::NotMoved`], [`FitError::NoRatios`].
pub fn fit_ratios(record: &Calibration, moves: &[RulerMove]) -> Result<RatioFit, FitError> {
    for joint in 0..3 {
        let moved = |ruler_move: &RulerMove| ruler_move.from[joint].abs_diff(ruler_move.to[joint]);
        let counts = moves.iter().map(moved).max().unwrap_or(0);
        if counts < MIN_COUNTS {
            return Err(FitError::NotMoved {
                joint: joint + 1,
                counts,
            });
        }
    }
    let arm = Arm::of(record);
    let per_turn = f64::from(record.counts_per_turn);
    let begin = TAU / (per_turn * record.ratio.as_dvec3());
    let candidates = (0..8).map(|signs| {
        let sign = |joint: u32| if signs >> joint & 1 == 0 { 1.0 } else { -1.0 };
        descend(&arm, moves, begin * DVec3::new(sign(0), sign(1), sign(2)))
    });
    let best = candidates.reduce(|best, next| if next.1 < best.1 { next } else { best });
    let (rad_per_count, square) = best.unwrap_or((begin, f64::INFINITY));
    let residual_mm = libm::sqrt(square / moves.len() as f64);
    if residual_mm.is_nan() || residual_mm > MAX_RESIDUAL_MM {
        return Err(FitError::NoRatios { residual_mm });
    }
    Ok(RatioFit {
        ratio: TAU / (per_turn * rad_per_count.abs()),
        sign: rad_per_count.signum(),
        residual_mm,
    })
}

/// Runs Gauss-Newton from a starting point; returns the result and its sum of squares.
fn descend(arm: &Arm, moves: &[RulerMove], start: DVec3) -> (DVec3, f64) {
    let mut at = start;
    for _ in 0..MAX_STEPS {
        let (mut normal, mut gradient) = (DMat3::ZERO, DVec3::ZERO);
        for ruler_move in moves {
            let here = residual(arm, ruler_move, at);
            let slope = |joint: DVec3| {
                let h = 1e-6 * start.dot(joint);
                (residual(arm, ruler_move, at + h * joint) - here) / h
            };
            let slopes =
                DMat3::from_cols_array_2d(&DVec3::AXES.map(|joint| slope(joint).to_array()));
            gradient += slopes.transpose() * here;
            normal += slopes.transpose() * slopes;
        }
        let step = normal.inverse() * gradient;
        if !step.is_finite() {
            break;
        }
        // A step changes no value by more than half, so that none reaches zero.
        let largest_change = (step / at).abs().max_element();
        at -= step * f64::min(1.0, 0.5 / largest_change.max(1e-300));
        if largest_change < 1e-12 {
            break;
        }
    }
    let squares = moves
        .iter()
        .map(|ruler_move| residual(arm, ruler_move, at).length_squared());
    (at, squares.sum())
}

/// Returns the difference of the move by the encoders and by the ruler, mm. Components across the
/// ruler have less weight.
fn residual(arm: &Arm, ruler_move: &RulerMove, rad_per_count: DVec3) -> DVec3 {
    let tip = |counts| arm.tip_mm(arm.angles(rad_per_count, counts));
    let (moved, unit) = (
        tip(ruler_move.to) - tip(ruler_move.from),
        ruler_move.direction.unit(),
    );
    let along = moved.dot(unit);
    CROSS_WEIGHT * (moved - along * unit) + (along - ruler_move.mm) * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the counts from the zero pose to a tip position, for an arm with ratios other than
    /// the preset's.
    fn counts(arm: &Arm, rad_per_count: DVec3, target_mm: DVec3) -> [i32; 3] {
        let mut q = arm.zero_rad;
        for _ in 0..100 {
            let at = arm.tip_mm(q);
            let slope = |along: DVec3| (arm.tip_mm(q + 1e-7 * along) - at) / 1e-7;
            let slopes = DMat3::from_cols(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
            q += slopes.inverse() * (target_mm - at);
        }
        let turned = ((q - arm.zero_rad) / rad_per_count).round();
        turned.to_array().map(|counts| counts as i32)
    }

    fn moves(factor: [f64; 3], error_mm: f64) -> Vec<RulerMove> {
        let record = Calibration::PREMIUM_1_5;
        let arm = Arm::of(&record);
        let k = TAU / (4096.0 * record.ratio.as_dvec3() * DVec3::from(factor));
        let home = arm.tip_mm(arm.zero_rad);
        let ruler_move = |direction: Direction| RulerMove {
            from: [0; 3],
            to: counts(&arm, k, home + 80.0 * direction.unit()),
            direction,
            mm: 80.0 + error_mm,
        };
        Direction::ALL.map(ruler_move).to_vec()
    }

    #[test]
    fn fit_recovers_ratios_and_signs() {
        let preset = Calibration::PREMIUM_1_5.ratio.to_array().map(f64::from);
        for factor in [[1.0, 1.0, 1.0], [1.07, -0.94, 1.02], [-0.9, -1.1, -1.0]] {
            let found = fit_ratios(&Calibration::PREMIUM_1_5, &moves(factor, 0.0));
            let found = found.expect("a fit");
            for joint in 0..3 {
                let truth = preset[joint] * factor[joint].abs();
                let error = (found.ratio[joint] / truth - 1.0).abs();
                assert!(error < 1e-3, "joint {}: {error}", joint + 1);
                assert_eq!(found.sign[joint], factor[joint].signum());
            }
            assert!(found.residual_mm < 0.1, "{}", found.residual_mm);
        }
    }

    #[test]
    fn unmoved_joint_is_named() {
        let mut moves = moves([1.0; 3], 0.0);
        moves
            .iter_mut()
            .for_each(|ruler_move| ruler_move.to[1] = ruler_move.from[1] + 10);
        let error = fit_ratios(&Calibration::PREMIUM_1_5, &moves).expect_err("too little");
        assert_eq!(
            error,
            FitError::NotMoved {
                joint: 2,
                counts: 10
            }
        );
    }

    #[test]
    fn inconsistent_moves_give_no_fit() {
        let mut moves = moves([1.0; 3], 0.0);
        moves[0].to = [400, -4_000, 5_000];
        moves[1].mm = -300.0;
        let error = fit_ratios(&Calibration::PREMIUM_1_5, &moves).expect_err("nonsense");
        assert!(matches!(error, FitError::NoRatios { .. }), "{error}");
    }
}
