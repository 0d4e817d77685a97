//! Ready lines and current monitors.

use super::*;

/// Runs until the fault, with the amplifiers on, for at most `max_ticks` ticks.
fn ticks_until(bench: &mut Bench, fault: Fault, max_ticks: u32) -> u32 {
    for ticks in 1..=max_ticks {
        bench.tick();
        if let Some(found) = bench.guard.report().fault {
            assert_eq!(found, fault);
            return ticks;
        }
    }
    panic!("no fault within {max_ticks} ticks");
}

/// Pushes up with 3 N; `measure` maps the command of the tick before the last to each motor's
/// measured current. Returns the ticks until the fault, if any.
fn compared(measure: impl Fn(Vec3) -> Vec3) -> Option<u32> {
    let mut bench = Bench::armed();
    bench.sense.measured_ma = Some([0; 3]);
    bench.target_n = Vec3::new(2.0, 2.0, 3.0);
    let mut commands = [Vec3::ZERO; 2];
    for ticks in 1..500 {
        let measured = measure(commands[0]) * 1e3;
        bench.sense.measured_ma = Some(measured.to_array().map(|ma| ma as i16));
        commands = [commands[1], bench.tick().currents_a];
        if let Some(fault) = bench.guard.report().fault {
            assert_eq!(fault, Fault::CurrentMismatch);
            assert_eq!(commands[1], Vec3::ZERO, "in the same tick");
            return Some(ticks);
        }
    }
    None
}

/// Safety: 22.
#[test]
fn unready_amplifier_is_a_fault_in_the_third_tick() {
    let mut bench = Bench::armed();
    bench.sense.amplifier_not_ready = true;
    assert_eq!(ticks_until(&mut bench, Fault::AmplifierNotReady, 10), 3);
    // A spike of two ticks is no fault.
    let mut bench = Bench::armed();
    for ticks in 0..300 {
        bench.sense.amplifier_not_ready = ticks % 3 != 0;
        bench.tick();
    }
    assert_eq!(bench.guard.report().fault, None);
}

#[test]
fn amplifier_may_take_ten_milliseconds_to_become_ready() {
    for late in [10, 13] {
        let mut bench = Bench::new();
        bench.guard.arm();
        bench.tick();
        bench.sense.dead_man = true;
        while bench.guard.mode() != Mode::Ramping {
            bench.tick();
        }
        bench.sense.amplifier_not_ready = true;
        bench.ticks(late);
        bench.sense.amplifier_not_ready = false;
        bench.ticks(20);
        let fault = bench.guard.report().fault;
        let expected = (late > 12).then_some(Fault::AmplifierNotReady);
        assert_eq!(fault, expected, "ready after {late} ms");
    }
}

#[test]
fn currents_that_follow_commands_are_no_fault() {
    assert_eq!(compared(|a| a), None);
    // A reading with an error of 3 % and 0.2 A.
    assert_eq!(compared(|a| a * 1.03 + 0.2), None);
}

/// Safety: 23.
#[test]
fn uncommanded_current_is_a_fault() {
    let open = compared(|a| Vec3::new(0.0, a.y, a.z));
    assert!(open.is_some_and(|ticks| ticks < 40), "open motor: {open:?}");
    let full = compared(|a| Vec3::new(a.x, 5.5, a.z));
    assert!(full.is_some_and(|ticks| ticks < 6), "full on: {full:?}");
    let swapped = compared(|a| Vec3::new(a.y, a.x, a.z));
    assert!(swapped.is_some(), "the motors' wires are swapped");
}

/// A sine of an amplitude (A) and a frequency (Hz) on top of motor 2's command, sampled at the
/// start of each tick.
fn oscillating(amplitude_a: f32, hz: f32) -> impl Fn(Vec3) -> Vec3 {
    let ticks = core::cell::Cell::new(0.0_f32);
    move |a: Vec3| {
        ticks.set(ticks.get() + 1.0);
        let cycles = ticks.get() * hz / 1_000.0;
        let swing = amplitude_a * (core::f32::consts::TAU * cycles.fract()).sin();
        Vec3::new(a.x, a.y + swing, a.z)
    }
}

/// Safety: 23.
#[test]
fn oscillating_amplifier_is_a_fault_at_any_frequency() {
    for hz in [333.0, 487.0, 970.0, 1_013.0, 2_477.0] {
        let took = compared(oscillating(2.0, hz));
        assert!(took.is_some_and(|ticks| ticks < 100), "{hz} Hz: {took:?}");
    }
}

