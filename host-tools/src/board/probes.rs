//! Connected debug probes, found by their USB numbers. This needs no driver and no rights, so that
//! a probe that cannot be opened is distinguished from none.

/// A debug probe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Probe {
    /// Kind of the probe.
    pub kind: &'static str,
    /// The probe's own name, if it has one.
    pub name: Option<String>,
    /// Selector for probe-rs and `hapterra flash --probe`: `VID:PID[:SERIAL]`.
    pub selector: String,
}

/// ST's vendor number and the product numbers of ST-LINKs; every Nucleo has one.
const ST: u16 = 0x0483;
const ST_LINKS: [u16; 10] = [
    0x3744, 0x3748, 0x374a, 0x374b, 0x374d, 0x374e, 0x374f, 0x3752, 0x3753, 0x3754,
];
/// SEGGER's vendor number.
const SEGGER: u16 = 0x1366;

/// Returns the connected probes and the number of USB devices.
#[must_use]
pub fn probes() -> (Vec<Probe>, usize) {
    let devices = crate::link::usb_devices();
    let probes = devices.iter().filter_map(|info| {
        let name = info.product_string().map(str::to_owned);
        let (vendor, product) = (info.vendor_id(), info.product_id());
        let kind = kind(vendor, product, name.as_deref())?;
        let serial = info.serial_number().map(|serial| format!(":{serial}"));
        Some(Probe {
            kind,
            name,
            selector: format!("{vendor:04x}:{product:04x}{}", serial.unwrap_or_default()),
        })
    });
    (probes.collect(), devices.len())
}

fn kind(vendor: u16, product: u16, name: Option<&str>) -> Option<&'static str> {
    match (vendor, name) {
        (ST, _) if ST_LINKS.contains(&product) => Some("ST-LINK"),
        (SEGGER, _) => Some("J-Link"),
        // CMSIS-DAP requires these words in the product string.
        (_, Some(name)) if name.contains("CMSIS-DAP") => Some("CMSIS-DAP"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_are_distinguished_from_other_devices() {
        assert_eq!(kind(0x0483, 0x374e, None), Some("ST-LINK"));
        // A user's own firmware with ST's virtual serial port.
        assert_eq!(kind(0x0483, 0x5740, Some("STM32 Virtual ComPort")), None);
        let pico = Some("Debug Probe (CMSIS-DAP)");
        assert_eq!(kind(0x2e8a, 0x000c, pico), Some("CMSIS-DAP"));
        assert_eq!(kind(0x1209, 0x0001, Some("hapterra")), None);
    }
}
