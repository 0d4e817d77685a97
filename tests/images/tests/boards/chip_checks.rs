//! Checks by the images on their chips, before and while they run.

use hapterra_core::wire::frame::encode;
use hapterra_core::wire::status::UsbClock;
use hapterra_core::wire::version::VersionCheck;
use hapterra_image_tests::device::{Device, machines, on_each_board, rough_ground};
use hapterra_image_tests::machine::Stop;
use hapterra_image_tests::supply::Reset;
use hapterra_tests::usb::Port;

/// DBGMCU_IDC.REV_ID of an H743's revisions Z, Y, X and V.
const OLD_REVISIONS: [u16; 3] = [0x1001, 0x1003, 0x2001];
const REVISION_V: u16 = 0x2003;
/// FLASH_ACR of a G474, and its bit PRFTEN.
const PREFETCH: (u32, u32) = (0x4002_2000, 1 << 8);

/// Safety: images.
#[test]
fn chip_before_revision_v_is_refused_with_a_pattern() {
    for mut machine in machines() {
        if !machine.chip.is_m7 {
            continue;
        }
        let board = machine.chip.board;
        for revision in OLD_REVISIONS {
            machine.reset(Reset::Software);
            machine.bus().set_revision(revision);
            assert_eq!(machine.run_ms(50), Stop::Time, "{board}");
            assert!(!machine.is_attached() && !machine.is_enabled(), "{board}");
            // RCC_CR.PLL1ON.
            let control = machine.bus().read(machine.chip.external_clock.0);
            assert_eq!(control & 1 << 24, 0, "{board}, {revision:#x}: no clock");
        }
        let led = machine.chip.led;
        let (mut changes, mut level) = (0, machine.bus().output(led));
        let flashes = machine.run_until(5_000, |m| {
            let now = m.bus().output(led);
            changes += usize::from(now != level);
            level = now;
            changes == 3
        });
        assert_eq!(flashes, Stop::Requested, "{board}: off, on and off again");
        machine.reset(Reset::Software);
        machine.bus().set_revision(REVISION_V);
        assert_eq!(machine.run_ms(50), Stop::Time, "{board}");
        assert!(machine.is_attached(), "{board}: revision V");
    }
}

/// Safety: images.
#[test]
fn g474_flash_prefetch_is_enabled() {
    for mut machine in machines() {
        if machine.chip.is_m7 {
            continue;
        }
        assert_eq!(machine.run_ms(20), Stop::Time);
        let (register, bit) = PREFETCH;
        assert_eq!(machine.bus().read(register) & bit, bit);
    }
}

/// Safety: images.
#[test]
fn status_reports_whether_usb_clock_follows_the_host() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::open(machine, terrain, scene);
        device.run_ms(1_100);
        assert_eq!(device.query_status().usb_clock, UsbClock::Locked, "{board}");
        device.machine.borrow().bus().usb_clock_follows = false;
        device.run_ms(1_100);
        assert_eq!(
            device.query_status().usb_clock,
            UsbClock::Unlocked,
            "{board}"
        );
    });
}

/// Safety: images.
#[test]
fn probe_that_stops_reading_the_log_blocks_no_task() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::arm(machine, terrain, scene);
        device.machine.borrow_mut().stop_reading_log();
        // A host of another protocol is logged.
        let hello = VersionCheck::Query { protocol: 3 };
        device.send(encode(&hello, &mut [0; 32]).expect("it fits"));
        device.run_ms(100);
        let reported = device.latest.and_then(|sample| sample.fault);
        assert_eq!(reported, None, "{board}");
        assert!(device.machine.borrow().is_enabled(), "{board}: still armed");
    });
}
