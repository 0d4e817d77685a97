//! `hapterra calibrate`: the steps of a calibration, and records in files.

mod measure;
mod questions;
mod set;

use std::path::PathBuf;
use std::time::Duration;

use clap::ValueHint;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use hapterra_core::phantom::{Calibration, Model};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::PRESS_TIMEOUT_MS;

use super::failure::{Failure, OrHint};
use super::options::device::{Device, DeviceChoice};
use super::report::put;
use super::terminal::partial_files;
use super::terminal::writer::print_line;
use crate::calibrate::{Attendant, Plan, VirtualUser, file, run_procedure};
use crate::link::{ControlSession, DeviceAddress, HostClock, Native};
use crate::output::check_distinct;
use measure::Measure;
use questions::UserAtTerminal;
use set::Setting;

/// Hint for a record that cannot be written.
const OTHER_FILE: &str = "name another file with -o";
/// Time limit for a reply of a device in this program.
const TIMEOUT: Duration = Duration::from_secs(20);

/// Arguments of `hapterra calibrate`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The device.
    #[command(flatten)]
    pub device: Device,

    /// Begin with this model's preset [default: what the device holds, else premium-1.5]
    #[arg(long, value_name = "MODEL", value_parser = models())]
    pub model: Option<Model>,

    /// Only print the record in FILE as text [default: the record on the device]
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, num_args = 0..=1,
          conflicts_with = "out")]
    pub show: Option<Option<PathBuf>>,

    /// Begin with the record in this file (TOML, or a binary one of an earlier version)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "model")]
    pub from: Option<PathBuf>,

    /// Change a number of the record before measuring, such as --set ratio-1=13.2
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<Setting>,

    /// Measure all, none, or some of zero,ratios,gravity
    ///
    /// The zero pose is the first step of all measuring. A preset's guessed ratios (Premium 1.0, 3.0,
    /// Omni) have to be measured, or taken as they are with guessed-ratios in the list.
    #[arg(long, value_name = "LIST", default_value = "all")]
    pub measure: Measure,

    /// Also write the record to this file, as TOML
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,

    /// Do not store the record on the device
    #[arg(long)]
    pub no_store: bool,

    /// Agree to the record without being asked
    #[arg(long)]
    pub yes: bool,
}

/// Models with a preset, and their descriptions.
const MODELS: [(Model, &str); 4] = [
    (Model::Premium10, "Phantom Premium 1.0"),
    (Model::Premium15, "Phantom Premium 1.5"),
    (Model::Premium30, "Phantom Premium 3.0"),
    (Model::Omni, "Phantom Omni, also called Touch"),
];

fn models() -> impl TypedValueParser<Value = Model> {
    let value = |(model, what)| PossibleValue::new(file::model_name(model)).help(what);
    PossibleValuesParser::new(MODELS.map(value)).try_map(|name| {
        let mut models = MODELS.iter().map(|(model, _)| *model);
        let model = models.find(|model| file::model_name(*model) == name);
        model.ok_or("no such model")
    })
}

/// Runs a calibration.
///
/// # Errors
/// No device, inconsistent measurements, or a record that the device refuses.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (outputs, inputs) = (
        Vec::from_iter(args.out.as_deref()),
        Vec::from_iter(args.from.as_deref()),
    );
    check_distinct(&outputs, &inputs).or_hint(OTHER_FILE)?;
    match &args.show {
        Some(Some(path)) => return put(&file::to_toml(&file::read(path)?)),
        // A read-only query leaves the arm to its host.
        Some(None) => {
            return put(&file::to_toml(
                &args.device.with_read_only_session(device_record)?,
            ));
        }
        None => {}
    }
    partial_files::report(args.out.as_deref());
    if args.device.device != DeviceChoice::Connected(DeviceAddress::Native) {
        let mut user = UserAtTerminal::new(args.yes);
        return args
            .device
            .with_session(|control| calibrate(args, control, &mut user));
    }
    // A virtual user demonstrates the steps on an in-memory device.
    let mut user = VirtualUser::with_stylus();
    user.print = |line| print_line(line);
    let device = Native::new(HostClock::default(), None)
        .with_fault_injector(user.hands())
        .free_running();
    if args.measure.zero {
        print_line("a virtual user calibrates a virtual Phantom that differs from its preset");
    }
    let mut control = ControlSession::open(Box::new(device), TIMEOUT)?;
    calibrate(args, &mut control, &mut user)
}

