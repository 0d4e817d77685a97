//! The device of a command: on USB, at a socket, in this program's memory, or on a board emulated
//! for this command.

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use crate::cli::failure::Failure;
use crate::link::{
    ControlSession, DeviceAddress, Emulator, EmulatorError, HostClock, IMAGE_VARIABLE, Lines,
    LinkError, Native, QEMU, QEMU_VARIABLE, Transport, move_arm_while,
};
use crate::phantom::{ArmFrame, HandModel, HeldPhantom, PhantomModel, Script};

/// Time limit for a real device's reply.
const TIMEOUT: Duration = Duration::from_secs(4);
/// Time limit for an emulated board's reply, on a busy machine.
pub(in crate::cli) const EMULATED_TIMEOUT: Duration = Duration::from_secs(60);

/// A device named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A device that already runs.
    Connected(DeviceAddress),
    /// A board emulated by QEMU, with a virtual Phantom at rest.
    Emulated(EmulatedBoard),
}

impl FromStr for DeviceChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (EmulatedBoard::parse_name(text), text.parse()) {
            (Some(board), _) => Ok(Self::Emulated(board)),
            (None, Ok(address)) => Ok(Self::Connected(address)),
            (None, Err(_)) => Err(
                "a device is usb, usb:SERIAL, tcp:HOST:PORT, native, emulated or emulated:ELF"
                    .into(),
            ),
        }
    }
}

/// A device without a real arm: in this program, or on an emulated board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VirtualDevice {
    /// The application compiled for this machine, in this program.
    Native,
    /// The emulated Cortex-M4F board.
    Emulated(EmulatedBoard),
}

impl FromStr for VirtualDevice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, EmulatedBoard::parse_name(text)) {
            ("native", _) => Ok(Self::Native),
            (_, Some(board)) => Ok(Self::Emulated(board)),
            _ => Err("native, emulated or emulated:ELF".into()),
        }
    }
}

/// A board that QEMU emulates, with its image; `HAPTERRA_QEMU` may name QEMU.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EmulatedBoard {
    /// The image; if `None`, that of `HAPTERRA_MPS2_ELF`.
    image: Option<PathBuf>,
}

impl EmulatedBoard {
    /// Parses the name of an emulated board, if it is one.
    fn parse_name(text: &str) -> Option<Self> {
        match text.strip_prefix("emulated")? {
            "" => Some(Self::default()),
            rest => {
                let image = rest.strip_prefix(':').filter(|image| !image.is_empty())?;
                let image = Some(image.into());
                Some(Self { image })
            }
        }
    }

    /// Returns true if the environment names an image.
    pub(in crate::cli) fn has_image() -> bool {
        path_in(IMAGE_VARIABLE).is_some()
    }

    /// Starts the board and connects its two lines.
    ///
    /// # Errors
    /// A missing part, with the remedy.
    pub(in crate::cli) fn start(&self) -> Result<(Emulator, Lines), Failure> {
        let image = self.image.clone().or_else(|| path_in(IMAGE_VARIABLE));
        let image = image.ok_or(EmulatorError::NoImage)?;
        let qemu = path_in(QEMU_VARIABLE).unwrap_or_else(|| QEMU.into());
        Ok(Emulator::start(&qemu, &image)?)
    }
}

/// Returns the path in an environment variable; `None` if it is empty.
fn path_in(variable: &str) -> Option<PathBuf> {
    let value = std::env::var_os(variable).filter(|value| !value.is_empty());
    value.map(PathBuf::from)
}

/// The device that a command talks to.
#[derive(Clone, Debug, clap::Args)]
pub struct Device {
    /// Device: usb, usb:SERIAL, tcp:HOST:PORT, native, emulated or emulated:ELF
    ///
    /// usb:SERIAL: `hapterra list` shows it; native: the application in this program; emulated: the
    /// Cortex-M4F board in QEMU, with the image ELF, else that of HAPTERRA_MPS2_ELF.
    #[arg(long, default_value = "usb")]
    pub device: DeviceChoice,
}

impl Device {
    /// Opens a session without a scene and calls `run`.
    ///
    /// # Errors
    /// No device, or the error of `run`.
    pub fn with_session<T>(
        &self,
        run: impl FnOnce(&mut ControlSession<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        self.with_opened(open_session, run)
    }

    /// Queries the device; a session of another host continues.
    ///
    /// # Errors
    /// As [`Device::with_session`].
    pub fn with_read_only_session<T>(
        &self,
        run: impl FnOnce(&mut ControlSession<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        self.with_opened(open_read_only, run)
    }

    fn with_opened<T>(
        &self,
        open: for<'t> fn(
            Box<dyn Transport + 't>,
            Duration,
        ) -> Result<ControlSession<'t>, LinkError>,
        run: impl FnOnce(&mut ControlSession<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let mut arm = resting_phantom()?;
        match &self.device {
            DeviceChoice::Connected(address) => {
                let native =
                    || Native::new(HostClock::default(), Some(Box::new(arm))).free_running();
                run_and_close(open(address.connect(native)?, TIMEOUT)?, run)
            }
            DeviceChoice::Emulated(board) => {
                let (_emulator, mut lines) = board.start()?;
                move_arm_while(&mut lines.plant, &mut arm, || {
                    run_and_close(open(Box::new(lines.link), EMULATED_TIMEOUT)?, run)
                })
            }
        }
    }
}

/// Calls `run` and ends the session.
fn run_and_close<T>(
    mut control: ControlSession<'_>,
    run: impl FnOnce(&mut ControlSession<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let result = run(&mut control)?;
    control.end()?;
    Ok(result)
}

fn open_session<'t>(
    line: Box<dyn Transport + 't>,
    timeout: Duration,
) -> Result<ControlSession<'t>, LinkError> {
    ControlSession::open(line, timeout)
}

fn open_read_only<'t>(
    line: Box<dyn Transport + 't>,
    timeout: Duration,
) -> Result<ControlSession<'t>, LinkError> {
    ControlSession::open_read_only(line, timeout)
}

/// Returns a virtual Phantom at rest in its zero pose.
fn resting_phantom() -> Result<HeldPhantom, Failure> {
    let home_mm = [0.0; 3];
    let script = Script::start(home_mm);
    let model = PhantomModel::premium_1_5();
    HeldPhantom::new(model, HandModel::default(), ArmFrame { home_mm }, script)
        .map_err(Failure::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn device_choices_are_parsed() {
        let emulated = |image: Option<&str>| {
            let image = image.map(Into::into);
            EmulatedBoard { image }
        };
        let default = DeviceChoice::Emulated(emulated(None));
        assert_eq!("emulated".parse(), Ok(default));
        let named = VirtualDevice::Emulated(emulated(Some("a:b/c.elf")));
        assert_eq!("emulated:a:b/c.elf".parse(), Ok(named));
        assert_eq!("native".parse(), Ok(VirtualDevice::Native));
        for bad in ["usb", "emulated:", "emulatedx", ""] {
            assert!(bad.parse::<VirtualDevice>().is_err(), "{bad}");
        }
        assert_eq!(
            "usb".parse(),
            Ok(DeviceChoice::Connected(DeviceAddress::Usb(None)))
        );
        assert!("serial".parse::<DeviceChoice>().is_err());
    }

    #[test]
    fn native_device_reports_its_board() {
        let device = Device {
            device: DeviceChoice::Connected(DeviceAddress::Native),
        };
        let board = device.with_session(|control| Ok(control.device().board.to_string()));
        assert_eq!(board.ok().as_deref(), Some("native"));
    }
}
