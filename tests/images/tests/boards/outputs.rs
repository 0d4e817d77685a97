//! Outputs of the boards' own images to the amplifiers, and the amplifiers' feedback.

use hapterra_core::guard::{Blockers, Fault};
use hapterra_core::wire::request::Request;
use hapterra_image_tests::bus::Effect;
use hapterra_image_tests::chip::Commands;
use hapterra_image_tests::device::{Device, Plane, machines, on_each_board};
use hapterra_image_tests::machine::{Machine, Stop};
use heightfield::Raster;

const HOME_MM: [f64; 3] = [100.0, 100.0, 30.0];

fn ground() -> Raster {
    Raster::from_fn(201, 201, |_, _| 20.0).expect("raster")
}

fn plane() -> Plane {
    Plane::level(HOME_MM, 20.0)
}

/// Changes the machine before its start, then arms it in its home pose.
fn on_each_armed(before: impl Fn(&mut Machine), mut then: impl FnMut(&mut Device<'_>)) {
    on_each_board(&ground(), HOME_MM, |mut machine, terrain, scene| {
        before(&mut machine);
        let mut device = Device::arm(machine, terrain, scene);
        device.run_ms(60);
        let mut machine = device.machine.borrow_mut();
        assert_eq!(machine.run_ticks(1), Stop::Requested);
        let _ = machine.take_effects();
        drop(machine);
        then(&mut device);
    });
}

fn has_converter(machine: &Machine) -> bool {
    matches!(machine.chip.commands, Commands::Serial { .. })
}

/// Returns the whole ticks until the amplifiers are off, and the fault reported to the host.
fn ends(device: &mut Device<'_>, at_most: usize) -> (usize, Option<Fault>) {
    let mut machine = device.machine.borrow_mut();
    let board = machine.chip.board;
    let took = (1..=at_most).find(|_| {
        assert_eq!(machine.run_ticks(1), Stop::Requested);
        !machine.is_enabled()
    });
    drop(machine);
    device.run_ms(40);
    let reported = device.latest.and_then(|sample| sample.fault);
    let took = took.unwrap_or_else(|| panic!("{board}: on after {at_most} ticks, {reported:?}"));
    (took, reported)
}

/// Safety: 20, images.
#[test]
fn converter_frames_keep_the_data_sheets_minimum_gap() {
    on_each_armed(
        |_| (),
        |device| {
            if !has_converter(&device.machine.borrow()) {
                return;
            }
            device.wait_for_full_force();
            device.move_to(plane().counts_at([100.0, 100.0], 3.0));
            device.run_ms(40);
            assert!(device.commands().iter().any(|code| *code != 0));
            // Time advances with each instruction, because the gap between two frames matters.
            let mut machine = device.machine.borrow_mut();
            machine.slice = 1;
            // To the end of a tick, so that the next three are whole.
            assert_eq!(machine.run_ticks(1), Stop::Requested);
            let _ = machine.take_effects();
            assert_eq!(machine.run_ticks(3), Stop::Requested);
            let sent = machine.take_effects().len();
            assert!(sent >= 9, "{sent} commands");
            let bus = machine.bus();
            assert_eq!(bus.converter.lost, 0);
            // The measured gaps are at least the data sheet's, and at most a frame's length above
            // it.
            let (after_write_ns, after_read_ns) = bus.converter.min_high_ns;
            assert!((100..1_000).contains(&after_write_ns), "{after_write_ns}");
            assert!((200..1_000).contains(&after_read_ns), "{after_read_ns}");
        },
    );
}

/// Safety: 20, images.
#[test]
fn converter_without_read_back_keeps_the_amplifiers_off() {
    on_each_board(&ground(), HOME_MM, |machine, terrain, scene| {
        if !has_converter(&machine) {
            return;
        }
        let mut device = Device::open(machine, terrain, scene);
        let blocked = |device: &mut Device<'_>| {
            device.run_ms(150);
            // The guard's own report may have been sent before the session opened.
            let report = device.query_status().health.report;
            report.blockers.contains(Blockers::OUTPUTS_NOT_AS_SET)
        };
        assert!(!blocked(&mut device));
        device.machine.borrow().bus().converter.is_silent = true;
        assert!(blocked(&mut device));
        device.machine.borrow().bus().converter.is_silent = false;
        assert!(!blocked(&mut device), "set up anew");
        // It lost its supply for a moment.
        device.machine.borrow().bus().converter.clear();
        assert!(!blocked(&mut device), "set up anew");
        assert_eq!(device.commands(), [0; 3]);
    });
}

