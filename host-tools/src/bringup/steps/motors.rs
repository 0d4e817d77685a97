//! Jogs of one motor at a time, to find its joint, direction and torque.

use glam::{DVec3, Vec3};
use hapterra_core::guard::{Fault, JOG_SHARE, Jog};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::Status;

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, Reading, Task};
use crate::bringup::finding::Finding;
use crate::calibrate::N_PER_GRAM;

/// Duration of a jog to find the direction, ms.
const SIGN_JOG_MS: u16 = 500;
/// Duration of a jog to read the scale, ms.
const SCALE_JOG_MS: u16 = 3_000;
/// Angle from which a joint counts as moved by a jog, rad: 0.3 mm at the tip of a Premium 1.5, a
/// third of the motion in a relaxed hand.
const MOVED_RAD: f64 = 0.001_5;
/// Attempts to distinguish the motor's motion from the hand's.
const MAX_ATTEMPTS: usize = 3;
/// Largest factor between measured torque and the record's, in both directions. The reading
/// includes the joint's friction, about an eighth of a jog's torque on a Premium 1.5, and the scale
/// is never quite straight: it shows only the order of magnitude.
const TORQUE_FACTOR: f64 = 1.6;

/// Finds the joint, sign and torque constant of a motor (0 to 2).
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
    axis: usize,
) -> Result<String, Halt> {
    let record = super::zeroed_record(board, attendant)?;
    let sign = find_sign(board, attendant, &record, axis)?;
    let found = find_torque(board, attendant, &record, axis)?;
    let nominal = f64::from(record.torque_constant[axis]);
    Ok(format!(
        "turns joint {} in the right direction ({sign:+} in the record); {found:.4} Nm/A by the scale, {nominal:.4} in the record",
        axis + 1
    ))
}

/// Returns the current of a jog, A.
fn current_a(record: &Calibration, axis: usize) -> f32 {
    JOG_SHARE * record.continuous_current_a[axis]
}

/// Finds the sign by jogs in both directions while the tip is held loosely.
fn find_sign(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
    record: &Calibration,
    axis: usize,
) -> Result<i8, Halt> {
    let current_a = current_a(record, axis);
    let mut sign = Err(Finding::Unclear { motor: axis + 1 });
    for _ in 0..MAX_ATTEMPTS {
        attendant.finish(Task::HoldLoosely)?;
        board.wait_for_rest(attendant)?;
        // The joints' positions also show the cause that a fault would report.
        let mut jog_once = |current_a| jog(board, attendant, (axis, current_a, SIGN_JOG_MS), false);
        let (plus, minus) = (jog_once(current_a)?.0, jog_once(-current_a)?.0);
        sign = sign_from_motion(record, axis, plus, minus);
        if !matches!(sign, Err(Finding::Unclear { .. })) {
            break;
        }
    }
    Ok(sign?)
}

/// Runs a jog at the attendant's dead-man press. Returns the joints' motion, rad, and the jog fault
/// that ended it, if any.
fn jog(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
    (axis, current_a, hold_ms): (usize, f32, u16),
    on_scale: bool,
) -> Result<(DVec3, Option<Fault>), Halt> {
    let axis = axis as u8; // 0 to 2
    let jog = Jog {
        axis,
        current_a,
        hold_ms,
    };
    board.drive(attendant, &Request::Jog(jog))?;
    let angles = |status: &Status| status.health.angles_rad.as_dvec3();
    let began = |status: &Status| {
        let report = &status.health.report;
        report.mode.is_driving() || report.fault.is_some()
    };
    let first = board.wait_for_task(attendant, Task::PressDeadMan, began)?;
    let (from, mut driven, mut now, mut reported) = (angles(&first), first.clone(), first, false);
    while now.health.report.mode.is_driving() {
        let full = now.health.currents_a.abs().max_element() > 0.99 * current_a.abs();
        if on_scale && full && !reported {
            attendant.begin(Task::ReadScale);
            reported = true;
        }
        driven = now;
        now = board.poll_status()?;
    }
    board.wait_for_task(attendant, Task::ReleaseDeadMan, |s| {
        !s.health.sense.dead_man
    })?;
    let fault = now.health.report.fault;
    if let Some(fault) = fault {
        let (number, meaning) = (fault.number(), fault.meaning());
        attendant.notify(&format!("  the jog ended with fault {number}: {meaning}"));
    }
    // A held joint springs back when the current ends; one that ran away does not.
    let at = match fault {
        None | Some(Fault::NoMotion) => driven,
        Some(Fault::JogRanAway) => now,
        Some(fault) => return Err(Finding::Fault(fault).into()),
    };
    if fault.is_some() {
        board.request(&Request::ClearFault { fault })?;
    }
    Ok((angles(&at) - from, fault))
}

