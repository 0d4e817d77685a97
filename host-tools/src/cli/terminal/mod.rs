//! What happens at the terminal while a command runs: what is written and typed there,
//! progress, Ctrl-C, what killed commands left, and the prompts that lead to an armed arm. Where several
//! devices are served, `desk` shares the keyboard out and `speaker` names who speaks.

pub(super) mod arming_prompts;
pub(super) mod desk;
pub mod interrupt;
pub(super) mod keyboard;
pub mod left_behind;
pub mod progress;
pub(super) mod questions;
pub(super) mod raw_keys;
pub(super) mod speaker;
pub(super) mod voice;
pub(super) mod waiting;
