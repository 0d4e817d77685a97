//! Shutdown without the program, and the chip's reaction to a failure of its supply, its stack or
//! its core.

use std::cell::Cell;

use hapterra::terrain::Terrain;
use hapterra_core::guard::Fault;
use hapterra_core::scene::Scene;
use hapterra_core::wire::frame::encode;
use hapterra_core::wire::status::{CrashKind, ResetCause, Status};
use hapterra_core::wire::version::VersionCheck;
use hapterra_image_tests::device::{Device, machines, on_each_board, rough_ground};
use hapterra_image_tests::machine::{Machine, Stop};
use hapterra_image_tests::shutdown::Outputs;
use hapterra_image_tests::supply::{NOMINAL_MV, Reset};
use hapterra_tests::usb::Port;

/// Below every chip's highest level.
const TOO_LOW_MV: u32 = 2_800;
/// A branch to itself.
const HANG: [u8; 2] = [0xFE, 0xE7];
/// An invalid instruction, for a hard fault.
const UNDEFINED: [u8; 2] = [0x00, 0xDE];

/// Runs a test on every board, over rough ground.
fn on_each(then: impl FnMut(Machine, &Terrain<'_>, Scene)) {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, then);
}

/// Arms every board, calls `disturb`, resets the board, and passes its status to `check`.
fn after(
    cause: Reset,
    mut disturb: impl FnMut(&mut Device<'_>, Scene),
    mut check: impl FnMut(&str, &Status),
) {
    on_each(|machine, terrain, scene| {
        let mut device = Device::arm(machine, terrain, scene);
        let _ = device.machine.borrow_mut().take_effects();
        disturb(&mut device, scene);
        let mut restarted = Device::open(device.reset_by(cause), terrain, scene);
        let status = restarted.query_status();
        let board = restarted.machine.borrow().chip.board;
        check(board, &status);
    });
}

/// Runs with a reading host until the amplifiers are off.
fn run_until_off(machine: &mut Machine, ms: u64) -> Stop {
    machine.run_until(ms, |m| {
        let _ = m.take_in(1);
        !m.is_enabled()
    })
}

/// Checks that the pins of duty cycles are driven low: an amplifier detects a broken wire, and
/// interference is not a command.
fn assert_low(machine: &Machine, why: &str) {
    let outputs = machine.bus().duty_outputs();
    assert!(
        matches!(outputs, None | Some(Outputs::Low)),
        "{}, {why}: {outputs:?}",
        machine.chip.board
    );
}

/// Safety: 46, images.
#[test]
fn supply_drop_disables_amplifiers_before_the_tick_resumes() {
    let fall = |device: &mut Device<'_>, _: Scene| {
        let mut machine = device.machine.borrow_mut();
        machine.slice = 1;
        assert_eq!(machine.run_until(5, |m| m.is_ticking()), Stop::Requested);
        machine.run_until(1, |m| !m.place().contains("TIM7"));
        assert!(machine.is_ticking() && machine.is_enabled());
        machine.set_supply_mv(TOO_LOW_MV);
        let before_ns = machine.bus().now_ns;
        assert_eq!(run_until_off(&mut machine, 1), Stop::Requested, "off");
        assert!(machine.is_ticking(), "the tick has not gone on");
        // A few instructions, and the cost of an exception.
        let after_ns = machine.bus().now_ns - before_ns;
        assert!(after_ns < 500, "off after {after_ns} ns");
        let _ = machine.take_effects();
        machine.slice = 200;
        assert_eq!(machine.run_ms(20), Stop::Software);
        assert_eq!(machine.take_effects(), [], "nothing after it");
    };
    after(Reset::Software, fall, |board, status| {
        let crash = status.boot.crash.clone().expect("a record");
        assert_eq!(crash.kind, CrashKind::SupplyLow, "{board}");
        let fault = status.health.report.fault;
        assert_eq!(fault, Some(Fault::SupplyLow), "{board}");
    });
}

/// Safety: 46, images.
#[test]
fn boot_waits_while_the_supply_is_low() {
    for mut machine in machines() {
        let board = machine.chip.board;
        machine.set_supply_mv(TOO_LOW_MV);
        let led = machine.chip.led;
        let mut levels = [false; 2];
        let stop = machine.run_until(120, |m| {
            levels[usize::from(m.bus().output(led))] = true;
            false
        });
        assert_eq!(
            (stop, levels),
            (Stop::Time, [true; 2]),
            "{board}: it flickers"
        );
        assert!(!machine.is_attached(), "{board}");
        let idle = (machine.bus().code(0.0) + 0.5) as i32;
        assert_eq!(machine.bus().commands(), [idle; 3], "{board}: meanwhile");
        machine.set_supply_mv(NOMINAL_MV);
        machine.run_ms(50);
        assert!(machine.is_attached(), "{board}");
    }
}

/// Safety: 46, images.
#[test]
fn brown_out_is_reported_after_the_reset() {
    after(
        Reset::BrownOut,
        |_, _| {},
        |board, status| {
            assert_eq!(status.boot.cause, ResetCause::BrownOut, "{board}");
            let fault = status.health.report.fault;
            assert_eq!(fault, Some(Fault::SupplyLow), "{board}");
        },
    );
}

/// Safety: 46.
#[test]
fn missing_brown_out_level_in_option_bytes_is_reported() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let mut device = Device::open(machine, terrain, scene);
        let set = device.query_status().boot;
        assert!(!set.is_brown_out_level_low(), "{board}: {set:?}");
        assert!(set.resets_below_mv >= 2_700, "{board}: {set:?}");
        let machine = device.reset();
        machine.bus().set_brown_out_level(0);
        let mut device = Device::open(machine, terrain, scene);
        let as_sold = device.query_status().boot;
        assert!(as_sold.is_brown_out_level_low(), "{board}: {as_sold:?}");
    });
}

