//! The USB device: its descriptors and the two ends of the link.

use embassy_usb::driver::Driver;
use embassy_usb::msos::{
    CompatibleIdFeatureDescriptor, PropertyData, RegistryPropertyFeatureDescriptor, windows_version,
};
use embassy_usb::{Builder, Config, UsbDevice};

use super::bulk_stream::BulkStream;
use super::endpoint_filter::{EndpointFilter, EndpointHalt};
use super::{
    INTERFACE_CLASS, INTERFACE_GUIDS, MSOS_VENDOR_CODE, PACKET, PRODUCT, PRODUCT_ID, VENDOR_ID,
};

/// Memory for the descriptors and for the data of control transfers.
pub struct DescriptorBuffers {
    config: [u8; 64],
    bos: [u8; 64],
    msos: [u8; 256],
    control: [u8; 64],
}

impl DescriptorBuffers {
    /// Empty memory.
    pub const EMPTY: Self = Self {
        config: [0; 64],
        bos: [0; 64],
        msos: [0; 256],
        control: [0; 64],
    };
}

/// The USB stack, which its task runs forever, and the two ends of the link.
pub type UsbParts<'d, D, H> = (
    UsbDevice<'d, EndpointFilter<D, H>>,
    BulkStream<<D as Driver<'d>>::EndpointOut>,
    BulkStream<<D as Driver<'d>>::EndpointIn>,
);

/// Describes the device on `driver`, whose endpoints' halts `H` ends, and returns its parts.
pub fn device<'d, D: Driver<'d>, H: EndpointHalt + 'd>(
    driver: D,
    serial_number: &'d str,
    buffers: &'d mut DescriptorBuffers,
) -> UsbParts<'d, D, H> {
    let mut config = Config::new(VENDOR_ID, PRODUCT_ID);
    config.manufacturer = Some("hapterra");
    config.product = Some(PRODUCT);
    config.serial_number = Some(serial_number);
    let mut builder = Builder::new(
        EndpointFilter::new(driver),
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
        BulkStream::new(from_host),
        BulkStream::new(to_host),
    )
}
