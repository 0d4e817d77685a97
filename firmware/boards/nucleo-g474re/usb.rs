//! The full-speed USB peripheral: the end of an endpoint's halt, and the USB loader in the chip's
//! ROM.

use core::arch::global_asm;

use embassy_stm32::pac::USB;
use embassy_stm32::pac::usb::regs::Epr;
use embassy_stm32::pac::usb::vals::Stat;
use embassy_usb::driver::{Bus, EndpointAddress};
use hapterra_firmware::usb::EndpointHalt;

/// Address of the loader's vector table (AN2606).
pub(crate) const LOADER: u32 = 0x1FFF_0000;
/// RCC_CRRCR, and its bit that enables USB's oscillator.
pub(crate) const USB_OSCILLATOR: (u32, u32) = (0x4002_1098, 1 << 0);

// Maps system memory to address 0, as the BOOT0 pin does.
global_asm!(
    ".section .text.hapterra_show_loader, \"ax\", %progbits",
    ".thumb",
    ".global hapterra_show_loader",
    ".type hapterra_show_loader, %function",
    ".thumb_func",
    "hapterra_show_loader:",
    "movs r1, #1",
    "ldr r0, =0x40021060", // RCC_APB2ENR: SYSCFGEN
    "str r1, [r0]",
    "ldr r2, [r0]",        // A clock starts after two cycles.
    "ldr r0, =0x40010000", // SYSCFG_MEMRMP: MEM_MODE
    "str r1, [r0]",
    "dsb",
    "bx lr",
    ".ltorg",
);

/// Ends halts by the procedure in RM0440.
pub(crate) struct EndpointHalts;

impl EndpointHalt for EndpointHalts {
    /// Disables the endpoint first: the peripheral then does not write its register, so no packet
    /// can change the toggle between the read and the write.
    fn end(bus: &mut impl Bus, address: EndpointAddress) {
        let register = USB.epr(address.index());
        let found = register.read();
        let status = match address.is_in() {
            true => found.stat_tx(),
            false => found.stat_rx(),
        };
        if status == Stat::DISABLED {
            return;
        }
        bus.endpoint_set_enabled(address, false);
        register.write_value(to_data0(register.read(), address.is_in()));
        bus.endpoint_set_enabled(address, true);
    }
}

/// Returns the value to write after `found` was read, to set one direction's toggle to DATA0 and
/// change nothing else. Ones invert a toggle's bit and the status; zeros clear the flags of
/// completed transfers.
fn to_data0(found: Epr, is_in: bool) -> Epr {
    let mut written = found;
    written.set_ctr_rx(true);
    written.set_ctr_tx(true);
    written.set_stat_rx(Stat::DISABLED);
    written.set_stat_tx(Stat::DISABLED);
    match is_in {
        true => written.set_dtog_rx(false),
        false => written.set_dtog_tx(false),
    }
    written
}
