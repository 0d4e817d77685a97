//! A device that requests much and reads little.

use std::time::Duration;

use hapterra_tests::greedy_device;
use hapterra_tests::socket_device::{command, has_begun, output_text, signal};
use hapterra_tests::timeouts::{end_of, pass};

/// Safety: 26.
#[test]
fn greedy_device_does_not_block_the_end_of_a_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = command(greedy_device::start(), folder.path());
    let mut child = command.arg("--unchecked").spawn().expect("it runs");
    has_begun(child.stdout.as_mut().expect("piped"));
    // The queue for the device grows.
    pass(Duration::from_secs(2));
    signal(&child, "INT");
    let output = end_of(child);
    let text = output_text(&output);
    assert!(text.contains("switch the amplifiers off"), "{text}");
}