/// Safety: 42, images.
#[test]
fn chip_disables_amplifiers_if_a_debugger_halts_the_core() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        machine.attach_debugger();
        // One check of the supervisor.
        assert_eq!(machine.run_ms(15), Stop::Time, "{board}");
        assert!(
            machine.is_enabled(),
            "{board}: attaching alone does nothing"
        );
        assert_eq!(machine.halt_ms(0), Stop::Time);
        assert_low(&machine, "halted");
        let before_ns = machine.bus().now_ns;
        assert_eq!(machine.halt_ms(200), Stop::Watchdog, "{board}");
        let ms = (machine.bus().now_ns - before_ns) / 1_000_000;
        assert!(ms <= 50, "{board}: reset after {ms} ms");
    });
}

/// Safety: 42.
#[test]
fn locked_core_stops_duty_cycles_and_the_watchdog_resets() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        let handler = machine.image.function_like(&["HardFault"]);
        let encoder = machine.image.message_encoder();
        machine.patch(handler.address, &UNDEFINED);
        machine.patch(encoder.address, &UNDEFINED);
        let stop = run_until_off(&mut machine, 50);
        assert!(matches!(stop, Stop::Lockup(_)), "{board}: {stop:?}");
        assert_low(&machine, "locked up");
        assert_eq!(machine.halt_ms(200), Stop::Watchdog, "{board}");
    });
}

/// Plays on each armed board with duty cycles, with a tick that never ends.
fn on_each_hung(play: impl Fn(&mut Machine)) {
    on_each(|machine, terrain, scene| {
        let device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        if machine.bus().drives_duty_cycles().is_none() {
            return;
        }
        let tick = machine.image.function_like(&["HapticLoop", "run_tick"]);
        machine.run_ticks(1);
        machine.patch(tick.address, &HANG);
        play(&mut machine);
    });
}

/// Safety: 39.
#[test]
fn hung_tick_has_no_duty_cycles_after_two_periods() {
    on_each_hung(|machine| {
        machine.run_ms(1);
        let pulses = |m: &Machine| m.bus().drives_duty_cycles();
        assert_eq!(pulses(machine), Some(true));
        machine.run_ms(1);
        assert!(machine.is_enabled(), "nothing else switches off");
        assert_eq!(pulses(machine), Some(false));
        machine.run_ms(20);
        assert_eq!(pulses(machine), Some(false));
    });
}

