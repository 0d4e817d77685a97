//! The OTG peripheral as a full-speed device: how an endpoint's halt ends; and the USB
//! loader in the chip's ROM.

use core::arch::global_asm;

use embassy_stm32::pac::USB_OTG_FS;
use embassy_usb::driver::{Bus, EndpointAddress};
use hapterra_firmware::usb::EndpointHalt;

/// Place where the loader is (AN2606): its vector table.
pub(crate) const LOADER: u32 = 0x1FF0_9800;

/// RCC_CR, and its bit that switches the oscillator of USB on.
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

/// Ends halts as RM0433 wants it.
pub(crate) struct EndpointHalts;

impl EndpointHalt for EndpointHalts {
    /// The endpoint stays in use: to take it out means to wait for the peripheral.
    fn end(_bus: &mut impl Bus, address: EndpointAddress) {
        let index = address.index();
        // The peripheral's interrupt writes these registers, too.
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