/// Safety: 23.
#[test]
fn noisy_monitor_is_no_fault() {
    for hz in [333.0, 487.0, 970.0] {
        assert_eq!(compared(oscillating(0.8, hz)), None, "{hz} Hz");
    }
}

/// Safety: 23.
#[test]
fn winding_temperature_follows_measured_not_commanded_current() {
    // Armed, and with the amplifiers off.
    for mut bench in [Bench::armed(), Bench::new()] {
        let winding = |bench: &Bench| bench.guard.motors().winding_c();
        let start = winding(&bench);
        let swing = oscillating(1.5, 333.0);
        let mut commands = [Vec3::ZERO; 2];
        bench.ticks(2);
        for _ in 0..20_000 {
            let measured = swing(commands[0]) * 1e3;
            bench.sense.measured_ma = Some(measured.to_array().map(|ma| ma as i16));
            commands = [commands[1], bench.tick().currents_a];
            assert_eq!(bench.guard.report().fault, None);
        }
        let warmer = winding(&bench) - start;
        // 1.13 A² · 2.82 Ω · (3.1 K/W · 0.81 + 14 K/W · 0.03).
        assert!((8.0..11.0).contains(&warmer.y), "{warmer}");
        assert!(warmer.x < 1.0 && warmer.z < 1.0, "{warmer}");
    }
}

/// Safety: 23.
#[test]
fn implausible_monitor_currents_keep_motor_temperatures_valid() {
    let mut bench = Bench::new();
    bench.sense.measured_ma = Some([i16::MIN; 3]);
    bench.ticks(200_000);
    assert_eq!(bench.guard.report().fault, Some(Fault::CurrentMismatch));
    let before = bench.guard.motors().temperatures();
    assert!(before.after_reset().is_some(), "{before:?}");
}

/// Safety: 23.
#[test]
fn current_with_the_amplifiers_off_is_a_fault() {
    let mut bench = Bench::new();
    bench.sense.measured_ma = Some([0, 0, -600]);
    let took = ticks_until(&mut bench, Fault::CurrentMismatch, 100);
    assert!(took < 60, "{took}");
    bench.guard.clear();
    bench.tick();
    assert_eq!(bench.guard.report().fault, Some(Fault::CurrentMismatch));
}

/// Safety: 23.
#[test]
fn fastest_force_change_is_no_mismatch_for_late_amplifier() {
    let mut bench = Bench::armed();
    let mut commands = [Vec3::ZERO; 3];
    for ticks in 0..2_000 {
        // 7.65 N back and forth, as fast as the rate limit permits.
        let side = if (ticks / 100) % 2 == 0 { 50.0 } else { -50.0 };
        bench.target_n = Vec3::new(side, 0.0, side);
        let late = commands[0] * 1e3;
        bench.sense.measured_ma = Some(late.to_array().map(|ma| ma as i16));
        commands = [commands[1], commands[2], bench.tick().currents_a];
        assert_eq!(bench.guard.report().fault, None, "tick {ticks}");
    }
    assert!(commands[2].abs().max_element() > 2.0, "{commands:?}");
}

#[test]
fn missing_monitors_disable_current_comparison() {
    let mut bench = Bench::armed();
    bench.sense.measured_ma = None;
    bench.target_n = Vec3::Z * 7.0;
    bench.ticks(1_000);
    assert_eq!(bench.guard.report().fault, None);
}

/// Safety: 23, images.
#[test]
fn monitor_loss_is_a_fault_only_while_armed() {
    let mut bench = Bench::armed();
    (0..300).for_each(|_| _ = bench.tick());
    assert_eq!(bench.guard.report().fault, None, "there never were any");
    bench.sense.measured_ma = Some([0; 3]);
    bench.tick();
    bench.sense.measured_ma = None;
    assert_eq!(ticks_until(&mut bench, Fault::Hardware, 2), 1);
    // With the amplifiers off, monitors may appear and disappear.
    bench.guard.clear();
    for measured in [Some([0; 3]), None, Some([0; 3]), None] {
        bench.sense.measured_ma = measured;
        (0..3).for_each(|_| _ = bench.tick());
    }
    assert_eq!(bench.guard.report().fault, None);
}
