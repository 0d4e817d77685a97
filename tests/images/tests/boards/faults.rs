//! Faults in the boards' own images: each ends with zero current and the amplifiers off, within a
//! number of ticks stated here.

use hapterra_core::guard::Fault;
use hapterra_image_tests::bench::Bench;
use hapterra_image_tests::bus::Effect;
use hapterra_image_tests::chip::Commands;
use hapterra_image_tests::device::{Device, machines};
use hapterra_image_tests::elf::Function;
use hapterra_image_tests::machine::{Machine, Stop};
use hapterra_image_tests::supply::Reset;

/// A branch to itself, as in a hanging task.
const HANG: [u8; 2] = [0xFE, 0xE7];
/// An invalid instruction, for a hard fault.
const UNDEFINED: [u8; 2] = [0x00, 0xDE];
/// The watchdog's time at its oscillator's slowest, and the time that its feeding adds, ms.
const WATCHDOG_MS: u64 = 50;
const CHECK_MS: u64 = 10;
/// Longest time between two feedings that the tick accepts, ms.
const STALL_MS: u64 = 40;
/// Longest time with the amplifiers on after a task hangs: to the next feeding at most, and 40 ms
/// more.
const OFF_MS: u64 = CHECK_MS + STALL_MS + 1;

/// Returns the command for zero current, rounded as in the drivers.
fn idle(machine: &Machine) -> i32 {
    (machine.bus().code(0.0) + 0.5) as i32
}

/// Returns the whole ticks until the amplifiers are off, `at_most` at most.
fn ticks_until_off(machine: &mut Machine, at_most: usize) -> usize {
    for ticks in 1..=at_most {
        assert_eq!(machine.run_ticks(1), Stop::Requested);
        if !machine.is_enabled() {
            return ticks;
        }
    }
    panic!("{}: still on after {at_most} ticks", machine.chip.board);
}

/// Checks that the amplifiers were switched off before any other change, and left with zero
/// commands.
fn assert_off_first(machine: &mut Machine) {
    let idle = idle(machine);
    let effects = machine.take_effects();
    let off = effects.iter().position(|e| *e == Effect::Enable(false));
    let after = &effects[off.expect("switched off")..];
    for axis in 0..3 {
        let of_axis = |e: &&Effect| matches!(e, Effect::Command(a, _) if *a == axis);
        let last = after.iter().rfind(of_axis);
        assert_eq!(
            last,
            Some(&Effect::Command(axis, idle)),
            "{}",
            machine.chip.board
        );
    }
    assert!(!after.contains(&Effect::Enable(true)), "stays off");
}

/// Checks that this fault is reported to the host.
fn assert_reported(device: &mut Device<'_>, fault: Fault) {
    device.run_ms(40);
    let reported = device.latest.and_then(|sample| sample.fault);
    assert_eq!(reported, Some(fault));
}

/// Checks that a fault switches the amplifiers off in one tick, that they stay off after `undo`,
/// and that this fault is reported to the host.
fn assert_trips_in_one_tick(
    device: &mut Device<'_>,
    fault: Fault,
    disturb: impl FnOnce(&mut Machine),
    undo: impl FnOnce(&mut Machine),
) {
    let mut machine = device.machine.borrow_mut();
    disturb(&mut machine);
    assert_eq!(ticks_until_off(&mut machine, 2), 1);
    undo(&mut machine);
    machine.run_ticks(20);
    assert_off_first(&mut machine);
    assert!(!machine.is_enabled(), "latched");
    drop(machine);
    assert_reported(device, fault);
}

/// Safety: 4, response times.
#[test]
fn emergency_stop_trips_in_one_tick() {
    Bench::new().on_each(|device| {
        let pin = device.machine.borrow().chip.emergency_stop;
        let press = |machine: &mut Machine| machine.set_input(pin, true);
        let release = |machine: &mut Machine| machine.set_input(pin, false);
        assert_trips_in_one_tick(device, Fault::EmergencyStop, press, release);
    });
}

/// Safety: 3, response times.
#[test]
fn deadman_release_trips_in_one_tick() {
    Bench::new().on_each(|device| {
        let pin = device.machine.borrow().chip.dead_man;
        let release = |machine: &mut Machine| machine.set_input(pin, true);
        assert_trips_in_one_tick(device, Fault::DeadManReleased, release, |_| {});
    });
}

/// Safety: 8, response times.
#[test]
fn encoder_jump_trips_in_one_tick() {
    for axis in 0..3 {
        Bench::new().on_each(|device| {
            let mut counts = device.counts;
            counts[axis] += 400;
            let jump = |machine: &mut Machine| machine.bus().set_encoders(counts);
            assert_trips_in_one_tick(device, Fault::EncoderJump, jump, |_| {});
        });
    }
}

/// Safety: 20, response times.
#[test]
fn cut_converter_link_trips_in_two_ticks() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        if !matches!(machine.chip.commands, Commands::Serial { .. }) {
            return;
        }
        machine.bus().converter.is_cut = true;
        // The tick that detects it has already read its inputs.
        assert_eq!(ticks_until_off(&mut machine, 3), 2);
        drop(machine);
        assert_reported(device, Fault::Hardware);
    });
}