/// Safety: 20, response times, images.
#[test]
fn cleared_converter_trips_within_eight_ticks() {
    on_each_armed(
        |_| (),
        |device| {
            if !has_converter(&device.machine.borrow()) {
                return;
            }
            device.machine.borrow().bus().converter.clear();
            let (took, reported) = ends(device, 9);
            assert!(took <= 8, "{took}");
            assert_eq!(reported, Some(Fault::OutputsNotAsSet));
        },
    );
}

/// Safety: 20, response times.
#[test]
fn broken_read_back_wire_trips_in_two_ticks() {
    on_each_armed(
        |_| (),
        |device| {
            if !has_converter(&device.machine.borrow()) {
                return;
            }
            device.machine.borrow().bus().converter.is_silent = true;
            assert_eq!(ends(device, 9), (2, Some(Fault::OutputsNotAsSet)));
        },
    );
}

/// Safety: 22, response times.
#[test]
fn unready_amplifier_trips_in_three_ticks() {
    for axis in 0..3 {
        on_each_armed(
            |_| (),
            |device| {
                let pin = device.machine.borrow().chip.ready[axis];
                device.machine.borrow_mut().set_input(pin, true);
                assert_eq!(ends(device, 9), (3, Some(Fault::AmplifierNotReady)));
                device.run_ms(150);
                let report = device.guard.expect("reported");
                assert!(report.blockers.contains(Blockers::AMPLIFIER_NOT_READY));
            },
        );
    }
}

/// Safety: 23, response times, images.
#[test]
fn uncommanded_current_trips_a_fault_if_monitors_are_fitted() {
    for axis in 0..3 {
        let mut wrong = [0.0; 3];
        wrong[axis] = -2.0;
        let fit = |machine: &mut Machine| {
            let pin = machine.chip.monitors_fitted;
            machine.set_input(pin, false);
        };
        on_each_armed(fit, |device| {
            device.machine.borrow().bus().set_monitors(wrong);
            let (took, reported) = ends(device, 40);
            assert!((4..=15).contains(&took), "{took}");
            assert_eq!(reported, Some(Fault::CurrentMismatch));
        });
    }
}

#[test]
fn monitor_pins_are_ignored_without_monitors() {
    on_each_armed(
        |machine| machine.bus().set_monitors([5.0, -5.0, 3.0]),
        |device| {
            device.run_ms(300);
            assert!(device.machine.borrow().is_enabled(), "{:?}", device.guard);
            let status = device.query_status();
            assert_eq!(status.health.sense.measured_ma, None);
        },
    );
}

/// Safety: images.
#[test]
fn measured_currents_are_reported_in_milliamperes() {
    for machine in machines() {
        let pin = machine.chip.monitors_fitted;
        let terrain = ground();
        let board = machine.chip.board;
        on_each_board(&terrain, HOME_MM, |mut machine, terrain, scene| {
            if machine.chip.board != board {
                return;
            }
            machine.set_input(pin, false);
            machine.bus().set_monitors([0.1, -0.2, 0.4]);
            let mut device = Device::open(machine, terrain, scene);
            let measured = device.query_status().health.sense.measured_ma;
            let measured = measured.expect("there are monitors");
            for (got, expected) in measured.into_iter().zip([100, -200, 400]) {
                assert!((got - expected).abs() <= 3, "{board}: {measured:?}");
            }
        });
    }
}

