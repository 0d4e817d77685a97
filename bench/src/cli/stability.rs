//! `hapterra-lab stability`: the stiffness above which a surface is unstable.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::ValueHint;
use hapterra::cli::options::surface::{SurfaceChoice, SurfaceOptions, choice};
use hapterra::cli::terminal::{interrupt, partial_files, progress};
use hapterra::cli::{Failure, OrHint as _, report};
use hapterra::output::{Output, OutputError};
use hapterra::quantity::{DAMPING, FREQUENCY, STIFFNESS, TIME};
use hapterra_core::force::{Controller, Damping};
use hapterra_core::rate::TickRate;

use super::files::Outputs;
use crate::stability::map::Plan;
use crate::stability::picture;

const OTHER_FILE: &str = "name another file with -o";
const OTHER_LIMITS: &str = "name another file with --limits";

/// Arguments of `hapterra-lab stability`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Tick rates: whole kilohertz from 1kHz to 10kHz
    #[arg(long, value_name = "HZ,…", value_delimiter = ',', default_value = "1kHz,2kHz,4kHz,10kHz", value_parser = parse_rate)]
    pub rate: Vec<TickRate>,

    /// Stiffnesses, such as 0.5N/mm
    #[arg(long, value_name = "N/MM,…", value_delimiter = ',', default_value = "0.1N/mm,0.2N/mm,0.5N/mm,1N/mm,1.5N/mm,2N/mm,2.5N/mm,3N/mm,4N/mm,6N/mm,8N/mm,12N/mm,20N/mm", value_parser = parse_stiffness)]
    pub stiffness: Vec<f64>,

    /// Dampings of the surface, such as 2Ns/m
    #[arg(long, value_name = "NS/M,…", value_delimiter = ',', default_value = "0Ns/m", value_parser = parse_damping)]
    pub damping: Vec<Damping>,

    /// Surface whose micro-relief is tried: sand, rock, or a FILE.toml [default: none]
    #[arg(long, value_name = "NAME|FILE", value_hint = ValueHint::FilePath, value_parser = choice())]
    pub surface: Option<SurfaceChoice>,

    /// Passivity controller: off, on or both
    #[arg(
        long,
        value_name = "off|on,…",
        value_enum,
        value_delimiter = ',',
        default_value = "off,on"
    )]
    pub passivity: Vec<Passivity>,

    /// Time from reading the encoders to the amplifiers: up to 200us on a nucleo-g474re, and up to
    /// 1130us on a nucleo-h743zi2 with duty cycles
    #[arg(long, value_name = "TIME", default_value = "200us", value_parser = parse_delay)]
    pub delay: f64,

    /// Friction of the arm's joints, as parts of the model's
    #[arg(long, value_name = "PART,…", value_delimiter = ',', default_value = "0.1,1", value_parser = parse_part)]
    pub arm_friction: Vec<f64>,

    /// File for the limits, as CSV
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub limits: Option<PathBuf>,

    /// Files for the trials.
    #[command(flatten)]
    pub outputs: Outputs,
}

/// Setting of the passivity controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Passivity {
    /// Without it
    Off,
    /// With it
    On,
}

