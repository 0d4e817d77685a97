//! Options that say how to start the emulated board, shared by `replay` and
//! `demo`.

use std::path::PathBuf;

use clap::ValueHint;

use super::Failure;
use crate::link::{Emulator, EmulatorError, IMAGE_VARIABLE, Lines, LinkError, QEMU, QEMU_VARIABLE};

/// How to start the emulated board.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Emulated board")]
pub struct Emulation {
    /// Image of the emulated board [default: $HAPTERRA_MPS2_ELF]
    #[arg(long, value_name = "ELF", value_hint = ValueHint::FilePath)]
    pub image: Option<PathBuf>,

    /// QEMU [default: $HAPTERRA_QEMU, else qemu-system-arm on the path]
    #[arg(long, value_name = "PATH", value_hint = ValueHint::ExecutablePath)]
    pub qemu: Option<PathBuf>,
}

impl Emulation {
    /// The image, if one was named.
    #[must_use]
    pub fn image(&self) -> Option<PathBuf> {
        self.image.clone().or_else(|| variable(IMAGE_VARIABLE))
    }

    /// Starts the board.
    ///
    /// # Errors
    /// What is missing, and what to type.
    pub fn start(&self) -> Result<(Emulator, Lines), Failure> {
        let image = self
            .image()
            .ok_or(EmulatorError::NoImage)
            .map_err(explain_emulator)?;
        let named = self.qemu.clone().or_else(|| variable(QEMU_VARIABLE));
        let qemu = named.unwrap_or_else(|| QEMU.into());
        Emulator::start(&qemu, &image).map_err(explain_emulator)
    }
}

fn variable(name: &str) -> Option<PathBuf> {
    let value = std::env::var_os(name).filter(|value| !value.is_empty());
    value.map(PathBuf::from)
}

/// Adds what to do next.
pub(super) fn explain_emulator(error: EmulatorError) -> Failure {
    let hint = match error {
        EmulatorError::NoImage | EmulatorError::Image { .. } => {
            "`cargo xtask demo` builds the image and names it; or say --image ELF"
        }
        EmulatorError::Qemu { .. } => {
            "install QEMU for ARM (`cargo xtask demo` does, or type: sudo apt-get install qemu-system-arm), or say --qemu PATH"
        }
        EmulatorError::NotUp { .. } => {
            "check that the image is the mps2-an386 one: `cargo xtask demo` builds it anew"
        }
        EmulatorError::Listen(_) => "check that this program may open sockets on 127.0.0.1",
    };
    Failure::new(error).hint(hint)
}

/// Adds what to do next.
pub(super) fn explain_link(error: LinkError) -> Failure {
    let hint = link_hint(&error);
    Failure::new(error).hint(hint)
}

/// What to do next about a link.
pub(super) fn link_hint(error: &LinkError) -> &'static str {
    match error {
        LinkError::Absent { looked_for, .. } if looked_for.contains("USB") => {
            "plug the board in, check its cable and that you may open it (on Linux the udev rule host-tools/udev/70-hapterra.rules); or try --device native"
        }
        LinkError::Absent { .. } => "start the emulated board there, or try --device native",
        LinkError::Gone(_) | LinkError::Silent(_) | LinkError::Restarted => {
            "check the device and its cable, then start again"
        }
        LinkError::Version { ours, theirs } if theirs < ours => {
            "flash the firmware that belongs to this command"
        }
        LinkError::Version { .. } => "install the hapterra command that belongs to the firmware",
        LinkError::SceneRefused | LinkError::Stuck(_) => {
            "this should not happen: please report it with the file and the options"
        }
    }
}
