//! NUCLEO-H743ZI2 with a quad converter on SPI (AD5754R, ±10 V) for amplifiers
//! with an analogue input; all else is as on `nucleo-h743zi2`.
//!
//! | what | pin | part |
//! | --- | --- | --- |
//! | encoder 1 A, B | PC6, PC7 | TIM8 |
//! | encoder 2 A, B | PB4, PB5 | TIM3 |
//! | encoder 3 A, B | PD12, PD13 | TIM4 |
//! | converter SCLK, SDIN, SYNC | PE12, PE14, PE11 | SPI4 at 15 MHz, mode 1; SYNC by hand |
//! | amplifier enable, high is on, pull it down outside | PF3 | |
//! | emergency stop, closed to ground | PF4 | |
//! | dead-man switch, closed to ground while held | PF5 | |
//! | USB D-, D+ | PA11, PA12 | OTG_FS |
//! | status LED | PB0 | the board's green LD1 |
#![no_std]
#![no_main]
// Interrupt handlers bear the names of the vectors.
#![allow(non_snake_case)]

#[path = "../common/application.rs"]
mod application;
#[path = "../nucleo-h743zi2/chip.rs"]
mod chip;
#[path = "../nucleo-h743zi2/flash.rs"]
mod flash;
mod outputs;
#[path = "../common/stm32/mod.rs"]
mod stm32;

use embassy_stm32::interrupt;

/// The haptic tick, above everything else.
#[interrupt]
fn TIM7() {
    static mut LOOP: Option<&'static mut application::Loop> = None;
    stm32::start::on_haptic_interrupt(LOOP);
}
