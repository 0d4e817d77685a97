//! The link on USB: a vendor-specific interface with two bulk endpoints, which
//! Windows takes without a driver (WinUSB, by Microsoft OS 2.0 descriptors).

use embassy_usb::driver::{Driver, Endpoint, EndpointError, EndpointIn, EndpointOut};
use embassy_usb::msos::{
    CompatibleIdFeatureDescriptor, PropertyData, RegistryPropertyFeatureDescriptor, windows_version,
};
use embassy_usb::{Builder, Config, UsbDevice};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use hapterra_firmware::usb::{INTERFACE_CLASS, PACKET, PRODUCT, PRODUCT_ID, VENDOR_ID};
use static_cell::ConstStaticCell;

/// Request code of the Microsoft OS descriptors; any that is not otherwise used.
const MSOS_VENDOR_CODE: u8 = 0x01;
/// Under which a Windows program finds the interface.
const INTERFACE_GUIDS: [&str; 1] = ["{7B0D3C64-5F6E-4A0B-9C7C-6B1E5A0C2D11}"];

struct Descriptors {
    config: [u8; 64],
    bos: [u8; 64],
    msos: [u8; 256],
    control: [u8; 64],
}

static DESCRIPTORS: ConstStaticCell<Descriptors> = ConstStaticCell::new(Descriptors {
    config: [0; 64],
    bos: [0; 64],
    msos: [0; 256],
    control: [0; 64],
});

/// Describes the device and gives it with the two ends of the link.
pub(crate) fn device<D: Driver<'static>>(
    driver: D,
    serial_number: &'static str,
) -> (
    UsbDevice<'static, D>,
    Packets<D::EndpointOut>,
    Packets<D::EndpointIn>,
) {
    let mut config = Config::new(VENDOR_ID, PRODUCT_ID);
    config.manufacturer = Some("hapterra");
    config.product = Some(PRODUCT);
    config.serial_number = Some(serial_number);
    let buffers = DESCRIPTORS.take();
    let mut builder = Builder::new(
        driver,
        config,
        &mut buffers.config,
        &mut buffers.bos,
        &mut buffers.msos,
        &mut buffers.control,
    );
    builder.msos_descriptor(windows_version::WIN8_1, MSOS_VENDOR_CODE);
    let mut function = builder.function(INTERFACE_CLASS, 0, 0);
    function.msos_feature(CompatibleIdFeatureDescriptor::new("WINUSB", ""));
    function.msos_feature(RegistryPropertyFeatureDescriptor::new(
        "DeviceInterfaceGUIDs",
        PropertyData::RegMultiSz(&INTERFACE_GUIDS),
    ));
    let mut interface = function.interface();
    let mut setting = interface.alt_setting(INTERFACE_CLASS, 0, 0, None);
    let from_host = setting.endpoint_bulk_out(None, PACKET as u16);
    let to_host = setting.endpoint_bulk_in(None, PACKET as u16);
    drop(function);
    (
        builder.build(),
        Packets::new(from_host),
        Packets::new(to_host),
    )
}

/// A bulk endpoint as a stream of bytes.
pub(crate) struct Packets<E> {
    endpoint: E,
    /// Whether the host has the interface in use, as far as this end knows.
    up: bool,
}

impl<E: Endpoint> Packets<E> {
    const fn new(endpoint: E) -> Self {
        Self {
            endpoint,
            up: false,
        }
    }

    /// Waits for the host to take the interface into use.
    async fn until_up(&mut self) {
        if !self.up {
            self.endpoint.wait_enabled().await;
            self.up = true;
        }
    }
}

impl<E> ErrorType for Packets<E> {
    type Error = ErrorKind;
}

impl<E: EndpointOut> Read for Packets<E> {
    /// One packet. Nothing (0) when the host has gone; the next call waits
    /// until it is back. `bytes` holds a packet, or what exceeds it is an error.
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        self.until_up().await;
        loop {
            match self.endpoint.read(bytes).await {
                // An empty packet only says that a transfer has ended.
                Ok(0) => {}
                Ok(n) => return Ok(n),
                Err(EndpointError::Disabled) => {
                    self.up = false;
                    return Ok(0);
                }
                Err(EndpointError::BufferOverflow) => return Err(ErrorKind::OutOfMemory),
            }
        }
    }
}

impl<E: EndpointIn> Write for Packets<E> {
    /// One packet, never a full one: a host's read ends with a short packet.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.until_up().await;
        let packet = bytes.get(..PACKET - 1).unwrap_or(bytes);
        if self.endpoint.write(packet).await.is_err() {
            self.up = false;
            return Err(ErrorKind::NotConnected);
        }
        Ok(packet.len())
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
