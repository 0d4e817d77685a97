//! Checks of the board's clocks: the tick rate by another clock, and the USB oscillator by the
//! host's.

use hapterra_core::wire::status::UsbClock;

use super::super::attendant::Attendant;
use super::super::board::Board;
use super::super::finding::Finding;
use super::super::halt::Halt;

/// Duration of the count, s: a reply that is 0.1 s late causes an error of 1 %.
const COUNT_S: f64 = 10.0;
/// Largest relative error of the tick rate: twice that of the chips' own oscillators.
const MAX_RELATIVE_ERROR: f64 = 0.02;
/// Status requests within which the USB oscillator must lock; the board measures it once a second.
const MAX_POLLS: usize = 30;

/// Counts the ticks by the attendant's clock, and checks that the USB oscillator is locked. Returns
/// the ticks in a second.
///
/// # Errors
/// [`Finding::WrongTickRate`], [`Finding::UsbClockUnlocked`], [`Halt`].
pub(super) fn check_tick_rate(
    board: &mut Board<'_, '_>,
    attendant: &dyn Attendant,
) -> Result<f64, Halt> {
    check_usb_clock(board)?;
    let first = board.poll_status()?;
    let nominal_hz = f64::from(first.device.tick_hz);
    let seconds = |ticks: u32| {
        let board_s = f64::from(ticks) / nominal_hz;
        attendant.time_s(1e3 * board_s)
    };
    let start_s = seconds(0);
    loop {
        let ticks = board.poll_status()?.ticks.run.wrapping_sub(first.ticks.run);
        let passed_s = seconds(ticks) - start_s;
        if passed_s >= COUNT_S {
            let hz = f64::from(ticks) / passed_s;
            let error = (hz / nominal_hz - 1.0).abs();
            return match error <= MAX_RELATIVE_ERROR {
                true => Ok(hz),
                false => Err(Finding::WrongTickRate { hz, nominal_hz }.into()),
            };
        }
    }
}

fn check_usb_clock(board: &mut Board<'_, '_>) -> Result<(), Halt> {
    for _ in 0..MAX_POLLS {
        match board.poll_status()?.usb_clock {
            UsbClock::Locked | UsbClock::Unknown => return Ok(()),
            UsbClock::Unlocked => {}
        }
    }
    Err(Finding::UsbClockUnlocked.into())
}
