//! Which device a command talks to: on USB, behind a socket, in this program's
//! memory, or a board that is emulated for the occasion.

use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::Failure;
use super::emulation::{Emulation, explain_link};
use crate::link::{Dialogue, HostClock, Native, Target, Tcp, Transport, Usb, serve_plant};
use crate::phantom::{HandModel, PhantomModel, Placement, Rig, Script};

/// How long a real device may take to answer.
const PATIENCE: Duration = Duration::from_secs(4);
/// How long an emulated one may, on a busy machine.
const EMULATED_PATIENCE: Duration = Duration::from_secs(60);

/// A device by the name that the command line gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Which {
    /// One that is there.
    There(Target),
    /// A board emulated by QEMU, with a virtual Phantom at rest.
    Emulated,
}

impl FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "emulated" => Ok(Self::Emulated),
            _ => text
                .parse()
                .map(Self::There)
                .map_err(|_| "a device is usb, tcp:HOST:PORT, native or emulated".into()),
        }
    }
}

/// The device, and how to emulate it.
#[derive(Clone, Debug, clap::Args)]
pub struct Device {
    /// Device: usb, tcp:HOST:PORT, native (the application in this program), or
    /// emulated (the Cortex-M4F board, in QEMU)
    #[arg(long, default_value = "usb")]
    pub device: Which,

    /// The emulated board.
    #[command(flatten)]
    pub emulation: Emulation,
}

impl Device {
    /// Talks to the device.
    ///
    /// # Errors
    /// No device, or what `talk` fails with.
    pub fn talk<T>(
        &self,
        talk: impl FnOnce(&mut Dialogue<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        match &self.device {
            Which::There(target) => {
                let transport: Box<dyn Transport> = match target {
                    Target::Usb => Box::new(Usb::connect().map_err(explain_link)?),
                    Target::Tcp(address) => Box::new(Tcp::connect(address).map_err(explain_link)?),
                    Target::Native => {
                        let arm = Some(Box::new(resting()?));
                        Box::new(Native::new(HostClock::default(), arm).restless())
                    }
                };
                let mut dialogue = Dialogue::open(transport, PATIENCE).map_err(explain_link)?;
                talk(&mut dialogue)
            }
            Which::Emulated => self.emulated(talk),
        }
    }

    fn emulated<T>(
        &self,
        talk: impl FnOnce(&mut Dialogue<'_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let mut rig = resting()?;
        let (_emulator, lines) = self.emulation.start()?;
        let (link, mut plant) = (lines.link, lines.plant);
        let done = AtomicBool::new(false);
        let stopped = || done.load(Ordering::Relaxed);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                if let Err(error) = serve_plant(&mut plant, &mut rig, &stopped) {
                    tracing::debug!("the plant's line ended: {error}");
                }
            });
            let dialogue = Dialogue::open(Box::new(link), EMULATED_PATIENCE);
            let talked = dialogue
                .map_err(explain_link)
                .and_then(|mut dialogue| talk(&mut dialogue));
            done.store(true, Ordering::Relaxed);
            talked
        })
    }
}

/// A virtual Phantom at rest in its zero pose.
fn resting() -> Result<Rig, Failure> {
    let home_mm = [0.0; 3];
    let script = Script::start(home_mm);
    let model = PhantomModel::premium_1_5();
    Rig::new(model, HandModel::default(), Placement { home_mm }, script).map_err(Failure::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_by_name() {
        assert_eq!("emulated".parse(), Ok(Which::Emulated));
        assert_eq!("usb".parse(), Ok(Which::There(Target::Usb)));
        assert!("serial".parse::<Which>().is_err());
    }

    #[test]
    fn the_device_in_memory_talks() {
        let device = Device {
            device: Which::There(Target::Native),
            emulation: Emulation::default(),
        };
        let board = device.talk(|dialogue| Ok(dialogue.device().board.to_string()));
        assert_eq!(board.ok().as_deref(), Some("native"));
    }
}
