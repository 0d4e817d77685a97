//! A page that is served to a browser and touched.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::json;

use crate::browser::{self, Browser, Colours, Page};
use crate::server::Server;
use crate::timeouts::wait_until;

/// Software draws the pages: one at a time, and small ones.
static ONE: Mutex<()> = Mutex::new(());
pub(crate) const SIZE: [u32; 2] = [720, 480];
/// The part of a picture with only ground, without sliders: left, top, width, height.
const GROUND: [f64; 4] = [0.1, 0.2, 0.52, 0.65];
/// Colours of the proxy and of the force's arrow, including the light.
const MARKS: [[u8; 3]; 2] = [[255, 140, 35], [255, 215, 50]];

/// Waits until no other test has a page.
pub(crate) fn one() -> MutexGuard<'static, ()> {
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A page in a browser, and the folder from which it is served.
pub(crate) struct Site {
    pub(crate) browser: Browser,
    pub(crate) page: Page,
    address: String,
    pub(crate) folder: tempfile::TempDir,
}

/// Returns a result of `cargo xtask page --test`; `None`, with a message, if it was not built.
fn built(what: &str) -> Option<PathBuf> {
    let found = std::env::var_os(what).map(PathBuf::from);
    if found.is_none() {
        println!("SKIPPED: {what} is not set; cargo xtask page --test sets it");
    }
    found
}

impl Site {
    /// Serves the page, with a terrain if there is one, and waits until it is touched.
    pub(crate) fn open(terrain: Option<&Path>) -> Option<Self> {
        let built = built("HAPTERRA_PAGE")?;
        let Some(browser) = browser::program() else {
            println!("SKIPPED: no Chromium here; HAPTERRA_BROWSER can name one");
            return None;
        };
        let folder = tempfile::tempdir().expect("a folder");
        let site = folder.path().join("site");
        let copied = Command::new("cp").arg("-r").args([&built, &site]).status();
        assert!(copied.expect("cp").success());
        if let Some(terrain) = terrain {
            let words = ["cut", "--max-samples", "5000", "--out"];
            program("HAPTERRA", folder.path(), &words, &[&site, terrain])?;
        }
        let server = Server::bind(&site).expect("a port");
        let address = server.address();
        std::thread::spawn(|| server.serve());
        let mut browser = Browser::start(&browser, folder.path());
        let page = browser.open_sized(&address, SIZE);
        let mut site = Self {
            browser,
            page,
            address,
            folder,
        };
        site.wait("globalThis.hapterra?.touch.path.rows > 0");
        Some(site)
    }

    pub(crate) fn value(&mut self, expression: &str) -> serde_json::Value {
        self.browser.value(&self.page, expression)
    }

    pub(crate) fn text(&mut self, id: &str) -> String {
        let value = self.value(&format!("document.getElementById('{id}').textContent"));
        value.as_str().unwrap_or_default().to_owned()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&mut self, expression: &str) {
        wait_until(expression, || self.value(expression) == true);
    }

    /// Moves the mouse to a position, in shares of the page.
    pub(crate) fn point(&mut self, place: [f64; 2]) {
        let [x, y] = px(place);
        self.input("Mouse", json!({ "type": "mouseMoved", "x": x, "y": y }));
    }

    /// Sends an event of a device: `Mouse` or `Touch`.
    pub(crate) fn input(&mut self, device: &str, event: serde_json::Value) {
        let session = self.page.session().to_owned();
        let method = format!("Input.dispatch{device}Event");
        let _ = self.browser.call(&method, event, Some(&session));
    }

    /// Moves a slider as a user does.
    pub(crate) fn slide(&mut self, id: &str, value: f64) {
        let _ = self.value(&format!(
            "(() => {{
                const slider = document.getElementById('{id}');
                slider.value = {value};
                for (const name of ['input', 'change']) slider.dispatchEvent(new Event(name, {{ bubbles: true }}));
            }})()"
        ));
    }

    /// Counts colours of the ground seen from above the ball, near and with the hand at rest.
    pub(crate) fn pixels_near_the_ball(&mut self) -> Colours {
        let _ = self.value(
            "(({ scene, pointer, touch }) => {
                pointer.at = [];
                Object.assign(scene.camera, { distance: 150, pitch: 1.2, centre: [...touch.proxy] });
            })(hapterra)",
        );
        let drawn = "new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(() => drawn(true))))";
        self.wait(drawn);
        let picture = self.browser.picture(&self.page);
        self.browser.colours(&self.page, &picture, GROUND, &MARKS)
    }

    /// Drops a file on the page.
    pub(crate) fn drop_file(&mut self, name: &str, bytes: &[u8]) {
        let coded = BASE64_STANDARD.encode(bytes);
        let _ = self.value(&format!(
            "(() => {{
                const bytes = Uint8Array.from(atob('{coded}'), (c) => c.charCodeAt(0));
                const carried = new DataTransfer();
                carried.items.add(new File([bytes], '{name}'));
                dispatchEvent(new DragEvent('drop', {{ dataTransfer: carried, cancelable: true }}));
            }})()"
        ));
    }

    /// Fails if the page has sent a request to another machine.
    pub(crate) fn check_requests(&self) {
        let own = [self.address.as_str(), "data:", "blob:", "about:"];
        let requests = &self.browser.requests;
        let is_own = |asked: &&String| own.iter().any(|own| asked.starts_with(own));
        let foreign: Vec<_> = requests.iter().filter(|asked| !is_own(asked)).collect();
        assert!(foreign.is_empty(), "{foreign:?}");
        assert!(requests.iter().any(|asked| asked.ends_with("/kernel.wasm")));
    }
}

/// Runs the program named by a variable in a folder; `None` if it was not built.
pub(crate) fn program(name: &str, folder: &Path, words: &[&str], files: &[&Path]) -> Option<()> {
    let mut command = Command::new(built(name)?);
    command.current_dir(folder).args(words).args(files);
    let done = command.output().expect("it starts");
    let stderr = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{words:?}: {stderr}");
    Some(())
}

/// Returns a position in shares of the page, in its pixels.
pub(crate) fn px(place: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| place[axis] * f64::from(SIZE[axis]))
}
