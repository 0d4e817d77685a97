//! The address of a device, as the user writes it, and the connection to it.

use std::fmt;
use std::str::FromStr;

use super::error::LinkError;
use super::native::{HostClock, Native};
use super::tcp::Tcp;
use super::transport::Transport;
use super::usb::Usb;

/// A device's address on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceAddress {
    /// `usb` or `usb:SERIAL`: a board on USB, the only one or that with this serial
    /// number.
    Usb(Option<String>),
    /// `tcp:HOST:PORT`: an emulated board, or one behind a network.
    Tcp(String),
    /// The device's application in this program's memory.
    Native,
}

impl DeviceAddress {
    /// Connects to the device; `native` creates the one in this program's memory.
    ///
    /// # Errors
    /// [`LinkError::Absent`] names the searched device.
    pub fn connect<'t>(
        &self,
        native: impl FnOnce() -> Native<HostClock>,
    ) -> Result<Box<dyn Transport + 't>, LinkError> {
        Ok(match self {
            Self::Usb(serial) => Box::new(Usb::connect(serial.as_deref())?),
            Self::Tcp(address) => Box::new(Tcp::connect(address)?),
            Self::Native => Box::new(native()),
        })
    }
}

impl DeviceAddress {
    /// Fixes the address to the board that is the only one now, even if another is plugged in
    /// later.
    #[must_use]
    pub fn pinned(self) -> Self {
        match self {
            Self::Usb(None) => Self::Usb(Usb::only_serial()),
            other => other,
        }
    }
}

impl FromStr for DeviceAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.split_once(':')) {
            ("usb", _) => Ok(Self::Usb(None)),
            ("native", _) => Ok(Self::Native),
            (_, Some(("usb", serial))) if !serial.is_empty() => {
                Ok(Self::Usb(Some(serial.to_owned())))
            }
            ("emulated", _) => Err("a board that is emulated for one command renders a terrain in `hapterra demo --device emulated`; for one that runs already, use tcp:HOST:PORT+plant:HOST:PORT".into()),
            (_, Some(("tcp", address))) => tcp_address(address).map(Self::Tcp),
            _ => Err("a device is usb, usb:SERIAL, tcp:HOST:PORT or native".into()),
        }
    }
}

/// Checks `HOST:PORT`.
pub(crate) fn tcp_address(text: &str) -> Result<String, String> {
    let port = text
        .rsplit_once(':')
        .map(|(host, port)| (host, port.parse::<u16>()));
    match port {
        Some((host, Ok(_))) if !host.is_empty() => Ok(text.to_owned()),
        _ => Err("an address is HOST:PORT, as localhost:4000".into()),
    }
}

impl fmt::Display for DeviceAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usb(None) => f.write_str("usb"),
            Self::Usb(Some(serial)) => write!(f, "usb:{serial}"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Native => f.write_str("native"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn device_addresses_are_parsed() {
        assert_eq!("usb".parse(), Ok(DeviceAddress::Usb(None)));
        let named = "usb:0039001A".parse::<DeviceAddress>();
        assert_eq!(named, Ok(DeviceAddress::Usb(Some("0039001A".into()))));
        assert_eq!(named.map(|n| n.to_string()), Ok("usb:0039001A".into()));
        assert_eq!("native".parse(), Ok(DeviceAddress::Native));
        let tcp = "tcp:localhost:4000".parse::<DeviceAddress>();
        assert_eq!(tcp.map(|t| t.to_string()), Ok("tcp:localhost:4000".into()));
        for bad in [
            "",
            "usb:",
            "tcp:",
            "tcp:localhost",
            "tcp::1",
            "tcp:a:99999",
            "serial",
        ] {
            assert!(bad.parse::<DeviceAddress>().is_err(), "{bad}");
        }
    }
}
