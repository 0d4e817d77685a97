//! The `hapterra` command line: one file a subcommand, each with its `Args`
//! and a `run`.
//!
//! - [`options`]: what several subcommands let their user say;
//! - `terminal`: progress, Ctrl-C, and prompts while a command runs;
//! - [`failure`] and `hints`: what an error looks like, and what to do about it.

pub mod bench;
pub mod calibrate;
pub mod demo;
pub mod failure;
pub mod flash;
mod hints;
pub mod info;
pub mod list;
pub mod options;
pub mod replay;
pub mod run;
mod session_summary;
pub mod status;
pub mod synth;
mod terminal;

use std::process::ExitCode;

use clap::{ArgAction, Parser, Subcommand};
use tracing_subscriber::EnvFilter;

pub use failure::Failure;

/// Touch terrain of any size through a Phantom.
#[derive(Debug, Parser)]
#[command(name = "hapterra", version, propagate_version = true)]
pub struct Cli {
    /// Say more: -v for progress, -vv for details, -vvv for everything
    #[arg(short, long, action = ArgAction::Count, global = true)]
    pub verbose: u8,

    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Show what a terrain file holds and how it would be streamed
    Info(info::Args),
    /// Make a terrain file by formula
    Synth(synth::Args),
    /// Serve a terrain to a device and watch what is felt
    Run(run::Args),
    /// Show it all: a terrain, a board, a hand that tours it, and a picture
    Demo(demo::Args),
    /// Feel a trajectory tick by tick and write what was felt
    Replay(replay::Args),
    /// Show boards, debug probes and ports that can be seen from here
    List(list::Args),
    /// Show how a device is: calibration, what keeps it from arming, faults, figures
    Status(status::Args),
    /// Calibrate an arm: zero pose, ratios against a ruler, gravity
    Calibrate(calibrate::Args),
    /// Write an image to a board through its debug probe
    Flash(flash::Args),
    /// Measure run time against error, beside other ways to render a height field
    Bench(bench::Args),
}

/// Parses the command line, runs it and reports: 0 on success, 1 on failure,
/// 2 on wrong usage.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    log_to_stderr(cli.verbose);
    let outcome = match cli.command {
        Command::Info(args) => info::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::List(args) => list::run(&args),
        Command::Status(args) => status::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Flash(args) => flash::run(&args),
        Command::Bench(args) => bench::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.report();
            ExitCode::FAILURE
        }
    }
}

/// Diagnostics go to standard error; `RUST_LOG` overrides the `-v` count.
fn log_to_stderr(verbose: u8) {
    let level = match verbose {
        // A probe library warns of each kind of probe that it cannot look for;
        // what comes of it is said by the error.
        0 => "warn,probe_rs=error",
        1 => "info",
        2 => "debug",
        _ => "trace",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .without_time()
        .init();
}
