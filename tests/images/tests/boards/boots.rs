//! A board's report after a reset: the cause, the end of the last program, and its calibration.
//! Also the depth of its stack.

use hapterra::terrain::Terrain;
use hapterra_core::guard::Fault;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::status::{CalibrationSource, CrashKind, ResetCause, Status};
use hapterra_firmware::store::PLACE;
use hapterra_image_tests::device::{Device, on_each_board, rough_ground};
use hapterra_image_tests::elf::Function;
use hapterra_image_tests::machine::{Machine, Stop};
use hapterra_image_tests::supply::Reset;
use hapterra_tests::usb::Port;

/// Runs a test on every board, over rough ground.
fn on_each(then: impl FnMut(Machine, &Terrain<'_>, Scene)) {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, then);
}

/// Opens a board, calls `disturb`, and queries it after a reset of this kind.
fn after_reset(cause: Reset, mut disturb: impl FnMut(&mut Device<'_>)) -> Vec<(Machine, Status)> {
    let mut all = vec![];
    on_each(|machine, terrain, scene| {
        let mut device = Device::open(machine, terrain, scene);
        disturb(&mut device);
        let mut restarted = Device::open(device.reset_by(cause), terrain, scene);
        let status = restarted.query_status();
        all.push((restarted.reset(), status));
    });
    all
}

/// Breaks a function of the link, runs with a reading host until this kind of reset, and restores
/// the code.
fn run_until_reset(device: &Device<'_>, by: Stop, break_it: impl FnOnce(&mut Machine, Function)) {
    let mut machine = device.machine.borrow_mut();
    let at = machine.image.message_encoder();
    break_it(&mut machine, at);
    let stop = machine.run_until(300, |m| {
        let _ = m.take_in(1);
        false
    });
    assert_eq!(stop, by);
    machine.restore(at);
}

/// Safety: images.
#[test]
fn panic_is_reported_after_reset_with_file_and_line() {
    let reported = after_reset(Reset::Software, |device| {
        run_until_reset(device, Stop::Software, |machine, at| {
            machine.call_instead(at, machine.image.panicking());
        });
    });
    for (machine, status) in reported {
        let board = machine.chip.board;
        assert_eq!(status.boot.cause, ResetCause::Software, "{board}");
        let crash = status.boot.crash.expect("a crash");
        assert_eq!(crash.kind, CrashKind::Panic, "{board}");
        assert_eq!((crash.file.as_str(), crash.line), ("made/by/a/test.rs", 7));
        assert!(crash.tick > 0, "{board}");
        assert_eq!(status.health.report.fault, Some(Fault::Panicked), "{board}");
    }
}

#[test]
fn hard_fault_is_reported_after_reset_with_address() {
    let reported = after_reset(Reset::Software, |device| {
        run_until_reset(device, Stop::Software, |machine, at| {
            machine.patch(at.address, &[0x00, 0xDE]);
        });
    });
    for (machine, status) in reported {
        let board = machine.chip.board;
        let crash = status.boot.crash.expect("a crash");
        assert_eq!(crash.kind, CrashKind::HardFault, "{board}");
        assert_eq!(
            machine.image.at(crash.pc),
            machine.image.at(machine.image.message_encoder().address)
        );
        assert_eq!(
            status.health.report.fault,
            Some(Fault::HardFault),
            "{board}"
        );
    }
}

/// Safety: 40, images.
#[test]
fn panic_is_reported_even_if_crash_record_creation_fails() {
    let reported = after_reset(Reset::Software, |device| {
        let record = {
            let mut machine = device.machine.borrow_mut();
            let record = machine.image.function_like(&["CrashRecord", "new"]);
            machine.patch(record.address, &[0x00, 0xDE]);
            record
        };
        run_until_reset(device, Stop::Software, |machine, at| {
            machine.call_instead(at, machine.image.panicking());
        });
        let mut machine = device.machine.borrow_mut();
        assert_eq!(machine.hard_faults, 1, "making the record failed");
        machine.restore(record);
    });
    for (machine, status) in reported {
        let board = machine.chip.board;
        let crash = status.boot.crash.expect("a crash");
        assert_eq!((crash.kind, crash.tick), (CrashKind::Panic, 0), "{board}");
        assert_eq!(status.health.report.fault, Some(Fault::Panicked), "{board}");
    }
}

#[test]
fn watchdog_reset_is_reported_without_crash_record() {
    let reported = after_reset(Reset::Watchdog, |device| {
        run_until_reset(device, Stop::Watchdog, |machine, at| {
            machine.patch(at.address, &[0xFE, 0xE7]);
        });
    });
    for (machine, status) in reported {
        let board = machine.chip.board;
        assert_eq!(status.boot.cause, ResetCause::Watchdog, "{board}");
        assert_eq!(status.boot.crash, None, "{board}");
        let fault = status.health.report.fault;
        assert_eq!(fault, Some(Fault::WatchdogReset), "{board}");
    }
}

#[test]
fn stored_calibration_is_loaded_after_a_reset() {
    let reported = after_reset(Reset::Watchdog, |device| {
        let before = device.query_status();
        assert_eq!(before.boot.cause, ResetCause::PowerOn);
        assert_eq!(before.calibration, CalibrationSource::None);
        assert_eq!(store(device), Ok(()));
    });
    for (machine, status) in reported {
        let board = machine.chip.board;
        assert_eq!(status.calibration, CalibrationSource::Stored, "{board}");
        assert_eq!(
            status.model,
            Some(Calibration::PREMIUM_1_5.model),
            "{board}"
        );
    }
}

/// Stores a calibration, with the dead-man press that it requires. Returns the answer.
fn store(device: &mut Device<'_>) -> Result<(), Refusal> {
    let calibration = Calibration::PREMIUM_1_5;
    device.request(Request::SetCalibration { calibration });
    device.request(Request::StoreCalibration);
    let pin = device.machine.borrow().chip.dead_man;
    for is_open in [true, false, true] {
        device.machine.borrow_mut().set_input(pin, is_open);
        device.run_ms(150);
    }
    let (request, result) = device.answer.take().expect("an answer");
    assert_eq!(request, Request::StoreCalibration);
    result
}

/// Safety: 17.
#[test]
fn full_memory_is_erased_at_the_next_start() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let (areas, bytes) = machine.chip.flash.calibrations;
        let mut device = Device::open(machine, terrain, scene);
        assert_eq!(store(&mut device), Ok(()), "{board}");
        let record = device.machine.borrow().bytes(areas[0], PLACE);
        let places = bytes as usize / PLACE;
        for area in areas {
            device
                .machine
                .borrow_mut()
                .patch(area, &record.repeat(places));
        }
        // A link that still works shows that the watchdog is fed.
        assert_eq!(store(&mut device), Err(Refusal::MemoryFull), "{board}");
        device.run_ms(300);
        let full = device.machine.borrow().bytes(areas[0], PLACE);
        assert_eq!(full, record, "{board}: nothing was erased");
        // The start lasts as long as the erase, and succeeds.
        let mut restarted = Device::open(device.reset(), terrain, scene);
        let status = restarted.query_status();
        assert_eq!(status.calibration, CalibrationSource::Stored, "{board}");
        let blank = restarted.machine.borrow().bytes(areas[0], bytes as usize);
        assert!(blank.iter().all(|byte| *byte == 0xFF), "{board}: no room");
        assert_eq!(store(&mut restarted), Ok(()), "{board}");
    });
}

