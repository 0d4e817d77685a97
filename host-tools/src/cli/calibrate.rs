//! `hapterra calibrate`: the walk through a calibration, and records in files.

mod set;
mod terminal;

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;
use hapterra_core::phantom::{Calibration, Model, RECORD_BYTES};
use hapterra_core::wire::message::ToDevice;
use std::io::Write as _;

use super::Failure;
use super::device::{Device, Which};
use super::emulation::explain_link;
use crate::calibrate::{Attendant, FitError, Plan, Review, VirtualUser, WalkError, walk};
use crate::link::{Dialogue, HostClock, LinkError, Native, Target};
use crate::output::Output;
use set::Setting;
use terminal::Terminal;

/// How long a device in this program may take to answer.
const PATIENCE: Duration = Duration::from_secs(20);

/// Arguments of `hapterra calibrate`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The device.
    #[command(flatten)]
    pub device: Device,

    /// Begin with this model's preset [default: what the device holds, else premium-1.5]
    #[arg(long, value_enum)]
    pub model: Option<Preset>,

    /// Begin with the record in this file
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "model")]
    pub from: Option<PathBuf>,

    /// Change a number of the record before the walk, as --set ratio-1=13.2
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<Setting>,

    /// Do not measure anything: take the record as it is
    #[arg(long)]
    pub no_walk: bool,

    /// Do not measure the ratios
    #[arg(long)]
    pub skip_ratios: bool,

    /// Do not measure gravity
    #[arg(long)]
    pub skip_gravity: bool,

    /// Write the record to this file, too
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub output: Option<PathBuf>,

    /// Do not store the record on the device
    #[arg(long)]
    pub no_store: bool,

    /// Agree to the record without being asked
    #[arg(long)]
    pub yes: bool,
}

/// Models with a preset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Preset {
    /// Phantom Premium 1.0
    #[value(name = "premium-1.0")]
    Premium10,
    /// Phantom Premium 1.5
    #[value(name = "premium-1.5")]
    Premium15,
    /// Phantom Premium 3.0
    #[value(name = "premium-3.0")]
    Premium30,
    /// Phantom Omni, also called Touch
    Omni,
}

impl Preset {
    const fn model(self) -> Model {
        match self {
            Self::Premium10 => Model::Premium10,
            Self::Premium15 => Model::Premium15,
            Self::Premium30 => Model::Premium30,
            Self::Omni => Model::Omni,
        }
    }
}

/// Calibrates.
///
/// # Errors
/// No device, measurements that do not fit together, a record that the device
/// refuses.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.device.device != Which::There(Target::Native) {
        return args
            .device
            .talk(|dialogue| through(args, dialogue, &mut Terminal::new(args.yes)));
    }
    // In memory: a virtual user shows how it goes.
    let mut user = VirtualUser::with_a_stylus();
    let counts = user.counts();
    let device = Native::new(HostClock::default(), None)
        .meddled_with(Box::new(move |_, sense, _| sense.counts = counts.get()))
        .restless();
    if !args.no_walk {
        println!("a virtual user calibrates a virtual Phantom that differs from its preset");
    }
    let mut dialogue = Dialogue::open(Box::new(device), PATIENCE).map_err(explain_link)?;
    through(args, &mut dialogue, &mut terminal::Watched(&mut user))
}

fn through(
    args: &Args,
    dialogue: &mut Dialogue<'_>,
    attendant: &mut dyn Attendant,
) -> Result<(), Failure> {
    let (begin, whence) = begin(args, dialogue)?;
    println!("begins with    {whence}");
    let mode = dialogue.status().map_err(explain_link)?.health.report.mode;
    if mode.drives() {
        return Err(
            Failure::new("the amplifiers are on").hint("disarm first: hapterra status --disarm")
        );
    }
    let (record, zero) = match args.no_walk {
        true => (begin, None),
        false => {
            let review = measured(args, &begin, dialogue, attendant)?;
            (review.after, Some(review.zero))
        }
    };
    if let Some(path) = &args.output {
        write(path, &record)?;
        println!("written        {}", path.display());
    }
    hand_over(args, dialogue, record)?;
    if let Some(counts) = zero {
        let zeroed = dialogue.request(&ToDevice::Zero { counts });
        zeroed.map_err(explain_link)?.map_err(Failure::new)?;
        println!("zeroed         the arm, until the device is switched off");
    }
    Ok(())
}

