//! The haptic application, generic over its board.
//!
//! ```text
//!            encoders                                   amplifiers
//!               │                                            ▲
//!               ▼                                            │
//!   ┌───────────────────── haptic_loop (timer interrupt) ────────────────┐
//!   │  commands ─▶ Haptics::accept     Haptics::tick ─▶ record, spent    │
//!   └───────▲───────────────────────────────────────────────────┬────────┘
//!           │           single-producer queues, no lock         │
//!   ┌───────┴───────────────────── link (task) ─────────────────▼────────┐
//!   │  frames ─▶ scenes, tiles, points, arming       tiles ─▶ requests   │
//!   └───────▲──────────────────────────────────────────────────┬─────────┘
//!           │                                                  ▼
//!        from host                                          to host
//! ```
//!
//! | module | content |
//! | --- | --- |
//! | [`app`] | assembles the application from a board's parts |
//! | [`board`], [`amplifier`], [`encoder`], [`led`] | the hardware seam, and shared parts |
//! | `queues` | the queues between the two halves, and their messages |
//! | [`haptic_loop`] | the timer interrupt: encoders, the pure tick, amplifiers |
//! | [`link`] | the communication with the host: requests, tiles, telemetry |
//! | [`usb`] | the link's USB interface |
//! | [`monitor`] | check-ins and counters, which decide on feeding the watchdog |
//! | [`store`] | the calibration record in flash |
//! | [`crash`] | the record of a program's end, kept over the reset |
//! | [`motor_memory`] | the motors' temperatures, kept over the reset |
//! | `dead_man_press` | the press of the dead-man switch required to store a record |
//! | [`native`] | the same application as a value in a host program |
//!
//! The images are in `boards/`.
//!
//! # Priorities
//!
//! The most urgent comes first. A critical section masks everything from "ceiling" down, by
//! BASEPRI; the haptic interrupt is above and nothing delays it.
//!
//! | priority | code | may |
//! | --- | --- | --- |
//! | faults, panic | amplifiers off, record, reset or exit | not return |
//! | STM32 0 | the supply's interrupt: amplifiers off, record, reset | not return |
//! | `0x10` | haptic interrupt (TIM7; CMSDK timer 0): [`haptic_loop::HapticLoop::tick`] | use its queues; raise "tick done"; no critical section, no log, no waker |
//! | — | ceiling of critical sections, `0x20` | |
//! | STM32 `0x60`; MPS2 `0x40`-`0x60` | USB or UARTs, the time driver, "tick done" | wake tasks |
//! | MPS2 `0xC0`; STM32 thread | executor: link, USB stack, supervisor, plant line | log, wait |
//! | thread | MPS2: sleep | |
//!
//! embassy leaves the interrupts of an STM32 at priority 0. The images put every one
//! of them below the ceiling before any is enabled.
//!
//! # Time
//!
//! The application's time is the number of ticks, and time-outs are counted in ticks. In a scene
//! that sets [`hold_clock`], no time passes while a requested tile is missing; in a replay, no time
//! passes between two points. [`link::Link::may_stop_clock`] returns true in these cases. The
//! emulated board then stops its two timers, its only clocks; the native device is not ticked; a
//! real board cannot stop time and continues. So the host's speed does not change the rendering,
//! and a run is repeatable to the last bit.
//!
//! While time stands still, no time-out expires. The device requests a tile again at once when a
//! frame arrives damaged, but it cannot detect a lost frame. So `hold_clock` is for links that lose
//! nothing: sockets, pipes.
//!
//! [`hold_clock`]: hapterra_core::scene::Scene::hold_clock
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod amplifier;
pub mod app;
pub mod board;
pub mod crash;
mod dead_man_press;
pub mod encoder;
pub mod haptic_loop;
pub mod led;
pub mod link;
pub mod monitor;
pub mod motor_memory;
pub mod native;
mod queues;
pub mod store;
pub mod usb;

// Module of the build script, for its tests.
#[cfg(test)]
#[path = "../build/tick_rate.rs"]
mod tick_rate;