/// Runs all trials and prints the limits.
///
/// # Errors
/// When it is interrupted, or a file cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let of_surface = SurfaceOptions {
        surface: args.surface.clone(),
        ..SurfaceOptions::default()
    };
    let mut plan = Plan {
        rates: args.rate.clone(),
        stiffness_n_per_mm: args.stiffness.clone(),
        dampings: dampings(args),
        texture: of_surface.load()?.params.texture,
        delay_s: args.delay,
        arm_frictions: args.arm_friction.clone(),
    };
    plan.rates.sort_by_key(|rate| rate.hz());
    plan.rates.dedup();
    plan.stiffness_n_per_mm.sort_by(f64::total_cmp);
    plan.stiffness_n_per_mm.dedup();
    plan.arm_frictions.sort_by(f64::total_cmp);
    plan.arm_frictions.dedup();
    let (table, drawing) = args.outputs.table_and_picture()?;
    if args.limits.is_some() && args.limits.as_ref() == table {
        return Err(Failure::new("trials and limits must be in different files").hint(OTHER_LIMITS));
    }
    let files = table.into_iter().chain(drawing).chain(&args.limits);
    partial_files::report(files.map(PathBuf::as_path));
    // An output that cannot be written is reported before the trials.
    if let Some(path) = drawing {
        drop(Output::create(path).or_hint(OTHER_FILE)?);
    }
    let create = |path: Option<&PathBuf>| path.map(|path| Output::create(path)).transpose();
    let csv = create(table).or_hint(OTHER_FILE)?;
    let limits = create(args.limits.as_ref()).or_hint(OTHER_LIMITS)?;
    let progress = progress::bar(Some(0), "{bar:30} {pos}/{len} trials, {eta} left");
    interrupt::listen();
    let map = plan.map(&|of| {
        progress.set_length(of as u64);
        progress.inc(1);
        !interrupt::requested()
    });
    progress.finish_and_clear();
    let map = map.map_err(|error| Failure::new(error.to_string()))?;
    let map = map.ok_or_else(|| Failure::new("interrupted: no limits are printed"))?;
    report::put(&map.summary())?;
    if let Some(csv) = csv {
        write(csv, |to| map.write_csv(to)).or_hint(OTHER_FILE)?;
    }
    if let Some(limits) = limits {
        write(limits, |to| map.write_limits(to)).or_hint(OTHER_LIMITS)?;
    }
    if let Some(path) = drawing {
        let drawn = picture::draw(&map).and_then(|canvas| canvas.save(path));
        drawn.or_hint(OTHER_FILE)?;
    }
    Ok(())
}

/// Returns every damping with each requested controller setting.
fn dampings(args: &Args) -> Vec<Damping> {
    let mut values = args.damping.clone();
    values.sort_by(|a, b| a.ns_per_m.total_cmp(&b.ns_per_m));
    values.dedup();
    let mut controllers = args.passivity.clone();
    controllers.sort();
    controllers.dedup();
    let with_each = |damping: Damping| {
        let controllers = controllers.iter().map(|passivity| match passivity {
            Passivity::Off => Controller::Off,
            Passivity::On => Controller::On,
        });
        let dampings = controllers.map(move |controller| Damping {
            controller,
            ..damping
        });
        dampings.collect::<Vec<_>>()
    };
    values.into_iter().flat_map(with_each).collect()
}

fn write(
    mut csv: Output,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), OutputError> {
    let written = write(&mut csv);
    written.map_err(|source| OutputError {
        path: csv.path().to_owned(),
        source,
    })?;
    csv.finish()
}

fn parse_rate(text: &str) -> Result<TickRate, String> {
    let hz = FREQUENCY.read(text)?;
    let rate = (hz.fract() == 0.0).then(|| TickRate::new(hz as u32));
    let whole = "whole kilohertz from 1kHz to 10kHz";
    rate.flatten().ok_or_else(|| format!("expected {whole}"))
}

fn parse_delay(text: &str) -> Result<f64, String> {
    TIME.read_within(text, [0.0, 0.01])
}

fn parse_stiffness(text: &str) -> Result<f64, String> {
    STIFFNESS.read_within(text, [0.001, 100.0])
}

fn parse_part(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok();
    let number = number.filter(|number| (0.0..=10.0).contains(number));
    number.ok_or_else(|| "expected 0 to 10 times the model's friction".to_owned())
}

fn parse_damping(text: &str) -> Result<Damping, String> {
    let damping = DAMPING.read_single(text).map(|ns_per_m| Damping {
        ns_per_m,
        ..Damping::NONE
    })?;
    let max = Damping::MAX_NS_PER_M;
    let valid = damping.is_valid().then_some(damping);
    valid.ok_or_else(|| format!("expected 0 to {max} N·s/m"))
}
