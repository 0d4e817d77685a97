//! Sessions of `hapterra` from start to end: with a device, in recordings and replay, bring-up.

mod bringup;
mod calibrate;
mod closed_loop;
mod device_commands;
mod events;
mod killed_run;
mod materials;
mod native_vs_emulated;
mod placement_changes;
mod placement_options;
mod recordings;
mod replay;
mod replay_files;
mod replay_time;
mod run_ends;
mod several_devices;
mod touch_replay;
