//! Check of the command outputs with a meter, the power stages off.

use hapterra_core::wire::request::Request;

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, Reading};
use crate::bringup::finding::Finding;

/// Fractions of full scale at which each output is measured.
const FRACTIONS: [f32; 3] = [0.0, 0.5, -0.5];
/// Largest error of a reading, as a share of full scale: resistors and meter have about 1 % each.
const MAX_ERROR_SHARE: f64 = 0.04;

/// The meter's reading for a fraction of full scale, and its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct OutputScale {
    middle: f64,
    full: f64,
    unit: &'static str,
}

impl OutputScale {
    /// Returns the scale of a board by its name.
    fn of(board: &str) -> Self {
        let (middle, full, unit) = match board {
            "nucleo-h743zi2" => (50.0, 35.0, "% duty cycle"),
            // The G474 is also measured behind its offset stage, because errors of that stage drive
            // a motor too.
            _ => (0.0, 10.0, "V at the amplifier's input"),
        };
        Self { middle, full, unit }
    }
}

/// Measures each output while the board holds it.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let scale = OutputScale::of(&board.device().board);
    for axis in 0..3 {
        for fraction in FRACTIONS {
            let mut shares = [0.0; 3];
            shares[axis] = fraction;
            board.request(&Request::HoldOutputs(Some(shares)))?;
            board.poll_status()?;
            let fraction = f64::from(fraction);
            let found = attendant.read(Reading::Output {
                axis,
                fraction,
                unit: scale.unit,
            })?;
            let expected = scale.middle + scale.full * fraction;
            if found.is_nan() || (found - expected).abs() > MAX_ERROR_SHARE * scale.full {
                board.request(&Request::HoldOutputs(None))?;
                return Err(Finding::Output {
                    axis: axis + 1,
                    found,
                    expected,
                    unit: scale.unit,
                }
                .into());
            }
        }
    }
    board.request(&Request::HoldOutputs(None))?;
    Ok("each output follows, at the middle and at half of full scale in both directions".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_firmware::amplifier::{duty_code, offset_code};

    /// Returns the offset stage's output for the converter's voltage (see the wiring page).
    fn stage_output_v(volts: f64) -> f64 {
        (volts - 1.65) * 10.0 / 1.444
    }

    #[test]
    fn expected_outputs_match_every_board() {
        let near = |found: f64, expected: f64, of: f64| (found - expected).abs() < 0.005 * of;
        for fraction in FRACTIONS {
            let expected = |board| {
                let scale = OutputScale::of(board);
                scale.middle + scale.full * f64::from(fraction)
            };
            let volts = 3.3 * f64::from(offset_code(fraction)) / 4096.0;
            let behind = stage_output_v(volts);
            assert!(near(behind, expected("nucleo-g474re"), 10.0), "{behind}");
            let percent = 100.0 * f64::from(duty_code(fraction, 60_000)) / 60_000.0;
            assert!(near(percent, expected("nucleo-h743zi2"), 35.0), "{percent}");
            let volts = 10.0 * f64::from(fraction);
            assert!(near(volts, expected("nucleo-h743zi2-spi"), 10.0));
        }
    }
}
