//! `hapterra-lab replay`: a trajectory rendered by a contact rule of choice.

use hapterra::cli::{Failure, replay};
use hapterra::replay::Rule;

/// Arguments of `hapterra-lab replay`.
#[derive(Debug, clap::Args)]
#[group(skip)]
pub struct Args {
    /// As of `hapterra replay`.
    #[command(flatten)]
    pub replay: replay::Args,

    /// Contact rule [default: that of the recording, else swept]
    #[arg(long, value_enum)]
    pub contact: Option<Rule>,
}

/// Renders the trajectory.
///
/// # Errors
/// As of `hapterra replay`.
pub fn run(args: &Args) -> Result<(), Failure> {
    replay::run_with_rule(&args.replay, args.contact)
}
