//! Pictures of the live view for the documentation, with the demo's own terrain.
//!
//! `cargo xtask view --pictures` writes them into `docs/`.

mod common;

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use common::browser::{Browser, Colours, Page, program};
use common::{HANG, Running, folder, hapterra};

const SIZE: [u32; 2] = [1440, 900];
const TERRAIN: [f64; 4] = [0.0, 0.05, 0.56, 0.88];
/// The force's arrow, and the trace of a hand that slides.
const MARKS: [[u8; 3]; 2] = [[255, 230, 60], [255, 170, 90]];
/// Minimum pixels of these colours: arrow and trace are long enough to be visible.
const ARROW: usize = 120;
const TRACE: usize = 400;
/// Commands for the zoomed picture.
const ZOOM: &str = "zoom 1.6\nzoom 1.6\n";

/// A page of a demo that continues.
struct Shown {
    browser: Browser,
    page: Page,
    began: Instant,
    demo: Running,
    folder: PathBuf,
}

impl Shown {
    /// Starts a demo and types commands before a page opens: a page that software draws shows
    /// everything in its order, and much later.
    fn start(name: &str, typed: &str) -> Self {
        let folder = folder(name);
        let mut demo = hapterra().expect("HAPTERRA names a program");
        demo.args(["demo", "--device", "native", "--rounds", "900", "--view"])
            .args(["--commands", "-", "--out"])
            .arg(&folder)
            .stdin(Stdio::piped());
        let mut demo = Running::start_with_viewer(&mut demo, "");
        let address = demo.address();
        demo.type_lines(typed);
        let began = Instant::now();
        let mut browser = Browser::start(&program().expect("a Chromium"), &folder);
        let page = browser.open_sized(&address, SIZE);
        Self {
            browser,
            page,
            began,
            demo,
            folder,
        }
    }

    /// Stores the first picture in which the terrain's colours are right.
    fn keep(&mut self, path: &Path, is_right: impl Fn(&Colours) -> bool) {
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let photo = self.browser.photograph(&self.page);
            // Colours of exactly the stored picture: a browser decodes both formats.
            let picture = BASE64_STANDARD.encode(&photo);
            let colours = { &mut self.browser }.colours(&self.page, &picture, TERRAIN, &MARKS);
            if is_right(&colours) {
                return std::fs::write(path, photo).expect("written");
            }
            assert!(self.began.elapsed() < HANG, "{colours:?}");
        }
    }

    fn end(self) {
        let Self {
            browser,
            mut demo,
            folder,
            ..
        } = self;
        drop(browser);
        demo.interrupt();
        assert!(demo.end());
        let _ = std::fs::remove_dir_all(folder);
    }
}

#[test]
#[ignore = "runs for a minute, and writes into docs/"]
fn pictures_at_the_start_while_sliding_and_zoomed() {
    let into = std::env::var_os("HAPTERRA_PICTURES").expect("HAPTERRA_PICTURES names a folder");
    let into = Path::new(&into);
    let is_shown = |terrain: &Colours| terrain.count > 400;
    let is_touched = |terrain: &Colours| terrain.near[0] > ARROW && terrain.near[1] > TRACE;
    let mut shown = Shown::start("pictures", "");
    // Before the hand is on the ground, nothing touches.
    shown.keep(&into.join("view-start.jpg"), |terrain| {
        is_shown(terrain) && terrain.near[0] == 0
    });
    shown.keep(&into.join("view.jpg"), is_touched);
    shown.end();
    let mut shown = Shown::start("zoomed", ZOOM);
    shown.keep(&into.join("view-zoomed.jpg"), is_touched);
    shown.end();
}