/// Returns the device's record.
fn device_record(control: &mut ControlSession<'_>) -> Result<Calibration, Failure> {
    let held = control
        .calibration()?
        .ok_or("the device has no calibration");
    held.or_hint("see hapterra status")
}

fn calibrate(
    args: &Args,
    control: &mut ControlSession<'_>,
    attendant: &mut dyn Attendant,
) -> Result<(), Failure> {
    let (begin, source) = initial_record(args, control)?;
    print_line(format!("begins with    {source}"));
    let measure = args.measure;
    if !measure.ratios && !measure.takes_guessed_ratios && begin.has_guessed_ratios() {
        return Err("the cable ratios of this model are a guess, and were never measured").or_hint(
            "measure them as well, or accept guesses: --measure zero,gravity,guessed-ratios",
        );
    }
    if control.status()?.health.report.mode.is_driving() {
        return Err("the amplifiers are on").or_hint("disarm first: hapterra status --disarm");
    }
    let (mut record, mut zero) = (begin, None);
    if measure.zero {
        let plan = Plan {
            ratios: measure.ratios,
            gravity: measure.gravity,
        };
        let mut counts = || Ok(control.fresh_status()?.health.sense.counts);
        let review = run_procedure(&begin, plan, attendant, &mut counts)?;
        (record, zero) = (review.after, Some(review.zero));
    }
    if let Some(path) = &args.out {
        file::write(path, &record).or_hint(OTHER_FILE)?;
        print_line(format!("written        {}", path.display()));
    }
    activate(args, control, record)?;
    if let Some(counts) = zero {
        let zeroed = control.request(&Request::Zero { counts })?;
        zeroed.map_err(Failure::new)?;
        print_line("zeroed         the arm, until the device is switched off");
    }
    Ok(())
}

/// Returns the initial record and its source.
fn initial_record(
    args: &Args,
    control: &mut ControlSession<'_>,
) -> Result<(Calibration, String), Failure> {
    let held = control.calibration()?;
    let (mut record, source) = match (&args.from, args.model, held) {
        (Some(path), _, _) => (file::read(path)?, path.display().to_string()),
        (None, Some(model), _) => (
            model.preset(),
            format!("the preset {}", file::model_name(model)),
        ),
        (None, None, Some(held)) => {
            let name = file::model_name(held.model);
            (held, format!("the record on the device ({name})"))
        }
        (None, None, None) => (
            Model::Premium15.preset(),
            format!(
                "the preset {} (the device has no record; --model selects another)",
                file::model_name(Model::Premium15)
            ),
        ),
    };
    for setting in &args.set {
        setting.apply(&mut record);
    }
    let valid = record.validate();
    valid
        .map_err(|bad| format!("the record cannot be used: {bad}"))
        .or_hint("change it with --set NAME=VALUE")?;
    Ok((record, source))
}

/// Activates the record on the device, and stores it there unless `--no-store` is given.
fn activate(
    args: &Args,
    control: &mut ControlSession<'_>,
    calibration: Calibration,
) -> Result<(), Failure> {
    let (answer, until) = match args.no_store {
        true => {
            let request = Request::SetCalibration { calibration };
            (control.request(&request)?, "until it is switched off")
        }
        false => {
            print_line(format!(
                "to store it    press the dead-man switch within {} s",
                PRESS_TIMEOUT_MS / 1_000
            ));
            (control.store(calibration)?, "and stored there")
        }
    };
    answer.or_hint("see hapterra status; the record can be kept in a file with -o FILE")?;
    print_line(format!("in force       on the device, {until}"));
    Ok(())
}
