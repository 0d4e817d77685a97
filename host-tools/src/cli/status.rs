//! `hapterra status`: the state of a device, and remedies.

use hapterra_core::wire::hello::PROTOCOL;
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::{
    BootReport, CalibrationSource, Crash, CrashKind, ResetCause, Status, UsbClock,
};

use super::failure::Failure;
use super::options::device::{Device, DeviceChoice};
use super::report::put;
use super::session_summary;
use super::terminal::writer::{print_line, show};
use crate::calibrate::file::model_name;
use crate::link::{DeviceAddress, EMULATED};
use heightfield::printable_text::printable;

/// Arguments of `hapterra status`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Clear a latched fault, after showing it
    #[arg(long)]
    pub clear: bool,

    /// Disarm: the force falls to zero within a tenth of a second
    #[arg(long)]
    pub disarm: bool,

    /// The device.
    #[command(flatten)]
    pub device: Device,
}

/// Shows the state of the device.
///
/// # Errors
/// No device, no reply, or an output that cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    if !args.disarm && !args.clear {
        let status = args
            .device
            .with_read_only_session(|control| Ok(control.fresh_status()?))?;
        put(&text(&status))?;
        if args.device.device == DeviceChoice::Connected(DeviceAddress::Native) {
            print_line(
                "note           each command starts a new native device, without a calibrated zero pose",
            );
        }
        return Ok(());
    }
    args.device.with_session(|control| {
        if args.disarm {
            control.request(&Request::Disarm)?.map_err(Failure::new)?;
        }
        let status = control.fresh_status()?;
        show(text(&status));
        if args.clear {
            let fault = status.health.report.fault;
            let answer = control.request(&Request::ClearFault { fault })?;
            answer.map_err(Failure::new)?;
            let cleared = match control.fresh_status()?.health.report.fault {
                None => "no fault is latched any more".to_owned(),
                Some(fault) => format!("but {fault:?} is there again: {}", fault.remedy()),
            };
            print_line(format!("cleared        {cleared}"));
        }
        Ok(())
    })
}

/// Line for an emulated board without a host.
const NO_TICK: &str = "arm            no tick has run yet: the time of an emulated board stands still until it has a scene\n";

/// Returns the printed status: a name and a text on each line.
fn text(status: &Status) -> String {
    let device = session_summary::device(&status.device);
    let arm = match status.ticks.run {
        0 => NO_TICK.to_owned(),
        _ => guard(status) + &measured(status),
    };
    format!(
        "device         {device}\n\
         link           protocol {} on the device, {PROTOCOL} here; {} frames not understood, {} of other sessions, {} samples dropped\n\
         calibration    {}\n\
         {}{}{arm}",
        status.device.protocol,
        status.bad_frames,
        status.foreign_frames,
        status.dropped,
        calibration(status),
        boot(&status.boot),
        usb_clock(status.usb_clock),
    )
}

fn calibration(status: &Status) -> String {
    let model = status
        .model
        .map_or(String::new(), |model| format!("{}, ", model_name(model)));
    match status.calibration {
        CalibrationSource::None => "none: type hapterra calibrate".into(),
        CalibrationSource::Refused(bad) => {
            format!("none: the stored record is refused ({bad}); type hapterra calibrate")
        }
        CalibrationSource::Stored if status.device.board == EMULATED => {
            format!("{model}built into the emulated board, which has no memory to store another in")
        }
        CalibrationSource::Stored => format!("{model}stored on the device"),
        CalibrationSource::Session => {
            format!("{model}from a host, until the device restarts")
        }
    }
}

