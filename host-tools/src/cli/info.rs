//! `hapterra info`: what a terrain file holds.

use std::path::PathBuf;

use super::Failure;

/// Arguments of `hapterra info`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Terrain file
    pub file: PathBuf,
}

/// Shows what the file holds.
pub fn run(args: &Args) -> Result<(), Failure> {
    println!("{}", args.file.display());
    Ok(())
}
