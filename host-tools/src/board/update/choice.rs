//! Choice of the USB device to update.

use super::error::UpdateError;

/// A device that could be updated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConnectedDevice {
    /// The USB port: the same before and after the device changes into its loader.
    pub place: String,
    /// Serial number. The loader's differs from the firmware's.
    pub serial: Option<String>,
    /// True for a loader, false for a board that runs its firmware.
    pub is_loader: bool,
}

/// The device to update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice<'p> {
    /// A board that runs its firmware and has to enter its loader first.
    Board(&'p ConnectedDevice),
    /// The loader that the user named.
    Loader(&'p ConnectedDevice),
    /// A loader that the user did not name. It may be any STM32: a board after a failed update, or
    /// another machine. The user must confirm it.
    UnnamedLoader(&'p ConnectedDevice),
}

/// Returns the device with a serial number, or the only device. If several match, none is chosen,
/// because the image might be written to the wrong board.
///
/// # Errors
/// [`UpdateError::Nothing`] and [`UpdateError::Several`], which names them.
pub fn choose<'p>(
    connected_devices: &'p [ConnectedDevice],
    serial: Option<&str>,
) -> Result<Choice<'p>, UpdateError> {
    let fits = |device: &&ConnectedDevice| {
        serial.is_none_or(|requested| {
            let serial = device.serial.as_deref();
            serial.is_some_and(|serial| serial.eq_ignore_ascii_case(requested))
        })
    };
    let mut fitting = connected_devices.iter().filter(fits);
    match (fitting.next(), fitting.next()) {
        (Some(device), None) if device.is_loader => Ok(match serial {
            Some(_) => Choice::Loader(device),
            None => Choice::UnnamedLoader(device),
        }),
        (Some(device), None) => Ok(Choice::Board(device)),
        (None, _) => Err(UpdateError::Nothing {
            searched_for: match serial {
                Some(serial) => format!("the serial number {serial:?}"),
                None => "a hapterra board, or an STM32 in its loader".into(),
            },
        }),
        (Some(_), Some(_)) => Err(UpdateError::Several(
            connected_devices.iter().map(name).collect(),
        )),
    }
}

fn name(device: &ConnectedDevice) -> String {
    let kind = if device.is_loader {
        "a loader"
    } else {
        "a board"
    };
    let serial = device.serial.as_deref();
    let serial = serial.map_or("without a serial number".into(), |s| format!("usb:{s}"));
    format!("{kind} {serial} at {}", device.place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(serial: &str, is_loader: bool) -> ConnectedDevice {
        ConnectedDevice {
            place: format!("bus 1 port {}", serial.len()),
            serial: Some(serial.into()),
            is_loader,
        }
    }

    /// Safety: 34.
    #[test]
    fn choice_among_several_devices_needs_a_unique_serial() {
        let [a, b, c] = [
            device("AB12", false),
            device("CD345", false),
            device("0F", true),
        ];
        let one = std::slice::from_ref(&a);
        assert_eq!(choose(one, None).ok(), Some(Choice::Board(&a)));
        assert_eq!(choose(one, Some("ab12")).ok(), Some(Choice::Board(&a)));
        let three = [a.clone(), b.clone(), c.clone()];
        assert_eq!(choose(&three, Some("0F")).ok(), Some(Choice::Loader(&c)));
        let only = std::slice::from_ref(&c);
        assert_eq!(choose(only, None).ok(), Some(Choice::UnnamedLoader(&c)));
        assert_eq!(choose(only, Some("0f")).ok(), Some(Choice::Loader(&c)));
        let Err(UpdateError::Several(named)) = choose(&three, None) else {
            panic!("refused");
        };
        for device in [&a, &b, &c] {
            let serial = device.serial.as_deref().expect("has one");
            assert!(named.iter().any(|name| name.contains(serial)), "{named:?}");
        }
        let twins = [a.clone(), a];
        assert!(matches!(
            choose(&twins, Some("AB12")),
            Err(UpdateError::Several(_))
        ));
    }

    #[test]
    fn no_matching_device_is_an_error() {
        assert!(matches!(
            choose(&[], None),
            Err(UpdateError::Nothing { .. })
        ));
        let one = [device("AB12", false)];
        let other = choose(&one, Some("AB"));
        assert!(
            matches!(other, Err(UpdateError::Nothing { .. })),
            "{other:?}"
        );
    }
}