fn boot(boot: &BootReport) -> String {
    let cause = match boot.cause {
        ResetCause::Unknown => "for an unknown reason",
        ResetCause::PowerOn => "at power-up",
        ResetCause::Pin => "by the reset button or a debug probe",
        ResetCause::Software => "by its own program",
        ResetCause::Watchdog => "by the watchdog",
        ResetCause::BrownOut => "after its supply was too low for a moment: check it",
    };
    let crash = boot.crash.as_ref().map_or(String::new(), crashed);
    let brown_out = if boot.is_brown_out_level_low() {
        format!(
            "supply guard   the chip runs down to {} mV: set its brown-out level (docs/reference/hardware.md, The supply)\n",
            boot.resets_below_mv
        )
    } else {
        String::new()
    };
    format!("started        {cause}\n{crash}{brown_out}")
}

/// Returns a line about the USB oscillator, if the board has one.
const fn usb_clock(clock: UsbClock) -> &'static str {
    match clock {
        UsbClock::Unknown => "",
        UsbClock::Locked => "USB clock      follows this computer\n",
        UsbClock::Unlocked => {
            "USB clock      does not follow this computer: try another port or hub\n"
        }
    }
}

fn crashed(crash: &Crash) -> String {
    let (pc, lr, status, tick) = (crash.pc, crash.lr, crash.status, crash.tick);
    let what = match crash.kind {
        CrashKind::Panic => {
            format!(
                "a panic at line {} of …{}",
                crash.line,
                printable(&crash.file)
            )
        }
        CrashKind::HardFault => format!("a hard fault, status {status:#010x}"),
        CrashKind::UnhandledInterrupt => format!("interrupt {status} without a handler"),
        CrashKind::StackOverflow => format!("a stack overflow, status {status:#010x}"),
        CrashKind::SupplyLow => {
            return format!("ended before   its supply fell too low at tick {tick}: check it\n");
        }
    };
    format!("crashed before {what}; pc {pc:#010x}, lr {lr:#010x}, tick {tick}: please report it\n")
}

/// Describes the guard: its state, blockers, fault and limits.
fn guard(status: &Status) -> String {
    let report = &status.health.report;
    let on = if report.mode.is_driving() {
        "on"
    } else {
        "off"
    };
    let mut text = format!("arm            {:?}, amplifiers {on}\n", report.mode);
    for (name, meaning) in report.blockers.meanings() {
        text += &format!("blocked by     {name}: {meaning}\n");
    }
    text += &match report.fault {
        None => "fault          none\n".into(),
        Some(fault) => format!(
            "fault          {} {fault:?}: {}\nwhat to do     {}\n",
            fault.number(),
            fault.meaning(),
            fault.remedy()
        ),
    };
    for (name, meaning) in report.limits.meanings() {
        text += &format!("limited        {name}: {meaning}\n");
    }
    text
}

