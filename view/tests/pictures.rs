//! Pictures of the live view for the documentation: of the terrain that the demo has itself.
//!
//! `cargo xtask view --pictures` writes them into `docs/`.

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::browser::{Browser, Colours, Page, program};
use common::{Running, folder, hapterra};

const SIZE: [u32; 2] = [1440, 900];
const TERRAIN: [f64; 4] = [0.0, 0.05, 0.56, 0.88];
/// The force's arrow.
const FORCE: [u8; 3] = [255, 230, 60];
/// Pixels of it: the arrow is long enough to be seen.
const ARROW: usize = 120;
const WITHIN: Duration = Duration::from_secs(300);
/// When the view is zoomed, s of the device's time: while the hand is on the ground.
const COMMANDS: &str = "at 6 zoom 1.6\nat 6.8 zoom 1.6\n";
/// Until that is seen on a machine that draws slowly.
const ZOOMED: Duration = Duration::from_secs(110);

/// A page of a demo that goes on.
struct Shown {
    browser: Browser,
    page: Page,
    began: Instant,
}

impl Shown {
    /// Keeps the first picture in which the terrain's colours are right.
    fn keep(&mut self, path: &Path, is_right: impl Fn(&Colours) -> bool) {
        loop {
            std::thread::sleep(Duration::from_millis(500));
            // Both within a moment; the arrow has not gone far.
            let kept = self.browser.photograph(&self.page);
            let picture = self.browser.picture(&self.page);
            let colours = { &mut self.browser }.colours(&self.page, &picture, TERRAIN, &[FORCE]);
            if is_right(&colours) {
                return std::fs::write(path, kept).expect("written");
            }
            assert!(self.began.elapsed() < WITHIN, "{colours:?}");
        }
    }
}

#[test]
#[ignore = "takes a minute, and writes into docs/"]
fn pictures_at_the_start_while_sliding_and_zoomed() {
    let into = std::env::var_os("HAPTERRA_PICTURES").expect("HAPTERRA_PICTURES names a folder");
    let folder = folder("pictures");
    let commands = folder.join("commands");
    std::fs::write(&commands, COMMANDS).expect("written");
    let mut demo = hapterra().expect("HAPTERRA names a program");
    demo.args(["demo", "--device", "native", "--rounds", "30", "--view"])
        .arg("--commands")
        .arg(&commands)
        .arg("--out")
        .arg(&folder);
    let mut demo = Running::shown(&mut demo, "");
    let address = demo.address();
    let began = Instant::now();
    let mut browser = Browser::start(&program().expect("a Chromium"), &folder);
    let page = browser.open_sized(&address, SIZE);
    let mut shown = Shown {
        browser,
        page,
        began,
    };
    let into = Path::new(&into);
    let is_shown = |terrain: &Colours| terrain.count > 400;
    // Before the hand is on the ground the arm has nothing to say.
    shown.keep(&into.join("view-start.jpg"), |terrain| {
        is_shown(terrain) && terrain.near[0] == 0
    });
    let is_touched = |terrain: &Colours| terrain.near[0] > ARROW;
    shown.keep(&into.join("view.jpg"), is_touched);
    std::thread::sleep(ZOOMED.saturating_sub(began.elapsed()));
    shown.keep(&into.join("view-zoomed.jpg"), is_touched);
    drop(shown);
    demo.interrupt();
    assert!(demo.end());
    let _ = std::fs::remove_dir_all(folder);
}
