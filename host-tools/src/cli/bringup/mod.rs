//! `hapterra bringup`: the bring-up of a board and its arm, step by step, with a log.

pub(super) mod required;
mod terminal;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::ValueHint;
use hapterra_core::phantom::Calibration;

use super::failure::{Failure, Hint};
use super::terminal::interrupt;
use super::terminal::writer::{notify, print_line};
use crate::bringup::{
    Attendant, BringupError, Halt, Log, LogError, SequenceEnd, Step, VirtualUser, run_sequence,
};
use crate::link::{ControlSession, DeviceAddress, HostClock, LinkError, Native, Transport};
use crate::phantom::Wiring;
use terminal::UserAtTerminal;

/// Time limit for a device's reply.
pub(super) const TIMEOUT: Duration = Duration::from_secs(4);
/// Time limit for a reply of a device in this program.
const VIRTUAL_TIMEOUT: Duration = Duration::from_secs(20);

/// Arguments of `hapterra bringup`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Device: usb, tcp:HOST:PORT, or native (the application in this program, with a
    /// virtual arm and a virtual user who does each step)
    #[arg(long, default_value = "usb")]
    pub device: DeviceAddress,

    /// Keep the log in this file [default: a file for the board in your data folder;
    /// none for native]
    #[arg(short, long, value_name = "FILE.toml", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,

    /// Begin again with this step, as motor-2
    #[arg(long, value_name = "STEP", value_enum)]
    pub again_from: Option<Step>,
}

/// Runs the steps that are not yet in the log.
///
/// # Errors
/// No device; a failed step; a log that cannot be stored.
pub fn run(args: &Args) -> Result<(), Failure> {
    interrupt::listen();
    if args.device == DeviceAddress::Native {
        print_line("a virtual user brings a virtual Phantom up");
        let mut user = VirtualUser::new(Wiring::RIGHT);
        user.print = |line| print_line(line);
        return bring_up(args, &mut user, VIRTUAL_TIMEOUT, |user| {
            Ok(Box::new(user.device(Calibration::PREMIUM_1_5)))
        });
    }
    // The native device needs no address.
    let native = || Native::new(HostClock::default(), None);
    let mut user = UserAtTerminal {
        since: Instant::now(),
        address: args.device.clone(),
    };
    bring_up(args, &mut user, TIMEOUT, |_| {
        Ok(args.device.connect(native)?)
    })
}

/// Runs steps until the log is complete; reconnects to a board that was switched off.
fn bring_up<A: Attendant>(
    args: &Args,
    user: &mut A,
    timeout: Duration,
    connect: impl Fn(&A) -> Result<Box<dyn Transport>, Failure>,
) -> Result<(), Failure> {
    let mut again_from = args.again_from;
    // A virtual arm's log is written on request only.
    let mut unsaved_log = None;
    loop {
        let mut control = ControlSession::open(connect(user)?, timeout)?;
        let path = log_path(args, &control)?;
        let mut log = match (&path, unsaved_log.take()) {
            (Some(path), _) => Log::read(path)?,
            (None, unsaved_log) => unsaved_log.unwrap_or_default(),
        };
        if let Some(step) = again_from.take() {
            log.entries.retain(|entry| entry.step < step);
        }
        let mut save = |log: &Log| path.as_ref().map_or(Ok(()), |path| log.write(path));
        let ended = run_sequence(&mut control, user, &mut log, &mut save);
        if let Some(path) = &path {
            print_line(format!("log            {}", path.display()));
        }
        match (ended, control) {
            // The session ended with the board's power, so there is none to close.
            (Ok(SequenceEnd::BoardPoweredOff), _) => unsaved_log = Some(log),
            (Ok(SequenceEnd::Complete), control) => {
                control.end()?;
                break;
            }
            (Err(error), control) => {
                let ended = control.end();
                if let Err(reported @ (LinkError::NotConfirmed | LinkError::Taken)) = ended {
                    notify(reported);
                }
                return Err(error.into());
            }
        }
    }
    print_line(
        "complete       every step is passed: do \"After the eleven steps\" of \
         docs/how-to/bring-up.md before any larger force",
    );
    Ok(())
}

/// Returns the path of the log.
fn log_path(args: &Args, control: &ControlSession<'_>) -> Result<Option<PathBuf>, Failure> {
    Ok(match (&args.out, &args.device) {
        (Some(path), _) => Some(path.clone()),
        (None, DeviceAddress::Native) => None,
        (None, _) => Some(Log::path_of(control.device())?),
    })
}

impl Hint for BringupError {
    fn hint(&self) -> String {
        match self {
            Self::Found { finding, .. } => {
                format!("{}; then continue with hapterra bringup", finding.remedy())
            }
            Self::Halt(Halt::Link(error)) => error.hint(),
            Self::Halt(_) => "continue with hapterra bringup when you are ready".into(),
            Self::Log(error) => error.hint(),
        }
    }
}

impl Hint for LogError {
    fn hint(&self) -> String {
        match self {
            Self::NoLog { .. } => "name another file with -o, or move this one away".into(),
            _ => "name a file in a folder that you may write to with -o".into(),
        }
    }
}
