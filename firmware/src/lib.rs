//! The haptic application, generic over its board.
//!
//! ```text
//!            encoders                                   amplifiers
//!               │                                            ▲
//!               ▼                                            │
//!   ┌───────────────────── haptic_loop (timer interrupt) ────────────────┐
//!   │  commands ─▶ Haptics::accept     Haptics::tick ─▶ record, spent    │
//!   └───────▲───────────────────────────────────────────────────┬────────┘
//!           │      single-producer queues (channels), no lock   │
//!   ┌───────┴───────────────────── link (task) ─────────────────▼────────┐
//!   │  frames ─▶ session ─▶ scenes, tiles, points    focus ─▶ requests   │
//!   └───────▲──────────────────────────────────────────────────┬─────────┘
//!           │                                                  ▼
//!        from host                                          to host
//! ```
//!
//! [`board`] is the hardware seam; [`channels`] builds the application from it;
//! [`vitals`] and [`supervisor`] keep the watchdog; [`store`] keeps the
//! calibration; [`crash`] is what is left of a program that ended; [`native`] is the same application as a value in a host program, without
//! interrupts or tasks. The images are in `boards/`.
//!
//! # Priorities
//!
//! From the top. A critical section masks everything from "ceiling" down, by
//! BASEPRI; the haptic interrupt is above and is delayed by nothing.
//!
//! | priority | what | may |
//! | --- | --- | --- |
//! | faults, panic | amplifiers off, report, reset or exit | not return |
//! | 0 | haptic interrupt (TIM7; CMSDK timer 0): [`haptic_loop::HapticLoop::tick`] | use its queues; raise "tick done"; no critical section, no log, no waker |
//! | — | ceiling of critical sections, `0x10` | |
//! | STM32 `0x60`; MPS2 `0x40`-`0x60` | USB or UARTs, the time driver, "tick done" | wake tasks |
//! | MPS2 `0xC0`; STM32 thread | executor: link, USB stack, supervisor, plant line | log, wait |
//! | thread | MPS2: sleep | |
//!
//! On the STM32 embassy leaves interrupts at priority 0. The images put every
//! one of them below the ceiling before any is let through.
//!
//! # Time
//!
//! The application's time is the number of ticks; time-outs are counted in
//! them. A scene that sets [`hold_clock`] wants that a tile which the host owes
//! takes no time, and a replay wants no time to pass between its points:
//! [`link::Link::may_stand_still`] says when. The emulated board then stops its
//! two timers, which are all it knows of time; the native device is not ticked;
//! a real board cannot stop time and goes on. Nothing that depends on how fast
//! the host is can then be felt, and a run repeats to the last bit.
//!
//! Where time stands still, a time-out never comes. A frame that arrives
//! damaged is answered by asking again at once; a frame that is lost without a
//! trace is not noticed, so `hold_clock` is for links that lose nothing
//! (sockets, pipes).
//!
//! [`hold_clock`]: hapterra_core::wire::message::Scene::hold_clock
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod amplifier;
pub mod board;
pub mod channels;
pub mod crash;
pub mod encoder;
pub mod haptic_loop;
pub mod led;
pub mod link;
pub mod native;
pub mod store;
pub mod supervisor;
mod timing;
pub mod usb;
pub mod vitals;

// The build script's, for its tests.
#[cfg(test)]
#[path = "../build/tick_rate.rs"]
mod tick_rate;
