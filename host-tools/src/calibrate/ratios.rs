//! Cable ratios and encoder signs from moves along a ruler.

use std::f64::consts::TAU;

use hapterra_core::Vec3;
use hapterra_core::phantom::Calibration;

use super::{Arm, FitError};

/// A move of the tip along a ruler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Check {
    /// Counts since the zero pose where the move began.
    pub from: [i32; 3],
    /// Counts since the zero pose where it ended.
    pub to: [i32; 3],
    /// Along what.
    pub direction: Direction,
    /// How far, by the ruler, mm.
    pub mm: f64,
}

/// Along what the tip was moved.
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
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Right, Self::Up, Self::TowardsUser];

    /// The unit vector, device frame.
    #[must_use]
    pub const fn unit(self) -> [f64; 3] {
        match self {
            Self::TowardsUser => [1.0, 0.0, 0.0],
            Self::Right => [0.0, 1.0, 0.0],
            Self::Up => [0.0, 0.0, 1.0],
        }
    }

    /// In words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Right => "to your right",
            Self::Up => "straight up",
            Self::TowardsUser => "towards you",
        }
    }
}

/// What the checks tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatioFit {
    /// Motor turns a joint turn.
    pub ratio: [f64; 3],
    /// +1 where counts rise with the joint's angle, −1 where they fall.
    pub sign: [f64; 3],
    /// Root mean square of what is left over, mm.
    pub off_mm: f64,
}

impl RatioFit {
    /// Puts ratios and signs into a record. A motor turns with its encoder, so
    /// where an encoder's sign turns over, the motor's does not follow: that is
    /// its wiring's.
    pub fn apply(&self, record: &mut Calibration) {
        record.ratio = Vec3::from_array(self.ratio.map(|ratio| ratio as f32));
        record.encoder_sign = Vec3::from_array(self.sign.map(|sign| sign as f32));
    }
}

/// A joint has to move by this much in one of the checks.
const ENOUGH_COUNTS: u32 = 400;
/// More than this left over is no fit, mm: a ruler is read to one.
const ENOUGH_MM: f64 = 4.0;
/// How much a move across its direction counts: it is led by hand.
const ACROSS: f64 = 0.25;
/// Gauss-Newton steps; it takes three or four.
const STEPS: usize = 20;

/// Finds the ratios that explain the checks best, in the sense of least squares,
/// beginning at those of a record and trying all signs.
///
/// Recovers ratios within 0.1 % from exact readings, within 1 % from readings
/// 0.5 mm off over 80 mm (`tests/tests/calibrate.rs`).
///
/// # Errors
/// [`FitError::NotMoved`], [`FitError::NoRatios`].
pub fn fit_ratios(record: &Calibration, checks: &[Check]) -> Result<RatioFit, FitError> {
    for joint in 0..3 {
        let moved = |check: &Check| check.from[joint].abs_diff(check.to[joint]);
        let counts = checks.iter().map(moved).max().unwrap_or(0);
        if counts < ENOUGH_COUNTS {
            return Err(FitError::NotMoved {
                joint: joint + 1,
                counts,
            });
        }
    }
    let arm = Arm::of(record);
    let per_turn = f64::from(record.counts_per_turn);
    let begin = record
        .ratio
        .to_array()
        .map(|r| TAU / (per_turn * f64::from(r)));
    let tries = (0..8).map(|signs| {
        let signed = std::array::from_fn(|i| match signs >> i & 1 {
            0 => begin[i],
            _ => -begin[i],
        });
        descend(&arm, checks, signed)
    });
    let best = tries.reduce(|best, next| if next.1 < best.1 { next } else { best });
    let (rad_per_count, square) = best.unwrap_or((begin, f64::INFINITY));
    let off_mm = libm::sqrt(square / checks.len() as f64);
    if off_mm.is_nan() || off_mm > ENOUGH_MM {
        return Err(FitError::NoRatios { off_mm });
    }
    Ok(RatioFit {
        ratio: rad_per_count.map(|k| TAU / (per_turn * k.abs())),
        sign: rad_per_count.map(f64::signum),
        off_mm,
    })
}

/// Gauss-Newton from a starting point; where it ends, and the squares left.
fn descend(arm: &Arm, checks: &[Check], start: [f64; 3]) -> ([f64; 3], f64) {
    let mut at = start;
    for _ in 0..STEPS {
        let (mut normal, mut gradient) = ([[0.0; 3]; 3], [0.0; 3]);
        for check in checks {
            let here = left_over(arm, check, at);
            let slopes: [[f64; 3]; 3] = std::array::from_fn(|i| {
                let h = 1e-6 * start[i];
                let mut beside = at;
                beside[i] += h;
                let there = left_over(arm, check, beside);
                std::array::from_fn(|row| (there[row] - here[row]) / h)
            });
            for i in 0..3 {
                gradient[i] += dot(slopes[i], here);
                for j in 0..3 {
                    normal[i][j] += dot(slopes[i], slopes[j]);
                }
            }
        }
        let Some(step) = solve(normal, gradient) else {
            break;
        };
        // Never more than half of what a count is worth, and never through zero.
        let longest = (0..3).map(|i| (step[i] / at[i]).abs()).fold(0.0, f64::max);
        let share = f64::min(1.0, 0.5 / longest.max(1e-300));
        (0..3).for_each(|i| at[i] -= share * step[i]);
        if longest < 1e-12 {
            break;
        }
    }
    let squares = checks.iter().map(|check| {
        let left = left_over(arm, check, at);
        dot(left, left)
    });
    (at, squares.sum())
}

