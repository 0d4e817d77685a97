//! NUCLEO-H743ZI2 with a quad converter on SPI (AD5754R, ±10 V) for amplifiers
//! with an analogue input; all else is as on `nucleo-h743zi2`.
//!
//! | what | pin | part |
//! | --- | --- | --- |
//! | encoder 1 A, B | PC6, PC7 | TIM8 |
//! | encoder 2 A, B | PB4, PB5 | TIM3 |
//! | encoder 3 A, B | PD12, PD13 | TIM4 |
//! | converter SCLK, SDIN, SDO, SYNC | PE12, PE14, PE13, PE11 | SPI4 at 7.1 MHz, mode 1; SYNC by hand |
//! | amplifier enable, high is on, pull it down outside | PF3 | |
//! | emergency stop, closed to ground | PE15 | |
//! | dead-man switch, closed to ground while held | PF5 | |
//! | clutch, closed to ground while held | PF4 | |
//! | amplifier ready 1, 2, 3, closed to ground while ready | PF12, PF13, PF14 | |
//! | current monitors wired, closed to ground | PF15 | |
//! | current monitor 1, 2, 3 | PA3, PC0, PB1 | ADC1, 1.65 V is zero |
//! | USB D-, D+ | PA11, PA12 | OTG_FS |
//! | status LED | PB0 | the board's green LD1 |
//! | heartbeat, for a one-shot outside | PG1 | |
//! | mark, high for 10 ms | PG0 | |
#![no_std]
#![no_main]
// Interrupt handlers have the names of the vectors.
#![allow(non_snake_case)]

#[path = "../common/application.rs"]
mod application;
#[path = "../nucleo-h743zi2/chip.rs"]
mod chip;
#[path = "../nucleo-h743zi2/flash.rs"]
mod flash;
mod outputs;
#[path = "../nucleo-h743zi2/revision.rs"]
mod revision;
#[path = "../common/stm32/mod.rs"]
mod stm32;
mod stop;
#[path = "../nucleo-h743zi2/tick_memory.rs"]
mod tick_memory;
#[path = "../nucleo-h743zi2/usb.rs"]
mod usb;

use embassy_stm32::interrupt;

/// Runs the haptic tick, above all other interrupts except the supply's.
#[interrupt]
fn TIM7() {
    static mut LOOP: Option<&'static mut application::Loop> = None;
    stm32::start::on_haptic_interrupt(LOOP);
}
