//! The page that touches a terrain, in a real browser: `cargo xtask page --test`.

// The viewer's tests use all of it.
#[allow(dead_code, unreachable_pub)]
#[path = "../../view/tests/common/browser.rs"]
mod browser;
#[path = "../src/page/server.rs"]
mod server;
#[allow(dead_code, unreachable_pub)]
#[path = "../../tests/src/timeouts.rs"]
mod timeouts;

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::json;

use browser::{Browser, Page};
use server::Server;
use timeouts::{HANG, wait_until};

/// Software draws the pages: one at a time, and small ones.
static ONE: Mutex<()> = Mutex::new(());
const SIZE: [u32; 2] = [720, 480];
/// Colours of the proxy and of the force's arrow, as they are lit.
const MARKS: [[u8; 3]; 2] = [[255, 140, 35], [255, 215, 50]];

/// A page in a browser, and what it is served from.
struct Site {
    browser: Browser,
    page: Page,
    address: String,
    folder: tempfile::TempDir,
}

/// What `cargo xtask page --test` has built; none, and a line that says so, without it.
fn built(what: &str) -> Option<PathBuf> {
    let found = std::env::var_os(what).map(PathBuf::from);
    if found.is_none() {
        println!("SKIPPED: {what} is not set; cargo xtask page --test sets it");
    }
    found
}