/// Safety: 44.
#[test]
fn emergency_stop_ends_duty_cycles_without_the_program() {
    on_each_hung(|machine| {
        assert!(machine.is_enabled(), "nothing else switches off");
        assert_eq!(machine.bus().drives_duty_cycles(), Some(true));
        let pin = machine.chip.emergency_stop;
        machine.set_input(pin, true);
        assert_low(machine, "broken off");
        // Not even when it is released.
        machine.set_input(pin, false);
        machine.run_ms(3);
        assert_low(machine, "broken off");
    });
}

/// Safety: 46.
#[test]
fn supply_drop_ends_duty_cycles_without_the_program() {
    on_each_hung(|machine| {
        machine.mask_supply_interrupt();
        assert_eq!(machine.bus().drives_duty_cycles(), Some(true));
        machine.set_supply_mv(TOO_LOW_MV);
        assert_low(machine, "broken off");
        machine.run_ms(3);
        assert!(machine.is_enabled(), "no program has switched off");
        // Not even after its return.
        machine.set_supply_mv(NOMINAL_MV);
        machine.run_ms(3);
        assert_low(machine, "broken off");
    });
}

/// Safety: 43, images.
#[test]
fn unreadable_memory_ends_the_duty_cycles() {
    for memory in 0..4 {
        on_each_hung(|machine| {
            assert_eq!(machine.bus().drives_duty_cycles(), Some(true));
            machine.bus().failing_memory = Some(memory);
            machine.run_ms(1);
            assert_low(machine, "broken off");
            assert!(machine.is_enabled(), "no program has switched off");
        });
    }
}

/// Safety: 44, images.
#[test]
fn stop_shorter_than_a_tick_is_latched() {
    on_each(|machine, terrain, scene| {
        let mut device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        if machine.bus().drives_duty_cycles().is_none() {
            return;
        }
        machine.run_ticks(1);
        let pin = machine.chip.emergency_stop;
        machine.set_input(pin, true);
        machine.set_input(pin, false);
        // Pulses that return would have the last command.
        machine.slice = 1;
        machine.run_until(3, |m| {
            let pulses = m.bus().drives_duty_cycles() == Some(true);
            assert!(!(pulses && m.is_enabled()), "pulses while still on");
            !m.is_enabled()
        });
        machine.slice = 200;
        machine.run_ticks(1);
        assert!(!machine.is_enabled());
        machine.run_ticks(1);
        let driven = machine.bus().drives_duty_cycles();
        assert_eq!(driven, Some(true), "ready for the next time");
        drop(machine);
        device.run_ms(40);
        let reported = device.latest.and_then(|sample| sample.fault);
        assert_eq!(reported, Some(Fault::EmergencyStop));
    });
}

/// Safety: 41.
#[test]
fn null_pointer_write_disables_amplifiers_and_changes_no_code() {
    // movs r0, #0; str r0, [r0, #0x20]; bx lr: the first word of the tick's code in ITCM.
    const WRITE: [u8; 6] = [0x00, 0x20, 0x00, 0x62, 0x70, 0x47];
    const ITCM_BYTES: usize = 64 * 1024;
    let write = |device: &mut Device<'_>, _: Scene| {
        let mut machine = device.machine.borrow_mut();
        let board = machine.chip.board;
        let code = |m: &Machine| m.chip.is_m7.then(|| m.bytes(0, ITCM_BYTES));
        let before = code(&machine);
        assert!(
            before
                .as_ref()
                .is_none_or(|code| code[0x20..0x24] != [0; 4])
        );
        let encoder = machine.image.message_encoder();
        machine.patch(encoder.address, &WRITE);
        let stop = run_until_off(&mut machine, 50);
        assert_eq!(stop, Stop::Requested, "{board}: off");
        assert_eq!(machine.hard_faults, 1, "{board}");
        assert_eq!(code(&machine), before, "{board}");
        let _ = machine.take_effects();
        assert_eq!(machine.run_ms(200), Stop::Software, "{board}");
        assert_eq!(machine.take_effects(), [], "{board}: nothing after it");
        machine.restore(encoder);
    };
    after(Reset::Software, write, |board, status| {
        let crash = status.boot.crash.clone().expect("a record");
        assert_eq!(crash.kind, CrashKind::HardFault, "{board}: {crash:?}");
        let fault = status.health.report.fault;
        assert_eq!(fault, Some(Fault::HardFault), "{board}");
    });
}

