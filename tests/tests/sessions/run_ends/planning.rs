//! Ctrl-C during the planning of a virtual arm's path.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::process::{Command, Stdio};

use hapterra_tests::hapterra_binary;
use hapterra_tests::socket_device::signal;
use hapterra_tests::timeouts::end_of;

/// Returns ground with so much no-data that each size of the plan is tried.
fn ground_of_holes() -> String {
    let mut text = String::from("ncols 200\nnrows 200\ncellsize 1\nnodata_value -9999\n");
    for row in 0..200_u32 {
        for column in 0..200_u32 {
            let height = match (column % 12 < 3, row % 12 < 3) {
                (true, true) => -9999.0,
                _ => f64::from((column * row) % 17),
            };
            let _ = write!(text, "{height} ");
        }
        text.push('\n');
    }
    text
}

#[test]
fn ctrl_c_ends_the_planning_of_a_path() {
    let folder = tempfile::tempdir().expect("a folder");
    let terrain = folder.path().join("holes.asc");
    std::fs::write(&terrain, ground_of_holes()).expect("written");
    let mut child = Command::new(hapterra_binary())
        .args(["run", "--tip", "8mm", "--level", "0"])
        // The paths are planned one after the other, which takes much longer than a signal.
        .args(["--device", "native"].repeat(8))
        .args(["--scale", "1mm/cell", "--exaggeration", "0.05mm/unit"])
        // Ends by itself if there is nothing left to interrupt.
        .args(["--duration", "0.1s"])
        .arg(&terrain)
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it runs");
    let stderr = child.stderr.take().expect("piped");
    let mut stderr = File::from(OwnedFd::from(stderr));
    let (mut shown, mut chunk) = (String::new(), [0; 4096]);
    while !shown.contains("planning a path over") {
        let n = stderr.read(&mut chunk).expect("open");
        if n == 0 {
            assert!(end_of(child).status.success(), "{shown}");
            println!("SKIPPED: each path was planned within the second before its first line");
            return;
        }
        shown += &String::from_utf8_lossy(&chunk[..n]);
    }
    signal(&child, "INT");
    let output = end_of(child);
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).expect("text");
    assert_eq!(output.status.code(), Some(1), "{rest}");
    assert!(rest.contains("interrupted\nhint: start again"), "{rest}");
    // Otherwise a line is printed every three seconds until the plan is complete.
    assert!(rest.matches("planning").count() <= 1, "{rest}");
}
