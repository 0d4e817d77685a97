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

#[path = "../nucleo-h743zi2/board.rs"]
mod board;
mod outputs;

use board::{FLASH_BASE, amplifiers_off, flash, hardware_failed, write_back};