/// Returns the codes that full scale may have within the range of a converter or an amplifier.
fn range(machine: &Machine) -> std::ops::RangeInclusive<i32> {
    match machine.chip.commands {
        // 0.2 V and 3.1 V of 3.3 V.
        Commands::Converters(_) => 249..=3847,
        Commands::DutyCycles(_, largest) => {
            let period = machine.bus().read(largest) as i32 + 1;
            period * 15 / 100..=period * 85 / 100
        }
        Commands::Serial { .. } => -32_768..=32_767,
    }
}

/// Safety: 21, images.
#[test]
fn max_currents_stay_within_the_specified_code_range() {
    on_each_armed(
        |_| (),
        |device| {
            device.wait_for_full_force();
            device.move_to(plane().counts_at([100.0, 100.0], 30.0));
            device.run_ms(40);
            // More than warm motors may have: the ends of the range themselves.
            device.request(Request::Disarm);
            device.run_ms(300);
            device.request(Request::HoldOutputs(Some([1.0, -1.0, 1.0])));
            device.run_ms(20);
            let mut machine = device.machine.borrow_mut();
            let (range, idle) = (range(&machine), machine.bus().code(0.0));
            let full = (machine.bus().code(5.5) - idle).abs();
            let mut largest = 0.0f64;
            for effect in machine.take_effects() {
                if let Effect::Command(axis, code) = effect {
                    assert!(range.contains(&code), "axis {axis}: {code} of {range:?}");
                    largest = largest.max((f64::from(code) - idle).abs());
                }
            }
            assert!(largest > 0.99 * full, "{largest} of {full}");
        },
    );
}

/// Safety: images.
#[test]
fn duty_cycle_frequency_suits_an_escon() {
    for mut machine in machines() {
        let Commands::DutyCycles(_, largest) = machine.chip.commands else {
            continue;
        };
        assert_eq!(machine.run_ms(10), Stop::Time);
        let mut bus = machine.bus();
        let counts = u64::from(bus.read(largest)) + 1;
        let divider = u64::from(bus.read(largest - 4)) + 1;
        assert_eq!(machine.chip.timer_hz, 2_000 * counts * divider);
    }
}

/// Control registers of the converters on the chip: DAC1's with its channels 1 and 2, and
/// DAC2's with its channel 1.
const CONVERTERS: [(u32, u32); 3] = [
    (0x5000_0800, 1 << 0),
    (0x5000_0800, 1 << 16),
    (0x5000_0C00, 1 << 0),
];

/// Safety: images.
#[test]
fn on_chip_converters_are_enabled_only_at_zero_current() {
    for mut machine in machines() {
        if !matches!(machine.chip.commands, Commands::Converters(_)) {
            continue;
        }
        machine.slice = 1;
        let mut were_on = [false; 3];
        let all_on = machine.run_until(20, |m| {
            let mut bus = m.bus();
            let commands = bus.commands();
            for (axis, (control, enable)) in CONVERTERS.into_iter().enumerate() {
                let is_on = bus.read(control) & enable != 0;
                assert!(
                    !is_on || commands[axis] == 2048,
                    "axis {axis}: {commands:?}"
                );
                were_on[axis] |= is_on;
            }
            were_on == [true; 3]
        });
        assert_eq!(all_on, Stop::Requested);
    }
}

#[test]
fn on_chip_converters_are_buffered() {
    for mut machine in machines() {
        if !matches!(machine.chip.commands, Commands::Converters(_)) {
            continue;
        }
        assert_eq!(machine.run_ms(10), Stop::Time);
        for mode in [0x5000_083C, 0x5000_0C3C] {
            // DAC_MCR: MODE1, MODE2: to the pin, with the buffer.
            assert_eq!(machine.bus().read(mode) & 0x0007_0007, 0);
        }
    }
}
