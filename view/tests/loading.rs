//! Time until a browser shows the terrain.
//!
//! `HAPTERRA=PROGRAM TERRAIN=FILE cargo test --release --test loading -- --ignored --nocapture`
//! measures it; without a file it uses the demo's own terrain.

mod common;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use common::browser::{Browser, program};
use common::{HANG, Running, folder, hapterra};

/// The terrain's area in the page.
const TERRAIN: [f64; 4] = [0.0, 0.05, 0.56, 0.88];
/// Minimum number of tints of relief in a picture with the terrain.
const TINTS: usize = 400;

#[test]
#[ignore = "a figure of this machine"]
fn browser_shows_the_terrain_within_its_time() {
    let (Some(mut demo), Some(program)) = (hapterra(), program()) else {
        println!("SKIPPED: no hapterra, or no Chromium here");
        return;
    };
    let folder = folder("loading");
    let mut browser = Browser::start(&program, &folder);
    demo.args(["demo", "--device", "native", "--rounds", "900", "--view"])
        .args(std::env::var_os("TERRAIN").map(PathBuf::from))
        .arg("--out")
        .arg(&folder);
    let mut demo = Running::start_with_viewer(&mut demo, "");
    // This line begins the session with the device.
    demo.wait_for_line("device ");
    let session = Instant::now();
    let address = demo.address();
    let elapsed = session.elapsed();
    let page = browser.open(&address);
    let (mut started, mut reported) = (None, None);
    loop {
        let mut is_so = |expression: &str| { browser.value(&page, expression) } == true;
        if started.is_none() && is_so("window.hapterra?.isStarted") {
            started = Some(session.elapsed());
        }
        if reported.is_none() && is_so("window.hapterra?.pieces > 0") {
            reported = Some(session.elapsed());
        }
        let picture = browser.picture(&page);
        let colours = browser.colours(&page, &picture, TERRAIN, &[]);
        if colours.count > TINTS {
            break;
        }
        assert!(session.elapsed() < HANG, "{colours:?}");
        std::thread::sleep(Duration::from_millis(50));
    }
    let shown = session.elapsed();
    println!(
        "from the session's begin: address {elapsed:?}, viewer started {started:?}, first piece {reported:?}, terrain seen {shown:?}"
    );
    drop(browser);
    demo.interrupt();
    assert!(demo.end());
    let _ = std::fs::remove_dir_all(folder);
}