/// Safety: 41, images.
#[test]
fn stack_overflow_switches_off_and_overwrites_nothing() {
    // push {r0-r7, lr}; and again.
    const RECURSE: [u8; 4] = [0xFF, 0xB5, 0xFD, 0xE7];
    let overrun = |device: &mut Device<'_>, _: Scene| {
        let mut machine = device.machine.borrow_mut();
        let board = machine.chip.board;
        let encoder = machine.image.message_encoder();
        machine.patch(encoder.address, &RECURSE);
        let stop = run_until_off(&mut machine, 50);
        assert_eq!(stop, Stop::Requested, "{board}: off");
        assert_eq!(machine.hard_faults, 1, "{board}");
        assert_eq!(machine.run_ms(200), Stop::Software, "{board}");
        machine.restore(encoder);
    };
    after(Reset::Software, overrun, |board, status| {
        let crash = status.boot.crash.clone().expect("a record");
        assert_eq!(crash.kind, CrashKind::StackOverflow, "{board}: {crash:?}");
        let fault = status.health.report.fault;
        assert_eq!(fault, Some(Fault::StackOverflow), "{board}");
    });
}

/// Safety: 40, images.
#[test]
fn hard_fault_during_logging_is_reported_as_hard_fault() {
    let at = Cell::new(0);
    let break_log = |device: &mut Device<'_>, _: Scene| {
        let release = {
            let mut machine = device.machine.borrow_mut();
            let release = machine.image.function_like(&["_defmt_release"]);
            machine.patch(release.address, &UNDEFINED);
            release
        };
        at.set(release.address);
        // A host of another protocol is logged.
        let hello = VersionCheck::Query { protocol: 3 };
        device.send(encode(&hello, &mut [0; 32]).expect("it fits"));
        let mut machine = device.machine.borrow_mut();
        let stop = machine.run_until(200, |m| {
            let _ = m.take_in(1);
            false
        });
        assert_eq!(stop, Stop::Software);
        machine.restore(release);
    };
    after(Reset::Software, break_log, |board, status| {
        let crash = status.boot.crash.clone().expect("a record");
        assert_eq!(crash.kind, CrashKind::HardFault, "{board}: {crash:?}");
        assert_eq!(crash.pc, at.get(), "{board}");
    });
}

/// Safety: 40, images.
#[test]
fn panic_before_the_watchdog_runs_resets_the_chip() {
    on_each(|mut machine, terrain, scene| {
        let board = machine.chip.board;
        let scan = machine.image.function_like(&["CalibrationStore", "scan"]);
        let panic = machine.image.panicking();
        machine.call_instead(scan, panic);
        assert_eq!(machine.run_ms(100), Stop::Software, "{board}");
        assert!(
            !machine.is_attached(),
            "{board}: it was set before the link"
        );
        machine.restore(scan);
        machine.reset(Reset::Software);
        let mut device = Device::open(machine, terrain, scene);
        let status = device.query_status();
        let fault = status.health.report.fault;
        assert_eq!(fault, Some(Fault::Panicked), "{board}");
    });
}

/// Returns the level changes of the heartbeat in this many ticks.
fn beats(machine: &mut Machine, ticks: usize) -> usize {
    let pin = machine.chip.heartbeat;
    let mut level = machine.bus().output(pin);
    let mut changes = 0;
    for _ in 0..ticks {
        machine.run_ticks(1);
        let now = machine.bus().output(pin);
        changes += usize::from(now != level);
        level = now;
    }
    changes
}

