//! The devices of a session, and the options that several devices cannot have.

use std::net::ToSocketAddrs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use hapterra_core::phantom::Calibration;

use super::Args;
use crate::cli::device_calibration::calibration_of;
use crate::cli::failure::Failure;
use crate::cli::terminal::device_console::DeviceConsole;
use crate::cli::terminal::shared_keyboard;
use crate::link::{DeviceAddress, tcp_address};

/// A device named on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ServedDevice {
    address: DeviceAddress,
    /// The plant line of an emulated board, HOST:PORT.
    plant: Option<String>,
}

impl ServedDevice {
    /// Returns the device, with the only connected board selected by its serial number.
    pub(super) fn pinned(self) -> Self {
        Self {
            address: self.address.pinned(),
            ..self
        }
    }
}

impl FromStr for ServedDevice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((address, plant)) = text.split_once("+plant:") else {
            let (address, plant) = (text.parse()?, None);
            return Ok(Self { address, plant });
        };
        let address = address.parse()?;
        if address == DeviceAddress::Native {
            return Err("native moves its arm by itself: leave +plant:HOST:PORT out".into());
        }
        let plant = Some(tcp_address(plant)?);
        Ok(Self { address, plant })
    }
}

/// One of the devices, with its own console and files.
#[derive(Clone)]
pub(super) struct OneDevice {
    pub(super) address: DeviceAddress,
    /// The plant line of an emulated board.
    pub(super) plant: Option<String>,
    /// File of the device's recording.
    pub(super) record: Option<PathBuf>,
    pub(super) device_console: DeviceConsole,
}

impl OneDevice {
    /// Returns true if the arm is virtual, in a hand that follows a script.
    pub(super) fn is_scripted(&self) -> bool {
        self.plant.is_some() || self.address == DeviceAddress::Native
    }

    /// Returns the calibration that the device reports. If it reports none, returns that of a
    /// Premium 1.5 and the error. The session is closed later, because the arm may already be
    /// armed.
    pub(super) fn read_calibration(&self) -> (Calibration, Result<(), Failure>) {
        // The virtual Phantom is a Premium 1.5.
        let preset = Calibration::PREMIUM_1_5;
        if self.is_scripted() {
            return (preset, Ok(()));
        }
        match calibration_of(&self.address, &|line| self.device_console.notify(line)) {
            Ok(calibration) => (calibration, Ok(())),
            Err(failure) => (preset, Err(failure)),
        }
    }
}

/// Returns the requested devices.
///
/// # Errors
/// A device is named twice, or an option is invalid for several devices.
pub(super) fn of(args: &Args) -> Result<Vec<OneDevice>, Failure> {
    let are_several = args.device.len() > 1;
    if are_several {
        check(args)?;
    }
    let consoles = DeviceConsole::of_each(&addresses_of(args));
    let numbered = args.device.iter().zip(consoles).zip(1..);
    let devices = numbered.map(|((device, device_console), number)| OneDevice {
        address: device.address.clone(),
        plant: device.plant.clone(),
        record: match (&args.out, are_several) {
            (Some(path), true) => Some(of_device(path, number)),
            (path, _) => path.clone(),
        },
        device_console,
    });
    Ok(devices.collect())
}

fn addresses_of(args: &Args) -> Vec<DeviceAddress> {
    let devices = args.device.iter();
    devices.map(|device| device.address.clone()).collect()
}

/// Refuses options that are invalid for several devices.
fn check(args: &Args) -> Result<(), Failure> {
    let count = args.device.len();
    if count > shared_keyboard::MAX {
        let error = format!(
            "{count} devices; at most {} can be served",
            shared_keyboard::MAX
        );
        return Err(Failure::new(error).hint("serve the others by another `hapterra run`"));
    }
    check_distinct(&addresses_of(args))?;
    check_plants_distinct(args)?;
    if args.viewing.view {
        return Err(
            Failure::new(format!("--view shows one device, and not {count}")).hint(
                "leave --view out, record with -o, and look at each recording with `hapterra view`",
            ),
        );
    }
    if args.commands.are_typed() && std::io::IsTerminal::is_terminal(&std::io::stdin()) {
        let error =
            "with several devices `--commands -` needs a pipe: Enter in a terminal arms a device";
        return Err(Failure::new(error).hint("leave --commands out and use keys, or name a file or send lines through a pipe: `on 2 zoom 2` is for the second device"));
    }
    Ok(())
}

