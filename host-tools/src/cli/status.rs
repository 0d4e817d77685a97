//! `hapterra status`: how a device is, and what to do about it.

use hapterra_core::guard::Blockers;
use hapterra_core::wire::message::{PROTOCOL, ToDevice};
use hapterra_core::wire::status::{
    BootReport, CalibrationSource, Crash, CrashKind, ResetCause, Status,
};

use super::device::Device;
use super::emulation::explain_link;
use super::{Failure, report};

/// Arguments of `hapterra status`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The device.
    #[command(flatten)]
    pub device: Device,

    /// Clear a latched fault, after showing it
    #[arg(long)]
    pub clear: bool,

    /// Disarm: force goes out within a tenth of a second
    #[arg(long)]
    pub disarm: bool,
}

/// Shows how the device is.
///
/// # Errors
/// No device, or one that does not answer.
pub fn run(args: &Args) -> Result<(), Failure> {
    args.device.talk(|dialogue| {
        if args.disarm {
            let answer = dialogue.request(&ToDevice::Disarm).map_err(explain_link)?;
            answer.map_err(Failure::new)?;
        }
        let status = dialogue.fresh_status().map_err(explain_link)?;
        for (name, value) in lines(&status) {
            println!("{name:<14} {value}");
        }
        if args.clear {
            let answer = dialogue
                .request(&ToDevice::ClearFault)
                .map_err(explain_link)?;
            answer.map_err(Failure::new)?;
            let after = dialogue.fresh_status().map_err(explain_link)?;
            println!(
                "cleared        {}",
                match after.health.report.fault {
                    None => "no fault is latched any more".to_owned(),
                    Some(fault) => format!("but {fault:?} is there again: {}", fault.what_to_do()),
                }
            );
        }
        Ok(())
    })
}

/// What an emulated board says that nobody has given anything to do.
const NO_TICK: &str =
    "no tick has run yet: the time of an emulated board stands still until it has a scene";