/// What the move by the encoders and the move by the ruler differ in, mm; what
/// lies across the ruler counts less.
fn left_over(arm: &Arm, check: &Check, rad_per_count: [f64; 3]) -> [f64; 3] {
    let tip = |counts| arm.tip_mm(arm.angles(rad_per_count, counts));
    let (from, to) = (tip(check.from), tip(check.to));
    let unit = check.direction.unit();
    let moved: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
    let along = dot(moved, unit);
    std::array::from_fn(|i| {
        let across = moved[i] - along * unit[i];
        ACROSS * across + (along - check.mm) * unit[i]
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Solves a symmetric system by Cramer's rule; none where it is singular.
fn solve(m: [[f64; 3]; 3], v: [f64; 3]) -> Option<[f64; 3]> {
    let determinant = |m: [[f64; 3]; 3]| {
        let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
        m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
    };
    let whole = determinant(m);
    let solution = std::array::from_fn(|column| {
        let mut replaced = m;
        (0..3).for_each(|row| replaced[row][column] = v[row]);
        determinant(replaced) / whole
    });
    solution
        .iter()
        .all(|x: &f64| x.is_finite())
        .then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts since the zero pose at a tip position, for an arm with other ratios
    /// than the preset's.
    fn counts(arm: &Arm, rad_per_count: [f64; 3], wanted_mm: [f64; 3]) -> [i32; 3] {
        let mut q = arm.zero_rad;
        for _ in 0..100 {
            let at = arm.tip_mm(q);
            let slopes: [[f64; 3]; 3] = std::array::from_fn(|j| {
                let mut beside = q;
                beside[j] += 1e-7;
                let there = arm.tip_mm(beside);
                std::array::from_fn(|i| (there[i] - at[i]) / 1e-7)
            });
            let rows = std::array::from_fn(|i| std::array::from_fn(|j| slopes[j][i]));
            let wrong = std::array::from_fn(|i| wanted_mm[i] - at[i]);
            let step = solve(rows, wrong).expect("not singular");
            (0..3).for_each(|i| q[i] += step[i]);
        }
        std::array::from_fn(|i| libm::round((q[i] - arm.zero_rad[i]) / rad_per_count[i]) as i32)
    }

    fn checks(factor: [f64; 3], error_mm: f64) -> Vec<Check> {
        let record = Calibration::PREMIUM_1_5;
        let arm = Arm::of(&record);
        let ratio = record.ratio.to_array().map(f64::from);
        let k = std::array::from_fn(|i| TAU / (4096.0 * ratio[i] * factor[i]));
        let home = arm.tip_mm(arm.zero_rad);
        let check = |direction: Direction| {
            let unit = direction.unit();
            let end = std::array::from_fn(|i| home[i] + 80.0 * unit[i]);
            Check {
                from: [0; 3],
                to: counts(&arm, k, end),
                direction,
                mm: 80.0 + error_mm,
            }
        };
        Direction::ALL.map(check).to_vec()
    }

    #[test]
    fn ratios_and_signs_come_back() {
        let preset = Calibration::PREMIUM_1_5.ratio.to_array().map(f64::from);
        for factor in [[1.0, 1.0, 1.0], [1.07, -0.94, 1.02], [-0.9, -1.1, -1.0]] {
            let found = fit_ratios(&Calibration::PREMIUM_1_5, &checks(factor, 0.0));
            let found = found.expect("a fit");
            for joint in 0..3 {
                let truth = preset[joint] * factor[joint].abs();
                let error = (found.ratio[joint] / truth - 1.0).abs();
                assert!(error < 1e-3, "joint {}: {error}", joint + 1);
                assert_eq!(found.sign[joint], factor[joint].signum());
            }
            assert!(found.off_mm < 0.1, "{}", found.off_mm);
        }
    }

    #[test]
    fn a_joint_that_did_not_move_is_named() {
        let mut checks = checks([1.0; 3], 0.0);
        checks
            .iter_mut()
            .for_each(|check| check.to[1] = check.from[1] + 10);
        let error = fit_ratios(&Calibration::PREMIUM_1_5, &checks).expect_err("too little");
        assert_eq!(
            error,
            FitError::NotMoved {
                joint: 2,
                counts: 10
            }
        );
    }

    #[test]
    fn nonsense_is_no_fit() {
        let mut checks = checks([1.0; 3], 0.0);
        checks[0].to = [400, -4_000, 5_000];
        checks[1].mm = -300.0;
        let error = fit_ratios(&Calibration::PREMIUM_1_5, &checks).expect_err("nonsense");
        assert!(matches!(error, FitError::NoRatios { .. }), "{error}");
    }
}
