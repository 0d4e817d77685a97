//! The command line of `hapterra-lab`: one file a subcommand, each with its `Args` and a `run`.

pub mod contact;
mod files;
pub mod replay;
pub mod stability;
pub mod streaming;
pub mod synth;

use std::process::ExitCode;

use clap::{ArgAction, Parser, Subcommand};
use hapterra::cli::{finish, parse};

/// Measure what hapterra renders: beside other methods, on a virtual arm, with terrain of any size.
#[derive(Debug, Parser)]
#[command(name = "hapterra-lab", version, propagate_version = true)]
pub struct Cli {
    /// Print more messages: -v progress, -vv details, -vvv everything
    #[arg(short, long, action = ArgAction::Count, global = true)]
    pub verbose: u8,

    /// The subcommand.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Measure run time and error of the contact beside other methods
    Contact(contact::Args),
    /// Measure opening, memory, tiles and the speed of the hand against size and latency
    Streaming(streaming::Args),
    /// Try on a virtual arm how stiff a surface may be before it is unstable
    Stability(stability::Args),
    /// Make a terrain file by formula
    Synth(synth::Args),
    /// Render a trajectory as `hapterra replay`, also by the contact rule of the paper
    Replay(replay::Args),
}

/// Runs the command with the arguments of this process: 0 on success, 1 on failure, 2 on wrong usage.
pub fn main() -> ExitCode {
    let cli: Cli = match parse(std::env::args_os().skip(1)) {
        Ok(cli) => cli,
        Err(code) => return ExitCode::from(code),
    };
    ExitCode::from(finish(cli.verbose, || match cli.command {
        Command::Contact(args) => contact::run(&args),
        Command::Streaming(args) => streaming::run(&args),
        Command::Stability(args) => stability::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Replay(args) => replay::run(&args),
    }))
}

/// Warns that the figures must not be quoted.
fn warn_without_optimisation() {
    if cfg!(debug_assertions) {
        eprintln!("note: built without full optimisation; for figures: cargo build --release");
    }
}
