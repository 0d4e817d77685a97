//! The OTG peripheral as a full-speed device: the end of an endpoint's halt, and the USB loader in
//! the chip's ROM.

use core::arch::global_asm;

use embassy_stm32::pac::USB_OTG_FS;
use embassy_usb::driver::{Bus, EndpointAddress};
use hapterra_firmware::usb::EndpointHalt;

/// Address of the loader's vector table (AN2606).
pub(crate) const LOADER: u32 = 0x1FF0_9800;

/// RCC_CR, and its bit that enables USB's oscillator.
pub(crate) const USB_OSCILLATOR: (u32, u32) = (0x5802_4400, 1 << 12);

// Only RAM can be at address 0 on this chip.
global_asm!(
    ".section .text.hapterra_show_loader, \"ax\", %progbits",
    ".thumb",
    ".global hapterra_show_loader",
    ".type hapterra_show_loader, %function",
    ".thumb_func",
    "hapterra_show_loader:",
    "bx lr",
);

/// Ends halts by the procedure in RM0433.
pub(crate) struct EndpointHalts;

impl EndpointHalt for EndpointHalts {
    /// Ends the halt of an endpoint that stays enabled: to disable it means to wait for the
    /// peripheral.
    fn end(_bus: &mut impl Bus, address: EndpointAddress) {
        let index = address.index();
        // The peripheral's interrupt also writes these registers.
        critical_section::with(|_| match address.is_in() {
            true => USB_OTG_FS.diepctl(index).modify(|w| {
                w.set_stall(false);
                w.set_sd0pid_sevnfrm(true);
            }),
            false => USB_OTG_FS.doepctl(index).modify(|w| {
                w.set_stall(false);
                w.set_sd0pid_sevnfrm(true);
            }),
        });
    }
}