/// Returns the milliseconds until the amplifiers are off and until the watchdog resets a chip with
/// a hanging function; `None` if it never does.
fn ms_until_reset(machine: &mut Machine, function: Function) -> Option<(Option<u64>, u64)> {
    machine.patch(function.address, &HANG);
    let before_ns = machine.bus().now_ns;
    let ms = |machine: &Machine| (machine.bus().now_ns - before_ns) / 1_000_000;
    // Work for the USB stack.
    machine.bus().usb.bus_reset();
    let mut off = None;
    let stop = machine.run_until(3 * WATCHDOG_MS, |m| {
        if off.is_none() && !m.is_enabled() {
            off = Some(ms(m));
        }
        false
    });
    (stop == Stop::Watchdog).then_some((off, ms(machine)))
}

fn assert_in_time(machine: &mut Machine, ms: u64) {
    let (min_timeout_ns, latest_ns) = {
        let watchdog = &machine.bus().watchdog;
        (watchdog.min_timeout_ns(), watchdog.timeout_ns())
    };
    assert!(latest_ns <= WATCHDOG_MS * 1_000_000, "{latest_ns} ns");
    // The tick is first, with a tick or two to spare.
    let spare_ns = min_timeout_ns.saturating_sub(STALL_MS * 1_000_000);
    assert!(spare_ns >= 2_000_000, "{min_timeout_ns} ns at the soonest");
    assert!(ms <= WATCHDOG_MS + CHECK_MS, "reset after {ms} ms");
    // The reset releases every pin, and the external pull-down acts.
    machine.reset(Reset::Watchdog);
    assert!(!machine.is_enabled());
}

#[test]
fn watchdog_is_fed_while_nothing_hangs() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        machine.bus().usb.bus_reset();
        assert_eq!(machine.run_ms(500), Stop::Time);
    });
}

/// Safety: 39, response times.
#[test]
fn hung_task_is_reset_by_the_watchdog() {
    let bench = Bench::new();
    let tasks = |machine: &Machine| {
        machine
            .image
            .functions_like(&["embassy_executor", "raw", "TaskStorage", "poll"])
    };
    for image in machines() {
        let (board, all) = (image.chip.board, tasks(&image));
        assert!(all.len() >= 4, "{board}: main, USB, link, supervisor");
        let mut harmless = 0;
        for task in &all {
            let machine = machines().into_iter().find(|m| m.chip.board == board);
            let terrain = bench.terrain();
            let device = bench.press(machine.expect("still there"), &terrain);
            let mut machine = device.machine.borrow_mut();
            match ms_until_reset(&mut machine, *task) {
                Some((off, reset)) => {
                    // The tick detects it first.
                    let off = off.expect("not left to the reset");
                    println!("{board}: off after {off} ms, reset after {reset} ms");
                    assert!(off <= OFF_MS, "{board}: off after {off} ms");
                    assert_in_time(&mut machine, reset);
                }
                None => harmless += 1,
            }
        }
        assert!(
            harmless <= 1,
            "{board}: main has ended and is never polled again"
        );
    }
}

/// Safety: 39, response times.
#[test]
fn hung_tick_is_reset_by_the_watchdog() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        let tick = machine.image.function_like(&["HapticLoop", "run_tick"]);
        let (off, ms) = ms_until_reset(&mut machine, tick).expect("reset");
        assert_eq!(off, None, "no code is left to switch them off");
        assert_in_time(&mut machine, ms);
    });
}

/// Runs until the amplifiers are off, at once, and checks that only the program's reset follows.
fn assert_off_at_once_and_permanently(machine: &mut Machine) {
    // The link sends when the host reads.
    let stop = machine.run_until(50, |m| {
        let _ = m.bus().usb.take_in(1);
        !m.is_enabled()
    });
    assert_eq!(stop, Stop::Requested, "{}", machine.chip.board);
    assert_eq!(machine.take_effects().last(), Some(&Effect::Enable(false)));
    assert_eq!(machine.run_ms(200), Stop::Software);
    assert_eq!(machine.take_effects(), [], "nothing after it");
}

/// Safety: 40, response times.
#[test]
fn hard_fault_switches_amplifiers_off_first() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        let at = machine.image.message_encoder();
        machine.patch(at.address, &UNDEFINED);
        assert_off_at_once_and_permanently(&mut machine);
        assert_eq!(machine.hard_faults, 1);
    });
}

/// Safety: 40, response times.
#[test]
fn panic_switches_the_amplifiers_off_first() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        let at = machine.image.message_encoder();
        let panic = machine.image.panicking();
        machine.call_instead(at, panic);
        assert_off_at_once_and_permanently(&mut machine);
        assert_eq!(machine.hard_faults, 0);
    });
}

/// A reset releases the enable line, and an amplifier follows with a delay, so its command matters.
/// A start may also take long.
///
/// Safety: 40, images.
#[test]
fn start_after_crash_commands_no_current_first() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        let board = machine.chip.board;
        let commands = machine.bus().commands();
        let idle = idle(&machine);
        assert_ne!(commands, [idle; 3], "{board}: it presses");
        // An interrupted write must be erased at the next start.
        let (areas, _) = machine.chip.flash.calibrations;
        machine.patch(areas[0], &[0x5A]);
        let at = machine.image.message_encoder();
        machine.patch(at.address, &UNDEFINED);
        assert_off_at_once_and_permanently(&mut machine);
        machine.restore(at);
        machine.reset(Reset::Software);
        // Clearing its memory takes the emulated core a few of them.
        assert_eq!(machine.run_ms(10), Stop::Time, "{board}");
        assert_eq!(machine.bus().commands(), [idle; 3], "{board}");
        assert_eq!(machine.run_ms(20), Stop::Time, "{board}");
        let erases = !machine.bus().usb.is_attached();
        assert!(erases, "{board}: nothing took long");
    });
}