/// Positions in the vector table.
const NMI: u32 = 2;
const BUS_FAULT: u32 = 5;

/// Returns a word in the middle of a record, by the first byte of its area.
fn middle(machine: &Machine, place: u32) -> u32 {
    let (areas, _) = machine.chip.flash.calibrations;
    areas[0] + place * PLACE as u32 + 2 * machine.chip.flash.word
}

/// Safety: 17.
#[test]
fn interrupted_calibration_write_keeps_previous_record() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::open(machine, terrain, scene);
        assert_eq!(store(&mut device), Ok(()), "{board}");
        let cut = middle(&device.machine.borrow(), 1);
        // Half of a word, and nothing after it.
        device.machine.borrow_mut().patch(cut, &[0x5A]);
        device.machine.borrow_mut().make_unreadable(cut);
        let mut restarted = Device::open(device.reset(), terrain, scene);
        let status = restarted.query_status();
        assert_eq!(status.calibration, CalibrationSource::Stored, "{board}");
        assert_eq!(status.health.report.fault, Some(Fault::WatchdogReset));
        assert_eq!(status.boot.crash, None, "{board}");
        let forbidden_access = |vector| restarted.machine.borrow().taken.contains(&vector);
        assert!(
            forbidden_access(NMI) || forbidden_access(BUS_FAULT),
            "{board}: it was not read"
        );
        let reported = restarted.machine.borrow().bus().reports_unreadable();
        assert!(!reported, "{board}: left for the next write to fail by");
        assert_eq!(store(&mut restarted), Ok(()), "{board}: no room beside it");
        assert_eq!(restarted.machine.borrow().hard_faults, 0, "{board}");
    });
}

