//! Checks of the board's clocks: the tick rate by another clock, and the USB oscillator by the
//! host's.

use hapterra_core::wire::status::UsbClock;

use super::super::attendant::Attendant;
use super::super::board::Board;
use super::super::finding::Finding;
use super::super::halt::Halt;

/// Duration of the count, s: a reply that is 0.1 s late causes an error of 1 %.
const COUNTED_S: f64 = 10.0;
/// Largest relative error of the tick rate: twice that of the chips' own oscillators.
const MAX_OFF: f64 = 0.02;
/// Looks within which the USB oscillator must lock; the board measures it once a second.
const LOOKS: usize = 30;

/// Counts the ticks by the attendant's clock, and checks that the USB oscillator is locked. Returns
/// the ticks in a second.
///
/// # Errors
/// [`Finding::WrongTickRate`], [`Finding::UsbClockUnlocked`], [`Halt`].
pub(super) fn agree(board: &mut Board<'_, '_>, attendant: &dyn Attendant) -> Result<f64, Halt> {
    usb_follows(board)?;
    let first = board.look()?;
    let stated_hz = f64::from(first.device.tick_hz);
    let seconds = |ticks: u32| {
        let board_s = f64::from(ticks) / stated_hz;
        attendant.time_s(1e3 * board_s)
    };
    let began_s = seconds(0);
    loop {
        let ticks = board.look()?.ticks.run.wrapping_sub(first.ticks.run);
        let passed_s = seconds(ticks) - began_s;
        if passed_s >= COUNTED_S {
            let hz = f64::from(ticks) / passed_s;
            let off = (hz / stated_hz - 1.0).abs();
            return match off <= MAX_OFF {
                true => Ok(hz),
                false => Err(Finding::WrongTickRate { hz, stated_hz }.into()),
            };
        }
    }
}

fn usb_follows(board: &mut Board<'_, '_>) -> Result<(), Halt> {
    for _ in 0..LOOKS {
        match board.look()?.usb_clock {
            UsbClock::Locked | UsbClock::Unknown => return Ok(()),
            UsbClock::Unlocked => {}
        }
    }
    Err(Finding::UsbClockUnlocked.into())
}
