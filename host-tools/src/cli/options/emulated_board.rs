//! Options that say where the loop runs, and how the emulated board is started.

use std::path::PathBuf;

use clap::ValueHint;

use crate::cli::failure::Failure;
use crate::link::{Emulator, EmulatorError, IMAGE_VARIABLE, Lines, QEMU, QEMU_VARIABLE};

/// Where the loop runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum RunsOn {
    /// On the emulated Cortex-M4F board
    Emulated,
    /// In this program: the application compiled for this machine
    Native,
}

/// How to start the emulated board.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Emulated board")]
pub struct EmulatedBoard {
    /// Image of the emulated board [default: $HAPTERRA_MPS2_ELF]
    #[arg(long, value_name = "ELF", value_hint = ValueHint::FilePath)]
    pub image: Option<PathBuf>,

    /// QEMU [default: $HAPTERRA_QEMU, else qemu-system-arm on the path]
    #[arg(long, value_name = "PATH", value_hint = ValueHint::ExecutablePath)]
    pub qemu: Option<PathBuf>,
}

impl EmulatedBoard {
    /// Whether an image is named, here or by the environment.
    #[must_use]
    pub fn is_named(&self) -> bool {
        self.image.is_some() || path_in(IMAGE_VARIABLE).is_some()
    }

    /// Starts the board and connects its two lines.
    ///
    /// # Errors
    /// What is missing, and what to type.
    pub fn start(&self) -> Result<(Emulator, Lines), Failure> {
        let named =
            |option: &Option<PathBuf>, variable| option.clone().or_else(|| path_in(variable));
        let image = named(&self.image, IMAGE_VARIABLE).ok_or(EmulatorError::NoImage)?;
        let qemu = named(&self.qemu, QEMU_VARIABLE).unwrap_or_else(|| QEMU.into());
        Ok(Emulator::start(&qemu, &image)?)
    }
}

/// The path in an environment variable; none where the variable is empty.
fn path_in(variable: &str) -> Option<PathBuf> {
    let value = std::env::var_os(variable).filter(|value| !value.is_empty());
    value.map(PathBuf::from)
}
