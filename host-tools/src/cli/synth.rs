//! `hapterra synth`: a terrain file made by formula.

use std::path::PathBuf;

use super::Failure;

/// Arguments of `hapterra synth`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// File to write
    #[arg(short, long)]
    pub output: PathBuf,
}

/// Writes the terrain.
pub fn run(args: &Args) -> Result<(), Failure> {
    println!("{}", args.output.display());
    Ok(())
}