/// Checks that no device is named twice.
fn check_distinct(addresses: &[DeviceAddress]) -> Result<(), Failure> {
    for (index, second) in addresses.iter().enumerate() {
        let firsts = addresses.iter().take(index).zip(1..);
        for (first, number) in firsts {
            let numbers = format!("devices {number} and {}", index + 1);
            if may_be_same_board(first, second) {
                let error = format!("{numbers}: {first} and {second} may be the same board");
                return Err(Failure::new(error).hint(
                    "name each board by its serial number, as `hapterra list` shows it: usb:SERIAL",
                ));
            }
            if is_same(first, second) {
                let error = match first == second {
                    true => format!("{numbers} are both {first}"),
                    false => format!("{numbers} are the same: {first} and {second}"),
                };
                return Err(Failure::new(error).hint("name each device once"));
            }
        }
    }
    Ok(())
}

/// Returns true if both are boards on USB and one has no serial number.
fn may_be_same_board(first: &DeviceAddress, second: &DeviceAddress) -> bool {
    match (first, second) {
        (DeviceAddress::Usb(first), DeviceAddress::Usb(second)) => {
            first.is_none() || second.is_none()
        }
        _ => false,
    }
}

/// Returns true if both are certainly the same device. Native devices are always different.
fn is_same(first: &DeviceAddress, second: &DeviceAddress) -> bool {
    match (first, second) {
        (DeviceAddress::Native, _) => false,
        (DeviceAddress::Tcp(first), DeviceAddress::Tcp(second)) => is_same_socket(first, second),
        _ => first == second,
    }
}

/// Returns true if two `HOST:PORT` are the same socket, even by different names of a host.
fn is_same_socket(first: &str, second: &str) -> bool {
    if first == second {
        return true;
    }
    let port = |text: &str| text.rsplit_once(':').map(|(_, port)| port.parse::<u16>());
    if port(first) != port(second) {
        return false;
    }
    // An unknown name is reported when the line is opened.
    let of = |text: &str| text.to_socket_addrs().map(Vec::from_iter);
    match (of(first), of(second)) {
        (Ok(first), Ok(second)) => first.iter().any(|address| second.contains(address)),
        _ => false,
    }
}

/// Checks that all devices except native ones have plant lines, each a different one, or that none
/// has.
fn check_plants_distinct(args: &Args) -> Result<(), Failure> {
    let plants: Vec<_> = { args.device.iter() }
        .filter_map(|device| device.plant.as_ref())
        .collect();
    for (index, plant) in plants.iter().enumerate() {
        let mut before = plants.iter().take(index);
        if before.any(|other| is_same_socket(other, plant)) {
            return Err(same_plant(plant));
        }
    }
    let is_other = |device: &&ServedDevice| device.address != DeviceAddress::Native;
    let others = args.device.iter().filter(is_other);
    let (others, count) = (others.count(), plants.len());
    if count == 0 || count == others {
        return Ok(());
    }
    let error = format!("{count} of {others} devices other than native have a plant line");
    Err(Failure::new(error).hint(
        "add +plant:HOST:PORT to each of them, and run real arms in a separate `hapterra run`",
    ))
}

fn same_plant(plant: &str) -> Failure {
    let error = format!("two devices have the plant line tcp:{plant}");
    Failure::new(error).hint("name a separate plant line for each emulated board")
}

/// Returns the file of a device's recording, such as `felt-2.csv` for `felt.csv`.
fn of_device(path: &Path, number: usize) -> PathBuf {
    // Standard output and folders are reported elsewhere.
    let Some(stem) = path.file_stem().filter(|stem| *stem != "-") else {
        return path.to_owned();
    };
    let mut name = stem.to_owned();
    name.push(format!("-{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
#[path = "devices_tests.rs"]
mod tests;
