//! Check that a board was brought up before it serves terrain.

use hapterra_core::phantom::Calibration;
use hapterra_core::wire::hello::DeviceHello;
use hapterra_firmware::native;

use super::TIMEOUT;
use crate::board::BOARDS;
use crate::bringup::{Identity, Log, Step};
use crate::cli::failure::Failure;
use crate::cli::options::device::EMULATED_TIMEOUT;
use crate::link::{ControlSession, Transport};
use heightfield::printable_text::printable;

/// Queries the device, and refuses a real board whose log is incomplete. The device's scene
/// remains.
///
/// # Errors
/// The board was not brought up; no reply.
pub(in crate::cli) fn check_brought_up(transport: &mut dyn Transport) -> Result<(), Failure> {
    let mut control = ControlSession::open_read_only(Box::new(transport), TIMEOUT)?;
    if is_real(&control.device().board) {
        let record = control.calibration()?;
        let device = control.device();
        let log = Log::read(&Log::path_of(device)?)?;
        if let Some(step) = missing_step(device, record.as_ref(), log) {
            let (board, number, title) = (printable(&device.board), step.number(), step.title());
            let serial = device.serial;
            return Err(Failure::new(format!(
                "{board} {serial} was not brought up with this version of its firmware and this calibration: step {number} ({title}) is not passed"
            ))
            .hint("type hapterra bringup; or, at your own risk, --unchecked"));
        }
    }
    Ok(control.end()?)
}

/// Queries the device, and refuses one that may drive a real arm. The device's scene remains.
///
/// # Errors
/// It may drive an arm; no reply.
pub(in crate::cli) fn check_drives_no_arm(transport: &mut dyn Transport) -> Result<(), Failure> {
    let control = ControlSession::open_read_only(Box::new(transport), EMULATED_TIMEOUT)?;
    let board = &control.device().board;
    if is_real(board) {
        let board = printable(board);
        return Err(Failure::new(format!(
            "{board} is a real board: its arm is not the virtual one that is moved over a plant line"
        ))
        .hint("leave +plant:HOST:PORT out; it is for a board that QEMU emulates"));
    }
    Ok(control.end()?)
}

/// Returns true if a board of this name may drive a real arm: all except those known not to.
fn is_real(board: &str) -> bool {
    let is_emulated = BOARDS
        .iter()
        .any(|known| known.name == board && known.chip.is_none());
    board != native::BOARD && !is_emulated
}

/// Returns the first step missing in the log, for the device's current identity and record.
fn missing_step(device: &DeviceHello, record: Option<&Calibration>, mut log: Log) -> Option<Step> {
    log.update_identity(Identity::of(device, record));
    log.next()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Native;
    use hapterra_core::wire::hello::SerialNumber;

    fn device() -> DeviceHello {
        let native = Box::new(Native::for_replay().free_running());
        let control = ControlSession::open(native, TIMEOUT).expect("it answers");
        DeviceHello {
            board: "nucleo-g474re".try_into().expect("fits"),
            serial: SerialNumber::new([0x2A; 12]),
            ..control.device().clone()
        }
    }

    /// Safety: 16.
    #[test]
    fn bring_up_requires_complete_log_of_this_board_and_record() {
        let (device, record) = (device(), Calibration::PREMIUM_1_5);
        let mut log = Log::default();
        assert_eq!(
            missing_step(&device, Some(&record), log.clone()),
            Some(Step::Board)
        );
        log.update_identity(Identity::of(&device, Some(&record)));
        for step in Step::ALL {
            assert_eq!(
                missing_step(&device, Some(&record), log.clone()),
                Some(step)
            );
            log.add(step, true, String::new());
        }
        assert_eq!(missing_step(&device, Some(&record), log.clone()), None);
        let twin = DeviceHello {
            serial: SerialNumber::new([0x2B; 12]),
            ..device.clone()
        };
        let never = missing_step(&twin, Some(&record), log.clone());
        assert_eq!(never, Some(Step::Board), "another board's log");
        let other = Calibration::PREMIUM_3_0;
        let again = missing_step(&device, Some(&other), log);
        assert_eq!(again, Some(Step::Calibration));
    }

    #[test]
    fn only_real_boards_require_bring_up() {
        for (board, real) in [
            ("nucleo-g474re", true),
            ("nucleo-h743zi2", true),
            ("nucleo-h743zi2-spi", true),
            ("mps2-an386", false),
            ("native", false),
            ("a board of my own", true),
        ] {
            assert_eq!(is_real(board), real, "{board}");
        }
        let mut native = Native::for_replay().free_running();
        assert!(check_brought_up(&mut native).is_ok());
    }
}
