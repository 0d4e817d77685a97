//! A core that a debugger halts while force is on, and that resumes before the watchdog resets it:
//! `probe-rs` halts it at every attach and detach.

use hapterra_core::guard::Fault;
use hapterra_image_tests::bench::Bench;
use hapterra_image_tests::bus::Effect;
use hapterra_image_tests::machine::Stop;

/// Halts with force on, ms: from two periods to just below the watchdog's time.
const HALTS_MS: [u64; 4] = [2, 5, 20, 44];
/// Longest time from the end of a halt until the amplifiers are off, ns: the tick is due, and
/// switches off before it reads an encoder.
const OFF_NS: u64 = 20_000;

/// Safety: 42, images.
#[test]
fn first_tick_after_a_halt_has_no_force() {
    let bench = Bench::new();
    for ms in HALTS_MS {
        bench.on_each(|device| {
            let mut machine = device.machine.borrow_mut();
            let board = machine.chip.board;
            let idle = machine.bus().code(0.0);
            let is_idle = |code: i32| (f64::from(code) - idle).abs() < 1.0;
            let commanded = machine.bus().commands();
            assert!(!commanded.into_iter().all(is_idle), "{board}: force is out");
            // The supervisor has just fed it, so the halt ends before the watchdog's time.
            machine.feed_watchdog();
            assert_eq!(machine.halt_ms(ms), Stop::Time, "{board}");
            assert_eq!(machine.bus().commands(), commanded, "{board}: halted");
            machine.resume();
            machine.slice = 10;
            let resumed_ns = machine.bus().now_ns;
            let off = machine.run_until(1, |m| {
                let pulses = m.bus().drives_duty_cycles() == Some(true);
                assert!(!(pulses && m.is_enabled()), "{board}, {ms} ms: pulses");
                !m.is_enabled()
            });
            assert_eq!(off, Stop::Requested, "{board}, {ms} ms: still on");
            let took_ns = machine.bus().now_ns - resumed_ns;
            assert!(took_ns < OFF_NS, "{board}, {ms} ms: off after {took_ns} ns");
            machine.slice = 200;
            assert_eq!(machine.run_ticks(2), Stop::Requested, "{board}");
            let on = machine
                .take_effects()
                .into_iter()
                .find(|effect| match effect {
                    Effect::Enable(on) => *on,
                    Effect::Command(_, code) => !is_idle(*code),
                });
            assert_eq!(on, None, "{board}, {ms} ms: nothing is driven after it");
            drop(machine);
            device.run_ms(40);
            let reported = device.latest.and_then(|sample| sample.fault);
            assert_eq!(reported, Some(Fault::TickGap), "{board}, {ms} ms");
        });
    }
}

/// Safety: images.
#[test]
fn halt_is_detected_although_the_debugger_stops_the_clock() {
    Bench::new().on_each(|device| {
        let mut machine = device.machine.borrow_mut();
        let board = machine.chip.board;
        machine.attach_debugger();
        // One check of the supervisor.
        assert_eq!(machine.run_ms(15), Stop::Time, "{board}");
        assert!(
            machine.is_enabled(),
            "{board}: attaching alone does nothing"
        );
        // The halt is between two ticks.
        assert_eq!(machine.run_ticks(1), Stop::Requested, "{board}");
        machine.feed_watchdog();
        assert_eq!(machine.halt_ms(20), Stop::Time, "{board}");
        machine.resume();
        assert_eq!(machine.run_ticks(1), Stop::Requested, "{board}");
        assert!(!machine.is_enabled(), "{board}");
        drop(machine);
        device.run_ms(40);
        let reported = device.latest.and_then(|sample| sample.fault);
        assert_eq!(reported, Some(Fault::TickGap), "{board}");
    });
}
