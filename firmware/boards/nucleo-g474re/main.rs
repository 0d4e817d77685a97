//! NUCLEO-G474RE: Cortex-M4F at 168 MHz, three encoder timers, three DAC
//! outputs, USB full speed.
//!
//! | what | pin | part |
//! | --- | --- | --- |
//! | encoder 1 A, B | PA0, PA1 | TIM2 |
//! | encoder 2 A, B | PC6, PC7 | TIM3 |
//! | encoder 3 A, B | PB6, PB7 | TIM4 |
//! | current command 1, 2, 3 | PA4, PA5, PA6 | DAC1 and DAC2, 12 bits, 0.2-3.1 V, middle is zero |
//! | amplifier enable, high is on, pull it down outside | PB0 | |
//! | emergency stop, closed to ground | PC0 | |
//! | dead-man switch, closed to ground while held | PC1 | |
//! | clutch, closed to ground while held | PC9 | |
//! | amplifier ready 1, 2, 3, closed to ground while ready | PC10, PC11, PC12 | |
//! | current monitors wired, closed to ground | PC8 | |
//! | current monitor 1, 2, 3 | PC2, PC3, PB1 | ADC1, 1.65 V is zero |
//! | USB D-, D+ | PA11, PA12 | USB |
//! | status LED, to ground over a resistor | PA8 | |
//! | heartbeat, for a one-shot outside | PD2 | |
//! | mark, high for 10 ms | PB10 | |
//!
//! PA5 also drives the board's LED LD2: open its solder bridge.
#![no_std]
#![no_main]
// Interrupt handlers have the names of the vectors.
#![allow(non_snake_case)]

#[path = "../common/application.rs"]
mod application;
mod chip;
mod flash;
mod outputs;
#[path = "../common/stm32/mod.rs"]
mod stm32;
mod usb;

use embassy_stm32::interrupt;

/// Runs the haptic tick, above all other interrupts except the supply's.
#[interrupt]
fn TIM7_DAC() {
    static mut LOOP: Option<&'static mut application::Loop> = None;
    stm32::start::on_haptic_interrupt(LOOP);
}