/// Describes the readings of encoders, switches and motors, and the loop's clock.
fn measured(status: &Status) -> String {
    let (health, ticks) = (&status.health, &status.ticks);
    let [a, b, c] = health.sense.counts;
    let zeroed = match health.zero {
        Some([a, b, c]) => format!("zeroed at {a} {b} {c}"),
        None => "not zeroed".to_owned(),
    };
    let three = |[a, b, c]: [f32; 3]| format!("{a:.2} {b:.2} {c:.2}");
    let not = |is| if is { "" } else { "not " };
    let us = |counts: u32| 1e6 * f64::from(counts) / f64::from(status.device.clock_hz.max(1));
    let flowing = match health.sense.measured_ma {
        Some(ma) => format!(", {} A measured", three(ma.map(|ma| f32::from(ma) * 1e-3))),
        None => String::new(),
    };
    let stack = match status.stack.size {
        0 => "not measured".to_owned(),
        size => format!("{} of {size} bytes used at most", status.stack.high_water),
    };
    format!(
        "encoders       {a} {b} {c} counts, {zeroed}\n\
         joints         {}°\n\
         switches       dead-man {}held, emergency stop {}pressed, clutch {}held\n\
         amplifiers     {}ready, outputs {}as set\n\
         currents       {} A{flowing}\n\
         motors         {} °C by the thermal model\n\
         energy         {:.3} mJ created by sampling and not dissipated yet\n\
         ticks          {} run, {} late; the last cost {:.1} µs, the costliest {:.1} µs\n\
         stack          {stack}\n",
        three(health.angles_rad.to_array().map(f32::to_degrees)),
        not(health.sense.dead_man),
        not(health.sense.emergency_stop),
        not(health.sense.clutch),
        not(!health.sense.amplifier_not_ready),
        not(!health.sense.outputs_not_as_set),
        three(health.currents_a.to_array()),
        three(health.winding_c.to_array()),
        health.created_mj,
        ticks.run,
        ticks.late,
        us(ticks.cost),
        us(ticks.worst_cost),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::hello;
    use hapterra_core::guard::{Blockers, Fault};
    use hapterra_core::scene::Health;
    use hapterra_core::wire::status::{StackFigures, TickFigures};

    fn status() -> Status {
        Status {
            device: hello(),
            boot: BootReport::default(),
            calibration: CalibrationSource::None,
            model: None,
            health: Health::default(),
            ticks: TickFigures {
                run: 1,
                ..TickFigures::default()
            },
            stack: StackFigures::default(),
            usb_clock: UsbClock::Locked,
            bad_frames: 0,
            foreign_frames: 0,
            dropped: 0,
        }
    }

    #[test]
    fn fault_is_shown_with_number_meaning_and_remedy() {
        let mut status = status();
        status.health.report.fault = Some(Fault::EncoderJump);
        status.health.report.blockers = Blockers::FAULT_LATCHED | Blockers::NOT_ZEROED;
        let text = text(&status);
        for part in [
            "fault          3 EncoderJump: an encoder moved",
            "zero the arm again",
            "FAULT_LATCHED",
            "NOT_ZEROED",
            "hapterra calibrate",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }

    /// The emulated board cannot store a record, which `hapterra calibrate` also reports.
    #[test]
    fn calibration_source_is_correct_for_the_emulated_board() {
        let mut status = status();
        status.calibration = CalibrationSource::Stored;
        assert!(text(&status).contains("stored on the device"));
        status.device.board = EMULATED.try_into().expect("a short name");
        let text = text(&status);
        assert!(text.contains("no memory to store another in"), "{text}");
        assert!(!text.contains("stored on the device"), "{text}");
    }

    #[test]
    fn status_omits_the_arm_before_the_first_tick() {
        let mut status = status();
        status.ticks.run = 0;
        let text = text(&status);
        assert!(
            text.contains("no tick has run") && !text.contains("motors"),
            "{text}"
        );
    }

    #[test]
    fn hostile_device_text_has_no_control_characters() {
        let mut status = status();
        status.device.board = "\x1b[2J\x1b[H".try_into().expect("fits");
        status.device.version = "1\r\nfault none".try_into().expect("fits");
        status.boot.crash = Some(Crash {
            kind: CrashKind::Panic,
            pc: 0,
            lr: 0,
            status: 0,
            line: 1,
            tick: 1,
            file: "\u{9b}31m\x07\u{202e}".try_into().expect("fits"),
        });
        let text = text(&status);
        let controls = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(!text.contains(controls), "{text:?}");
        assert!(
            text.contains("\\u{1b}[2J\\u{1b}[H 1\\r\\nfault none"),
            "{text}"
        );
    }

    #[test]
    fn previous_crash_is_shown() {
        let mut status = status();
        status.boot = BootReport {
            cause: ResetCause::Watchdog,
            crash: Some(Crash {
                kind: CrashKind::Panic,
                pc: 0x0800_1234,
                lr: 0,
                status: 0,
                line: 77,
                tick: 5,
                file: "src/tick.rs".try_into().expect("fits"),
            }),
            resets_below_mv: 1_700,
        };
        let text = text(&status);
        assert!(
            text.contains("by the watchdog") && text.contains("line 77 of …src/tick.rs"),
            "{text}"
        );
        assert!(text.contains("runs down to 1700 mV"), "{text}");
    }
}
