//! Checks of the board's clocks: its ticks against another clock, and
//! the oscillator of its USB against the host's.

use hapterra_core::wire::status::UsbClock;

use super::super::attendant::Attendant;
use super::super::board::Board;
use super::super::finding::Finding;
use super::super::halt::Halt;

/// For how long the ticks are counted, s: an answer that is late by a tenth of a second is off by
/// a hundredth.
const COUNTED_S: f64 = 10.0;
/// By how much the ticks may be off: twice the error of the chips' own oscillators.
const MAX_OFF: f64 = 0.02;
/// Looks within which the oscillator of USB has to follow: the board measures it each second.
const LOOKS: usize = 30;

/// Counts the ticks by the attendant's clock, and asks whether USB's oscillator follows. Returns
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
