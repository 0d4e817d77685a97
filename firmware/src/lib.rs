//! The haptic application, generic over its board.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod amplifier;
pub mod board;
pub mod channels;
pub mod encoder;
pub mod haptic_loop;
pub mod link;
pub mod native;
pub mod supervisor;
mod timing;
pub mod usb;
