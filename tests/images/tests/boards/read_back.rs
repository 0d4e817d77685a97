//! The chips' own outputs are read back in every tick.

use hapterra_core::guard::{Blockers, Fault};
use hapterra_image_tests::bench::Bench;
use hapterra_image_tests::chip::Commands;
use hapterra_image_tests::device::Device;
use hapterra_image_tests::machine::Stop;

/// Returns the ticks until the amplifiers are off, at most `max`, and the reported fault.
fn ends(device: &mut Device<'_>, max: usize) -> (Option<usize>, Option<Fault>) {
    let mut machine = device.machine.borrow_mut();
    let took = (1..=max).find(|_| {
        assert_eq!(machine.run_ticks(1), Stop::Requested);
        !machine.is_enabled()
    });
    drop(machine);
    device.run_ms(40);
    (took, device.latest.and_then(|sample| sample.fault))
}

/// Safety: 24, images.
#[test]
fn wrong_command_pin_reading_is_a_fault() {
    for axis in 0..3 {
        Bench::new().on_each(|device| {
            let mut machine = device.machine.borrow_mut();
            if !matches!(machine.chip.commands, Commands::Converters(_)) {
                return;
            }
            // As commanded, within the error of a good output.
            let commanded = machine.bus().commands()[axis] as u16;
            machine.bus().command_held_at = Some((axis, commanded + 40));
            assert_eq!(machine.run_ticks(20), Stop::Requested);
            assert!(machine.is_enabled(), "axis {axis}: within its error");
            machine.bus().command_held_at = Some((axis, commanded + 200));
            drop(machine);
            let (took, reported) = ends(device, 6);
            assert_eq!(took, Some(3), "axis {axis}");
            assert_eq!(reported, Some(Fault::OutputsNotAsSet), "axis {axis}");
        });
    }
}

/// Safety: 24, images.
#[test]
fn enable_pin_held_low_externally_is_a_fault() {
    Bench::new().on_each(|device| {
        let board = device.machine.borrow().chip.board;
        device.machine.borrow().bus().enable_held_at = Some(false);
        let (took, reported) = ends(device, 3);
        assert_eq!(took, Some(1), "{board}");
        assert_eq!(reported, Some(Fault::OutputsNotAsSet), "{board}");
    });
}

/// Safety: 24, images.
#[test]
fn enable_pin_held_high_externally_blocks_arming() {
    let bench = Bench::new();
    let terrain = bench.terrain();
    for machine in hapterra_image_tests::device::machines() {
        let board = machine.chip.board;
        let mut device = Device::open(machine, &terrain, bench.scene(&terrain));
        let is_blocked = |device: &mut Device<'_>| {
            device.run_ms(150);
            let report = device.query_status().health.report;
            report.blockers.contains(Blockers::OUTPUTS_NOT_AS_SET)
        };
        assert!(!is_blocked(&mut device), "{board}");
        device.machine.borrow().bus().enable_held_at = Some(true);
        assert!(is_blocked(&mut device), "{board}");
    }
}