#[test]
fn interrupted_first_calibration_write_leaves_no_record() {
    on_each(|mut machine, terrain, scene| {
        let board = machine.chip.board;
        let cut = middle(&machine, 0);
        machine.patch(cut, &[0x5A]);
        machine.make_unreadable(cut);
        let mut device = Device::open(machine, terrain, scene);
        let status = device.query_status();
        assert_eq!(status.calibration, CalibrationSource::None, "{board}");
        assert_eq!(status.health.report.fault, None, "{board}");
        assert_eq!(store(&mut device), Ok(()), "{board}: the area was erased");
    });
}

/// Safety: 40.
#[test]
fn unreadable_program_word_stops_the_program() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let device = Device::open(machine, terrain, scene);
        let crc = device
            .machine
            .borrow()
            .image
            .symbol_like(&["hapterra_core", "crc", "CRC"]);
        let crc = crc.expect("the table of the check sum");
        device
            .machine
            .borrow_mut()
            .make_unreadable(crc.address + 64 * 4);
        let mut machine = device.machine.borrow_mut();
        let stop = machine.run_until(300, |m| {
            let _ = m.take_in(1);
            false
        });
        assert_eq!(stop, Stop::Software, "{board}");
        let forbidden_access = |vector| machine.taken.contains(&vector);
        assert!(
            forbidden_access(NMI) || forbidden_access(BUS_FAULT),
            "{board}: it was not read"
        );
    });
}

#[test]
fn third_of_the_stack_is_never_used() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::arm(machine, terrain, scene);
        device.move_to([300, -200, 250]);
        device.run_ms(1_200);
        let stack = device.query_status().stack;
        println!(
            "{board}: {} of {} bytes of stack used",
            stack.high_water, stack.size
        );
        assert!(stack.size >= 12 * 1024, "{board}: {stack:?}");
        assert!(stack.high_water > 500, "{board}: {stack:?}");
        assert!(3 * stack.high_water <= 2 * stack.size, "{board}: {stack:?}");
    });
}

/// Safety: images.
#[test]
fn single_bank_g474_starts_and_refuses_to_store() {
    on_each(|machine, terrain, scene| {
        if machine.chip.is_m7 {
            return;
        }
        // FLASH_OPTR.DBANK.
        machine.bus().cleared_options = Some((0x4002_2020, 1 << 22));
        let mut device = Device::open(machine, terrain, scene);
        assert_eq!(device.query_status().health.report.fault, None);
        assert_eq!(store(&mut device), Err(Refusal::NoMemory));
    });
}
