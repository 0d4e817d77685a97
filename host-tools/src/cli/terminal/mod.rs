//! The terminal while a command runs: output and input, progress, Ctrl-C, partial files of killed
//! commands, and the prompts for arming. If several devices are served, `shared_keyboard` assigns
//! keys to devices and `device_console` names them in lines.

pub(super) mod arming_prompts;
pub(super) mod device_console;
pub mod interrupt;
pub(super) mod keyboard;
pub mod partial_files;
pub mod progress;
pub(super) mod questions;
mod raw_keys;
pub(super) mod raw_mode;
pub(super) mod shared_keyboard;
pub(super) mod waiting;
pub(super) mod writer;