impl Site {
    /// Serves the page, with a terrain where there is one, and waits until it is touched.
    fn open(terrain: Option<&Path>) -> Option<Self> {
        let built = built("HAPTERRA_PAGE")?;
        let Some(program) = browser::program() else {
            println!("SKIPPED: no Chromium here; HAPTERRA_BROWSER can name one");
            return None;
        };
        let folder = tempfile::tempdir().expect("a folder");
        let site = folder.path().join("site");
        let copied = Command::new("cp").arg("-r").args([&built, &site]).status();
        assert!(copied.expect("cp").success());
        if let Some(terrain) = terrain {
            let words = ["cut", "--most-samples", "5000", "--output"];
            hapterra(folder.path(), &words, &[&site, terrain])?;
        }
        let server = Server::bind(&site).expect("a port");
        let address = server.address();
        std::thread::spawn(|| server.serve());
        let mut browser = Browser::start(&program, folder.path());
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

    fn value(&mut self, expression: &str) -> serde_json::Value {
        self.browser.value(&self.page, expression)
    }

    fn text(&mut self, id: &str) -> String {
        let value = self.value(&format!("document.getElementById('{id}').textContent"));
        value.as_str().unwrap_or_default().to_owned()
    }

    /// Waits until an expression is true.
    fn wait(&mut self, expression: &str) {
        wait_until(expression, || self.value(expression) == true);
    }

    /// Moves the mouse to a place, in shares of the page.
    fn point(&mut self, [left, top]: [f64; 2]) {
        let event = json!({ "type": "mouseMoved", "x": left * f64::from(SIZE[0]), "y": top * f64::from(SIZE[1]) });
        let session = self.page.session().to_owned();
        let _ = self
            .browser
            .call("Input.dispatchMouseEvent", event, Some(&session));
    }

    /// Drops a file on the page.
    fn drop_file(&mut self, name: &str, bytes: &[u8]) {
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

    /// Fails if the page asked any other machine for anything.
    fn check_requests(&self) {
        let own = [self.address.as_str(), "data:", "blob:", "about:"];
        let requests = &self.browser.requests;
        let is_own = |asked: &&String| own.iter().any(|own| asked.starts_with(own));
        let foreign: Vec<_> = requests.iter().filter(|asked| !is_own(asked)).collect();
        assert!(foreign.is_empty(), "{foreign:?}");
        assert!(requests.iter().any(|asked| asked.ends_with("/kernel.wasm")));
    }
}

/// Runs the command in a folder; none where it was not built.
fn hapterra(folder: &Path, words: &[&str], files: &[&Path]) -> Option<()> {
    let mut command = Command::new(built("HAPTERRA")?);
    command.current_dir(folder).args(words).args(files);
    let done = command.output().expect("hapterra starts");
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{words:?}: {said}");
    Some(())
}

/// The rows of a CSV file's columns, as numbers of single precision.
fn forces(path: &Path) -> Vec<[u32; 3]> {
    let text = fs::read_to_string(path).expect("a file");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<_> = lines.next().expect("a header").split(',').collect();
    let columns = ["force_x_n", "force_y_n", "force_z_n"]
        .map(|name| names.iter().position(|other| *other == name).expect(name));
    lines
        .map(|line| {
            let words: Vec<_> = line.split(',').collect();
            columns.map(|column| words[column].parse::<f32>().expect("a number").to_bits())
        })
        .collect()
}

#[test]
fn saved_path_feels_the_same_in_replay_bit_for_bit() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(mut site) = Site::open(None) else {
        return;
    };
    let saved = site.folder.path().join("saved");
    fs::create_dir(&saved).expect("a folder");
    let allow = json!({ "behavior": "allow", "downloadPath": saved });
    let _ = site
        .browser
        .call("Browser.setDownloadBehavior", allow, None);
    // Rough and grainy: every effect of the page.
    let _ = site.value("[...document.querySelectorAll('#presets button')].at(-1).click()");
    site.wait("hapterra.touch.surface.friction === 0.5 && hapterra.touch.surface.texture === 0.22");
    for step in 1..40 {
        let share = f64::from(step) / 40.0;
        site.point([0.35 + 0.3 * share, 0.5 + 0.1 * (9.0 * share).sin()]);
        let rows = site.value("hapterra.touch.path.rows").as_u64().unwrap_or(0);
        site.wait(&format!("hapterra.touch.path.rows >= {}", rows + 50));
    }
    let picture = site.browser.picture(&site.page);
    let whole = [0.0, 0.0, 1.0, 1.0];
    let colours = site.browser.colours(&site.page, &picture, whole, &MARKS);
    assert!(colours.count > 400, "{colours:?}");
    assert!(colours.near.iter().all(|pixels| *pixels > 5), "{colours:?}");
    let _ = site.value("document.getElementById('save').click()");
    let files = ["path.csv", "terrain.npy"].map(|name| saved.join(name));
    wait_until("the saved files", || {
        files.iter().all(|file| file.is_file())
    });
    let line = site.text("saved");
    let words: Vec<_> = line.split(' ').skip(1).collect();
    if hapterra(&saved, &words, &[]).is_none() {
        return;
    }
    let (felt, replayed) = (forces(&files[0]), forces(&saved.join("felt.csv")));
    let touching = felt.iter().filter(|force| **force != [0; 3]).count();
    println!("{} rows, {touching} with a force", felt.len());
    assert!(touching > 1000, "{touching} of {}", felt.len());
    assert_eq!(felt.len(), replayed.len());
    let differing = felt.iter().zip(&replayed).position(|(a, b)| a != b);
    assert_eq!(differing, None, "{line}");
    site.check_requests();
}

#[test]
fn dropped_files_of_one_terrain_have_the_same_heights() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(mut site) = Site::open(None) else {
        return;
    };
    let folder = site.folder.path().to_owned();
    let has_geotiff = folder.join("site/geotiff.js").is_file();
    let mut heights = vec![];
    for name in ["hill.asc", "hill.png", "hill.tif"] {
        if name == "hill.tif" && !has_geotiff {
            println!("SKIPPED: GeoTIFF: the page was built without npm");
            continue;
        }
        let words = [
            "synth",
            "fractal",
            "--amplitude",
            "3000",
            "--size",
            "70x50",
            "--output",
            name,
        ];
        if hapterra(&folder, &words, &[]).is_none() {
            return;
        }
        site.drop_file(name, &fs::read(folder.join(name)).expect("a file"));
        site.wait(&format!("hapterra.touch.terrain.name === '{name}'"));
        let shape = site.value("[hapterra.touch.terrain.nx, hapterra.touch.terrain.ny]");
        assert_eq!(shape, json!([70, 50]), "{name}");
        // As shares of the relief: a PNG has whole metres, and no cell.
        let shares = site.value(
            "Array.from(hapterra.touch.terrain.heights, (h) => h / hapterra.touch.terrain.topMm)",
        );
        let shares = shares.as_array().expect("heights").clone();
        heights.push(
            shares
                .iter()
                .map(|share| share.as_f64().expect("a height"))
                .collect::<Vec<_>>(),
        );
    }
    for others in &heights[1..] {
        let apart = others.iter().zip(&heights[0]).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 0.02);
    }
    site.drop_file("notes.txt", b"not a terrain");
    site.wait("document.getElementById('said').textContent.startsWith('notes.txt: its kind is not known')");
    assert_eq!(site.value("hapterra.touch.terrain.nx"), 70);
    site.check_requests();
}

