//! The enable line and the command outputs, with a meter and the amplifiers off.

use hapterra_core::wire::request::Request;

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, BoardIs, Reading};
use crate::bringup::finding::Finding;

/// What is below this is low for every amplifier's enable input, V.
const LOW_V: f64 = 0.8;
/// Shares of full scale at which each output is measured.
const FRACTIONS: [f32; 3] = [0.0, 0.5, -0.5];
/// So far a reading may be from what is expected, as a share of full scale: an offset
/// stage has resistors of a per cent, and so has the meter.
const OFF_SHARE: f64 = 0.04;

/// Has the enable line measured.
pub(super) fn enable_line(attendant: &mut dyn Attendant) -> Result<String, Halt> {
    let mut told = Vec::new();
    for is in [BoardIs::Running, BoardIs::InReset, BoardIs::Unplugged] {
        let volts = attendant.read(Reading::EnableVolts(is))?;
        if volts.is_nan() || volts.abs() > LOW_V {
            return Err(Finding::EnableHigh(volts).into());
        }
        told.push(format!("{volts:.2} V"));
    }
    Ok(format!("{} running, in reset, unplugged", told.join(", ")))
}

/// What a board puts out for a share of full scale.
struct OutputScale {
    middle: f64,
    full: f64,
    unit: &'static str,
}

impl OutputScale {
    /// Of a board by its name.
    fn of(board: &str) -> Self {
        let (middle, full, unit) = match board {
            "nucleo-g474re" => (1.65, 1.444, "V at the board"),
            "nucleo-h743zi2" => (50.0, 35.0, "% duty cycle"),
            // The converter on SPI, and what has no outputs but in memory.
            _ => (0.0, 10.0, "V"),
        };
        Self { middle, full, unit }
    }
}

/// Has each output measured while the board holds it.
pub(super) fn held(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let scale = OutputScale::of(&board.device().board);
    for axis in 0..3 {
        for fraction in FRACTIONS {
            let mut shares = [0.0; 3];
            shares[axis] = fraction;
            board.ask(&Request::HoldOutputs(Some(shares)))?;
            board.look()?;
            let fraction = f64::from(fraction);
            let found = attendant.read(Reading::Output {
                axis,
                fraction,
                unit: scale.unit,
            })?;
            let expected = scale.middle + scale.full * fraction;
            if found.is_nan() || (found - expected).abs() > OFF_SHARE * scale.full {
                board.ask(&Request::HoldOutputs(None))?;
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
    board.ask(&Request::HoldOutputs(None))?;
    Ok("each output follows, at the middle and at half of full scale either way".into())
}