/// Safety: 45.
#[test]
fn heartbeat_toggles_each_tick_only_with_amplifiers_on() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        assert_eq!(beats(&mut machine, 20), 20, "{board}: armed");
        let pin = machine.chip.dead_man;
        machine.set_input(pin, true);
        machine.run_ticks(2);
        assert!(!machine.is_enabled(), "{board}");
        assert_eq!(beats(&mut machine, 20), 0, "{board}: off");
    });
}

/// Safety: 45.
#[test]
fn hung_tick_has_no_heartbeat() {
    on_each(|machine, terrain, scene| {
        let board = machine.chip.board;
        let device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        assert_eq!(beats(&mut machine, 4), 4, "{board}: it had one");
        let tick = machine.image.function_like(&["HapticLoop", "run_tick"]);
        machine.patch(tick.address, &HANG);
        machine.run_ms(2);
        let pin = machine.chip.heartbeat;
        let level = machine.bus().output(pin);
        // The watchdog was fed up to 10 ms before, and resets 41 ms after that.
        let changed = machine.run_until(25, |m| m.bus().output(pin) != level);
        assert_eq!(changed, Stop::Time, "{board}");
        assert!(
            machine.is_enabled(),
            "{board}: only a one-shot would see it"
        );
    });
}

/// Safety: 47, images.
#[test]
fn firmware_runs_without_an_external_clock() {
    for mut machine in machines() {
        let board = machine.chip.board;
        // The model has no external clock.
        assert_eq!(machine.run_ms(20), Stop::Time, "{board}");
        assert!(machine.is_attached(), "{board}: it waits for a clock");
        let (control, on) = machine.chip.external_clock;
        assert_eq!(machine.bus().read(control) & on, 0, "{board}: it is on");
    }
}

/// Returns the clock of the core, by the registers of its PLL, from the chip's own oscillator.
fn core_hz(machine: &Machine) -> u64 {
    let field = |address, from: u32, bits: u32| {
        u64::from(machine.bus().read(address) >> from & ((1 << bits) - 1))
    };
    match machine.chip.is_m7 {
        // RCC_PLLCKSELR: DIVM1; RCC_PLL1DIVR: DIVN1, DIVP1.
        true => {
            64_000_000 / field(0x5802_4428, 4, 6) * (field(0x5802_4430, 0, 9) + 1)
                / (field(0x5802_4430, 9, 7) + 1)
        }
        // RCC_PLLCFGR: PLLM, PLLN, PLLR.
        false => {
            16_000_000 / (field(0x4002_100C, 4, 4) + 1) * field(0x4002_100C, 8, 7)
                / (2 * field(0x4002_100C, 25, 2) + 2)
        }
    }
}

/// Safety: images.
#[test]
fn core_clock_stays_in_bounds_with_a_fast_oscillator() {
    for mut machine in machines() {
        let (board, chip) = (machine.chip.board, machine.chip);
        assert_eq!(machine.run_ms(20), Stop::Time, "{board}");
        let hz = core_hz(&machine);
        assert_eq!(hz, chip.core_hz, "{board}");
        let fastest_hz = hz + hz / 100;
        assert!(fastest_hz <= chip.max_core_hz, "{board}: {fastest_hz}");
    }
}

/// Safety: images.
#[test]
fn usb_oscillator_follows_the_usb_in_use() {
    for mut machine in machines() {
        let board = machine.chip.board;
        assert_eq!(machine.run_ms(20), Stop::Time, "{board}");
        let (recovery, source) = machine.chip.recovery;
        let control = machine.bus().read(recovery);
        let settings = machine.bus().read(recovery + 4);
        assert_eq!(settings >> 28 & 3, source, "{board}");
        // CRS_CR: AUTOTRIMEN, CEN.
        assert_eq!(control >> 5 & 3, 0b11, "{board}: {control:#x}");
    }
}
