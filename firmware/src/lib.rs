//! The haptic application, generic over its board.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod board;