#[test]
fn cursor_stays_behind_the_hand_on_a_slope() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ramp.asc");
    // Up to the east, by one in two; 60,501 heights, of which the page gets every fourth.
    let row = (0..301)
        .map(|i| (5 * i).to_string())
        .collect::<Vec<_>>()
        .join(" ");
    let rows = vec![row; 201].join("\n");
    fs::write(
        &path,
        format!("ncols 301\nnrows 201\nxllcorner 0\nyllcorner 0\ncellsize 10\n{rows}\n"),
    )
    .expect("written");
    let Some(mut site) = Site::open(Some(&path)) else {
        return;
    };
    let name = site.text("name");
    assert!(
        name.contains("ramp.asc")
            && name.contains("of 301 × 201")
            && name.contains("true to scale"),
        "{name}"
    );
    site.point([0.5, 0.5]);
    // One newton on a slope of one in two pushes by half a newton: 4.2 mm of the hand's spring.
    site.wait("(({ arm, state }) => state === 'touching' && Math.hypot(...arm.speed) < 0.01 && Math.abs(arm.hand[0] - arm.at[0] - 0.5 / 0.12) < 0.05)(hapterra.touch)");
    let behind = "(() => {
        const [x] = document.getElementById('cursor').getAttribute('transform').match(/[\\d.]+/);
        return document.getElementById('hand').getAttribute('cx') - x;
    })()";
    let behind = site.value(behind).as_f64().expect("px");
    assert!(behind > 3.0, "{behind} px");
    let push = site.value("hapterra.touch.force").to_string();
    assert!(
        push.starts_with("[-0.5") || push.starts_with("[-0.49"),
        "{push}"
    );
    site.check_requests();
}

#[test]
fn server_answers_its_own_page_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("js")).expect("a folder");
    fs::write(folder.path().join("index.html"), "page").expect("written");
    fs::write(folder.path().join("js/a.js"), "script").expect("written");
    let server = Server::bind(folder.path()).expect("a port");
    let address = server.address();
    let own = address
        .trim_start_matches("http://")
        .trim_end_matches('/')
        .to_owned();
    std::thread::spawn(|| server.serve());
    let ask = |line: &str, host: &str| {
        let mut stream = TcpStream::connect(&own).expect("a server");
        write!(stream, "{line} HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    };
    assert!(ask("GET /", &own).ends_with("\r\n\r\npage"));
    let script = ask("GET /js/a.js?v=1", &own);
    assert!(
        script.contains("text/javascript") && script.ends_with("script"),
        "{script}"
    );
    for (line, host, status) in [
        ("GET /", "evil.example", "421"),
        ("GET /../Cargo.toml", own.as_str(), "404"),
        ("GET //etc/passwd", own.as_str(), "404"),
        ("POST /", own.as_str(), "405"),
    ] {
        let answer = ask(line, host);
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status}")),
            "{answer}"
        );
    }
}