type Line = (&'static str, String);

fn lines(status: &Status) -> Vec<Line> {
    let mut lines = vec![
        ("device", report::device(&status.device)),
        (
            "link",
            format!(
                "protocol {} on the device, {PROTOCOL} here; {} frames not understood, {} samples dropped",
                status.device.protocol, status.bad_frames, status.dropped
            ),
        ),
        ("calibration", calibration(status)),
    ];
    lines.extend(boot(&status.boot));
    if status.ticks.run == 0 {
        lines.push(("arm", NO_TICK.into()));
        return lines;
    }
    lines.extend(guard(status));
    lines.extend(measured(status));
    lines
}

fn calibration(status: &Status) -> String {
    let model = status.model.map_or(String::new(), |m| format!("{m:?}, "));
    match status.calibration {
        CalibrationSource::None => "none: type hapterra calibrate".into(),
        CalibrationSource::Stored => format!("{model}stored on the device"),
        CalibrationSource::Session => {
            format!("{model}from a host; gone when the device restarts")
        }
    }
}

fn boot(boot: &BootReport) -> Vec<Line> {
    let cause = match boot.cause {
        ResetCause::Unknown => "for a reason that it does not tell",
        ResetCause::PowerOn => "when power came up",
        ResetCause::Pin => "by the reset button or a debug probe",
        ResetCause::Software => "by its own program",
        ResetCause::Watchdog => "by the watchdog",
        ResetCause::BrownOut => "after its supply was too low for a moment: check it",
    };
    let mut lines = vec![("started", cause.to_owned())];
    if let Some(crash) = &boot.crash {
        lines.push(("crashed before", crashed(crash)));
    }
    lines
}

fn crashed(crash: &Crash) -> String {
    let Crash {
        pc,
        lr,
        status,
        line,
        tick,
        file,
        ..
    } = crash;
    let what = match crash.kind {
        CrashKind::Panic => format!("a panic at line {line} of …{file}"),
        CrashKind::HardFault => format!("a hard fault, status {status:#010x}"),
        CrashKind::UnhandledInterrupt => format!("interrupt {status} without a handler"),
    };
    format!("{what}; pc {pc:#010x}, lr {lr:#010x}, tick {tick}: please report it")
}

fn guard(status: &Status) -> Vec<Line> {
    let report = &status.health.report;
    let on = if report.mode.drives() { "on" } else { "off" };
    let mut lines = vec![("arm", format!("{:?}, amplifiers {on}", report.mode))];
    lines.extend(blockers(report.blockers).map(|text| ("blocked by", text)));
    match report.fault {
        None => lines.push(("fault", "none".into())),
        Some(fault) => {
            let number = fault.number();
            lines.push(("fault", format!("{number} {fault:?}: {}", fault.meaning())));
            lines.push(("what to do", fault.what_to_do().into()));
        }
    }
    let limits = report.limits.meanings();
    lines.extend(limits.map(|(name, meaning)| ("limited", format!("{name}: {meaning}"))));
    lines
}

/// What keeps the arm from being armed, by name, with what to do.
pub(super) fn blockers(blockers: Blockers) -> impl Iterator<Item = String> {
    blockers
        .meanings()
        .map(|(name, meaning)| format!("{name}: {meaning}"))
}

fn measured(status: &Status) -> Vec<Line> {
    let health = &status.health;
    let [a, b, c] = health.sense.counts;
    let zeroed = match health.zero {
        Some([a, b, c]) => format!("zeroed at {a} {b} {c}"),
        None => "not zeroed".to_owned(),
    };
    let degrees = health.angles_rad.to_array().map(f32::to_degrees);
    let held = |is| if is { "held" } else { "not held" };
    let pressed = |is| if is { "pressed" } else { "not pressed" };
    let ticks = &status.ticks;
    let us = |counts: u32| 1e6 * f64::from(counts) / f64::from(status.device.clock_hz.max(1));
    let stack = match status.stack.size {
        0 => "not measured".to_owned(),
        size => format!("{} of {size} bytes used at most", status.stack.high_water),
    };
    vec![
        ("encoders", format!("{a} {b} {c} counts, {zeroed}")),
        (
            "joints",
            format!("{:.2} {:.2} {:.2}°", degrees[0], degrees[1], degrees[2]),
        ),
        (
            "switches",
            format!(
                "dead-man {}, emergency stop {}",
                held(health.sense.dead_man),
                pressed(health.sense.emergency_stop)
            ),
        ),
        ("currents", triple(health.currents_a.to_array(), "A")),
        (
            "motors",
            triple(health.winding_c.to_array(), "°C by the thermal model"),
        ),
        (
            "ticks",
            format!(
                "{} run, {} late; the last cost {:.1} µs, the costliest {:.1} µs",
                ticks.run,
                ticks.late,
                us(ticks.cost),
                us(ticks.worst_cost)
            ),
        ),
        ("stack", stack),
    ]
}

fn triple([a, b, c]: [f32; 3], unit: &str) -> String {
    format!("{a:.2} {b:.2} {c:.2} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::hello;
    use hapterra_core::guard::Fault;
    use hapterra_core::wire::status::{Health, StackFigures, TickFigures};

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
            bad_frames: 0,
            dropped: 0,
        }
    }

    fn text(status: &Status) -> String {
        let lines = lines(status).into_iter();
        lines
            .map(|(name, value)| format!("{name}: {value}\n"))
            .collect()
    }

    #[test]
    fn a_fault_is_shown_with_its_number_meaning_and_what_to_do() {
        let mut status = status();
        status.health.report.fault = Some(Fault::EncoderJump);
        status.health.report.blockers = Blockers::FAULT_LATCHED | Blockers::NOT_ZEROED;
        let text = text(&status);
        for part in [
            "fault: 3 EncoderJump: an encoder moved",
            "zero the arm again",
            "FAULT_LATCHED",
            "NOT_ZEROED",
            "hapterra calibrate",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }

    #[test]
    fn before_the_first_tick_nothing_is_said_of_the_arm() {
        let mut status = status();
        status.ticks.run = 0;
        let text = text(&status);
        assert!(
            text.contains("no tick has run") && !text.contains("motors"),
            "{text}"
        );
    }

    #[test]
    fn a_crash_before_is_shown() {
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
        };
        let text = text(&status);
        assert!(
            text.contains("by the watchdog") && text.contains("line 77 of …src/tick.rs"),
            "{text}"
        );
    }
}
