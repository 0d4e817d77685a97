//! Calibrations that no device may accept, and its absolute limits, written a second time.

use hapterra_core::Vec3;
use hapterra_core::phantom::{Calibration, Model};

use crate::random::Random;

/// Returns a valid, harmless record that differs from the stored one of the campaign's arm.
#[must_use]
pub fn harmless() -> Calibration {
    Calibration {
        max_speed_mm_s: 999.0,
        ..Calibration::PREMIUM_1_5
    }
}

/// Returns a record with one number above its absolute limit or of garbage.
#[must_use]
pub fn calibration(random: &mut Random) -> Calibration {
    let mut record = Calibration::PREMIUM_1_5;
    if random.below(2) == 0 {
        record.model = Model::Other;
    }
    let factor = random.between(1.01, 4.0) as f32;
    let garbage = [f32::NAN, f32::INFINITY, -1.0, f32::MAX][random.below(4)];
    let axis = random.below(3);
    match random.below(14) {
        0 => record.peak_current_a[axis] *= factor,
        1 => record.continuous_current_a[axis] *= factor,
        2 => record.thermal.resistance_ohm /= factor,
        3 => record.thermal.winding_k_per_w /= factor,
        4 => record.thermal.housing_k_per_w = 0.1,
        5 => record.thermal.winding_s *= factor,
        6 => record.thermal.housing_s *= factor,
        7 => record.max_force_n *= factor,
        8 => record.max_speed_mm_s *= 1.25 * factor,
        9 => record.torque_constant[axis] /= 2.0 * factor,
        10 => record.ratio[axis] = garbage,
        11 => record.peak_current_a[axis] = garbage,
        12 => record.thermal.housing_k_per_w = garbage.min(0.0),
        _ => record.l1_mm = garbage,
    }
    record
}

/// Checks that an active record keeps the absolute limits of a Premium 1.5.
///
/// # Errors
/// The first number above its limit.
pub fn check_limits(record: &Calibration) -> Result<(), String> {
    let thermal = &record.thermal;
    let max = |values: Vec3| values.max_element();
    let numbers = [
        ("peak current", max(record.peak_current_a), 5.5),
        ("continuous current", max(record.continuous_current_a), 1.24),
        ("1 / Ω", 1.0 / thermal.resistance_ohm, 1.0 / 2.82),
        ("W/K of a winding", 1.0 / thermal.winding_k_per_w, 1.0 / 3.1),
        (
            "W/K of a housing",
            1.0 / thermal.housing_k_per_w,
            1.0 / 14.0,
        ),
        ("time of a winding", thermal.winding_s, 12.0),
        ("time of a housing", thermal.housing_s, 612.0),
        ("force", record.max_force_n, 8.5),
        ("speed", record.max_speed_mm_s, 1_250.0),
        (
            "A/Nm of a joint",
            max((record.ratio * record.torque_constant).recip()),
            2.0 / (11.2 * 0.0234),
        ),
    ];
    // Negated, so that NaN counts as above.
    let above = numbers.into_iter().find(|(_, is, at_most)| {
        let keeps = *is >= 0.0 && *is <= at_most * 1.001;
        !keeps
    });
    match above {
        None => Ok(()),
        Some((name, is, at_most)) => Err(format!(
            "a calibration is in force with a {name} of {is}, at most {at_most} may be"
        )),
    }
}