/// Returns the motor's sign, from the joints' motion under a positive and a negative current, rad.
fn sign_from_motion(
    record: &Calibration,
    axis: usize,
    plus: DVec3,
    minus: DVec3,
) -> Result<i8, Finding> {
    let (by_motor, by_hand) = (0.5 * (plus - minus), 0.5 * (plus + minus));
    let joint = by_motor.abs().max_position();
    let motor = axis + 1;
    if by_motor[joint].abs() < MOVED_RAD {
        return match by_hand.abs().max_element() < 10.0 * MOVED_RAD {
            true => Err(Finding::NoPush {
                motor,
                current_a: current_a(record, axis),
            }),
            false => Err(Finding::Unclear { motor }),
        };
    }
    if by_hand[joint].abs() > by_motor[joint].abs() {
        return Err(Finding::Unclear { motor });
    }
    if joint != axis {
        return Err(Finding::SwappedMotors {
            motor,
            joint: joint + 1,
        });
    }
    let right = by_motor[joint].signum();
    match right == f64::from(record.motor_sign[axis]) {
        true => Ok(right as i8),
        false => Err(Finding::InvertedMotor {
            motor,
            right: right as i8,
        }),
    }
}

/// Jogs towards larger angles while a spring scale holds the tip. Returns the motor's torque
/// constant by the scale, Nm/A.
fn find_torque(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
    record: &Calibration,
    axis: usize,
) -> Result<f64, Halt> {
    let current_a = current_a(record, axis) * record.motor_sign[axis];
    attendant.finish(Task::HoldWithScale(axis))?;
    board.wait_for_rest(attendant)?;
    let rest = attendant.read(Reading::ScaleGrams { pushed: false })?;
    if let (_, Some(fault)) = jog(board, attendant, (axis, current_a, SCALE_JOG_MS), true)? {
        return Err(Finding::Fault(fault).into());
    }
    let pushed = attendant.read(Reading::ScaleGrams { pushed: true })?;
    let torque_nm = (pushed - rest) * N_PER_GRAM * 1e-3 * lever_mm(record, axis);
    let found = torque_nm / f64::from(current_a.abs() * record.ratio[axis]);
    let nominal = f64::from(record.torque_constant[axis]);
    match (nominal / TORQUE_FACTOR..nominal * TORQUE_FACTOR).contains(&found) {
        true => Ok(found),
        false => Err(Finding::WrongTorque {
            motor: axis + 1,
            found,
            record: nominal,
        }
        .into()),
    }
}

/// Returns the distance of the tip from a joint's axis in the zero pose, mm.
fn lever_mm(record: &Calibration, axis: usize) -> f64 {
    let arm = crate::calibrate::Arm::of(record);
    let tip = |q: DVec3| arm.tip_mm(q);
    let turn = Vec3::AXES[axis].as_dvec3() * 1e-6;
    (tip(arm.zero_rad + turn) - tip(arm.zero_rad)).length() / 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECORD: Calibration = Calibration::PREMIUM_1_5;

    fn sign_of_motor_2(plus: [f64; 3], minus: [f64; 3]) -> Result<i8, Finding> {
        sign_from_motion(&RECORD, 1, DVec3::from(plus), DVec3::from(minus))
    }

    #[test]
    fn each_motor_mistake_has_its_own_finding() {
        assert_eq!(
            sign_of_motor_2([0.0, 0.006, 0.001], [0.0, -0.005, -0.001]),
            Ok(1)
        );
        let right = -1;
        let inverted = Err(Finding::InvertedMotor { motor: 2, right });
        assert_eq!(
            sign_of_motor_2([0.0, -0.006, 0.0], [0.0, 0.006, 0.0]),
            inverted
        );
        let swapped = Err(Finding::SwappedMotors { motor: 2, joint: 3 });
        assert_eq!(
            sign_of_motor_2([0.0, 0.001, -0.007], [0.0, 0.0, 0.007]),
            swapped
        );
        let none = sign_of_motor_2([0.0, 0.000_1, 0.0], [0.000_1, 0.0, 0.0]);
        assert!(matches!(none, Err(Finding::NoPush { motor: 2, .. })));
    }

    #[test]
    fn hand_motion_beyond_motor_motion_is_unclear() {
        let unclear = Err(Finding::Unclear { motor: 2 });
        assert_eq!(sign_of_motor_2([0.0, 0.03, 0.0], [0.0, 0.02, 0.0]), unclear);
        assert_eq!(sign_of_motor_2([0.02, 0.0, 0.0], [0.02, 0.0, 0.0]), unclear);
    }

    #[test]
    fn levers_in_the_zero_pose_match_the_links() {
        let levers = [0, 1, 2].map(|axis| lever_mm(&RECORD, axis));
        for (lever, link) in levers.into_iter().zip([209.55, 209.55, 169.545]) {
            assert!((lever - link).abs() < 1e-3, "{lever} {link}");
        }
    }
}