/// The record to begin with, and where it is from.
fn begin(args: &Args, dialogue: &mut Dialogue<'_>) -> Result<(Calibration, String), Failure> {
    let held = dialogue.calibration().map_err(explain_link)?;
    let (mut record, whence) = match (&args.from, args.model, held) {
        (Some(path), _, _) => (read(path)?, path.display().to_string()),
        (None, Some(preset), _) => (
            preset.model().preset(),
            format!("the preset of {:?}", preset.model()),
        ),
        (None, None, Some(held)) => (held, format!("what the device holds ({:?})", held.model)),
        (None, None, None) => (
            Model::Premium15.preset(),
            "the preset of Premium15 (the device holds none; --model chooses another)".into(),
        ),
    };
    for setting in &args.set {
        setting.apply(&mut record);
    }
    record.validate().map_err(|bad| {
        Failure::new(format!("the record cannot be used: {bad}"))
            .hint("change it with --set NAME=VALUE")
    })?;
    Ok((record, whence))
}

fn measured(
    args: &Args,
    begin: &Calibration,
    dialogue: &mut Dialogue<'_>,
    attendant: &mut dyn Attendant,
) -> Result<Review, Failure> {
    let plan = Plan {
        ratios: !args.skip_ratios,
        gravity: !args.skip_gravity,
    };
    let mut counts = || Ok(dialogue.fresh_status()?.health.sense.counts);
    walk(begin, plan, attendant, &mut counts).map_err(|error: WalkError<LinkError>| match error {
        WalkError::Counts(error) => explain_link(error),
        WalkError::Fit(fit) => {
            let hint = match fit {
                FitError::NotMoved { .. } => {
                    "move the tip by 80 mm or so in each direction; if you did, check that joint's encoder cable"
                }
                FitError::NoRatios { .. } => {
                    "measure again, along the ruler and in the direction asked for; check the link lengths with --set l1-mm=… and --set l2-mm=…"
                }
                FitError::NoWeight { .. } => {
                    "hold the arm in more different poses, or leave gravity out with --skip-gravity"
                }
            };
            Failure::new(fit).hint(hint)
        }
        other => Failure::new(other).hint("start again when you are ready: hapterra calibrate"),
    })
}

fn hand_over(
    args: &Args,
    dialogue: &mut Dialogue<'_>,
    calibration: Calibration,
) -> Result<(), Failure> {
    let answer = match args.no_store {
        true => dialogue.request(&ToDevice::SetCalibration {
            calibration,
            store: false,
        }),
        false => dialogue.store(calibration),
    };
    answer.map_err(explain_link)?.map_err(|refused| {
        Failure::new(refused)
            .hint("see hapterra status; the record can be kept in a file with --output FILE")
    })?;
    println!(
        "in force       on the device, {}",
        match args.no_store {
            true => "until it is switched off",
            false => "and stored there",
        }
    );
    Ok(())
}

fn read(path: &Path) -> Result<Calibration, Failure> {
    let bytes = std::fs::read(path).map_err(|error| {
        Failure::new(format!("cannot read {}: {error}", path.display()))
            .hint("check the path given with --from")
    })?;
    Calibration::decode(&bytes).map_err(|bad| {
        Failure::new(format!("{}: {bad}", path.display()))
            .hint("name a file that hapterra calibrate --output has written")
    })
}

fn write(path: &Path, record: &Calibration) -> Result<(), Failure> {
    let hint = "name another file with --output";
    let mut buffer = [0; RECORD_BYTES];
    let mut output = Output::create(path).map_err(|error| Failure::new(error).hint(hint))?;
    let written = output.write_all(record.encode(&mut buffer));
    written.map_err(|error| Failure::new(error).hint(hint))?;
    output
        .finish()
        .map_err(|error| Failure::new(error).hint(hint))
}
