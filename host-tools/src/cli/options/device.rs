//! Which device a command talks to: on USB, behind a socket, in this program's
//! memory, or a board that is emulated for the occasion.

use std::str::FromStr;
use std::time::Duration;

use super::emulated_board::EmulatedBoard;
use crate::cli::failure::Failure;
use crate::link::{
    DeviceAddress, Dialogue, HostClock, LinkError, Native, Transport, move_arm_while,
};
use crate::phantom::{HandModel, HeldPhantom, PhantomModel, Placement, Script};

/// How long a real device may take to answer.
const PATIENCE: Duration = Duration::from_secs(4);
/// How long an emulated board may take to answer, on a busy machine.
pub(in crate::cli) const EMULATED_PATIENCE: Duration = Duration::from_secs(60);

/// A device by the name that the command line gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A device that is there already.
    There(DeviceAddress),
    /// A board emulated by QEMU, with a virtual Phantom at rest.
    Emulated,
}

impl FromStr for DeviceChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "emulated" => Ok(Self::Emulated),
            _ => text.parse().map(Self::There).map_err(|_| {
                "a device is usb, usb:SERIAL, tcp:HOST:PORT, native or emulated".into()
            }),
        }
    }
}

/// The device, and how to emulate it.
#[derive(Clone, Debug, clap::Args)]
pub struct Device {
    /// Device: usb, usb:SERIAL (`hapterra list` shows it), tcp:HOST:PORT, native (the
    /// application in this program), or
    /// emulated (the Cortex-M4F board, in QEMU)
    #[arg(long, default_value = "usb")]
    pub device: DeviceChoice,

    /// The emulated board.
    #[command(flatten)]
    pub board: EmulatedBoard,
}

impl Device {
    /// Talks to the device, which has no scene to feel.
    ///
    /// # Errors
    /// No device, or what `talk` fails with.
    pub fn talk<T>(
        &self,
        talk: impl FnOnce(&mut Dialogue<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        self.speak(opened, talk)
    }

    /// Looks at the device, and leaves it to the host that it has.
    ///
    /// # Errors
    /// As [`Device::talk`].
    pub fn look<T>(
        &self,
        talk: impl FnOnce(&mut Dialogue<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        self.speak(looked_at, talk)
    }

    fn speak<T>(
        &self,
        open: for<'t> fn(Box<dyn Transport + 't>, Duration) -> Result<Dialogue<'t>, LinkError>,
        talk: impl FnOnce(&mut Dialogue<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let mut arm = resting()?;
        match &self.device {
            DeviceChoice::There(address) => {
                let native = || Native::new(HostClock::default(), Some(Box::new(arm))).restless();
                converse(open(address.connect(native)?, PATIENCE)?, talk)
            }
            DeviceChoice::Emulated => {
                let (_emulator, mut lines) = self.board.start()?;
                move_arm_while(&mut lines.plant, &mut arm, || {
                    converse(open(Box::new(lines.link), EMULATED_PATIENCE)?, talk)
                })
            }
        }
    }
}

/// Talks, and ends the conversation.
fn converse<T>(
    mut dialogue: Dialogue<'_>,
    talk: impl FnOnce(&mut Dialogue<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let said = talk(&mut dialogue)?;
    dialogue.end()?;
    Ok(said)
}

fn opened<'t>(
    line: Box<dyn Transport + 't>,
    patience: Duration,
) -> Result<Dialogue<'t>, LinkError> {
    Dialogue::open(line, patience)
}

fn looked_at<'t>(
    line: Box<dyn Transport + 't>,
    patience: Duration,
) -> Result<Dialogue<'t>, LinkError> {
    Dialogue::look(line, patience)
}

/// A virtual Phantom at rest in its zero pose.
fn resting() -> Result<HeldPhantom, Failure> {
    let home_mm = [0.0; 3];
    let script = Script::start(home_mm);
    let model = PhantomModel::premium_1_5();
    HeldPhantom::new(model, HandModel::default(), Placement { home_mm }, script)
        .map_err(Failure::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_by_name() {
        assert_eq!("emulated".parse(), Ok(DeviceChoice::Emulated));
        assert_eq!(
            "usb".parse(),
            Ok(DeviceChoice::There(DeviceAddress::Usb(None)))
        );
        assert!("serial".parse::<DeviceChoice>().is_err());
    }

    #[test]
    fn the_device_in_memory_talks() {
        let device = Device {
            device: DeviceChoice::There(DeviceAddress::Native),
            board: EmulatedBoard::default(),
        };
        let board = device.talk(|dialogue| Ok(dialogue.device().board.to_string()));
        assert_eq!(board.ok().as_deref(), Some("native"));
    }
}
