//! Chromium without a screen, controlled over its debugging pipe.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Value, json};

use super::HANG;

/// Errors of a page that is still loading: the query is repeated.
const LOADING: [&str; 4] = [
    "Not attached to an active page",
    "Cannot find default execution context",
    "Execution context was destroyed",
    "Inspected target navigated",
];
/// The page's size, px.
const SIZE: [u32; 2] = [900, 600];

/// Returns the browser: the one named by the variable, else one on the `PATH`.
pub fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("HAPTERRA_BROWSER") {
        return Some(named.into());
    }
    let names = [
        "chromium-headless-shell",
        "chromium",
        "chromium-browser",
        "google-chrome",
    ];
    let path = std::env::var_os("PATH")?;
    let folders: Vec<_> = std::env::split_paths(&path).collect();
    let mut places = names
        .iter()
        .flat_map(|name| folders.iter().map(move |f| f.join(name)));
    places.find(|place| place.is_file())
}

/// A browser with its pages.
pub struct Browser {
    child: Child,
    to: File,
    received: Receiver<Value>,
    count: u64,
    /// Requests of pages, by their addresses.
    pub requests: Vec<String>,
}

/// A page of a browser.
#[derive(Clone)]
pub struct Page {
    target: String,
    session: String,
}

impl Page {
    /// Returns the session that identifies the page to the browser.
    pub fn session(&self) -> &str {
        &self.session
    }
}

/// Colours of a picture of a page.
#[derive(Debug)]
pub struct Colours {
    /// Their number.
    pub count: usize,
    /// Pixels near each requested colour.
    pub near: Vec<usize>,
    /// A hash of the picture.
    pub hash: u64,
}

impl Browser {
    /// Starts a browser; `folder` is for its data.
    pub fn start(program: &Path, folder: &Path) -> Self {
        let pipes = ["in", "out"].map(|name| folder.join(name));
        let made = Command::new("mkfifo")
            .args(&pipes)
            .status()
            .expect("mkfifo");
        assert!(made.success());
        // Its pipes are files 3 and 4, which only a shell can pass to it.
        let line = "exec \"$0\" \"$@\" 3<\"$PIPE_IN\" 4>\"$PIPE_OUT\"";
        let child = Command::new("sh")
            .args(["-c", line])
            .arg(program)
            .args(["--headless", "--no-sandbox", "--remote-debugging-pipe"])
            .args(["--use-gl=angle", "--use-angle=swiftshader"])
            .args(["--enable-unsafe-swiftshader", "--no-first-run"])
            .arg(format!(
                "--user-data-dir={}",
                folder.join("profile").display()
            ))
            .env("PIPE_IN", &pipes[0])
            .env("PIPE_OUT", &pipes[1])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the browser starts");
        let to = OpenOptions::new()
            .write(true)
            .open(&pipes[0])
            .expect("a pipe");
        let from = BufReader::new(File::open(&pipes[1]).expect("a pipe"));
        let (sender, received) = channel();
        std::thread::spawn(move || {
            let texts = from.split(0).map_while(Result::ok);
            let values = texts.filter_map(|text| serde_json::from_slice(&text).ok());
            values
                .into_iter()
                .try_for_each(|value: Value| sender.send(value))
        });
        Self {
            child,
            to,
            received,
            count: 0,
            requests: vec![],
        }
    }

    /// Calls a method of the browser, or of a page by its session.
    pub fn call(&mut self, method: &str, params: Value, session: Option<&str>) -> Value {
        let until = Instant::now() + HANG;
        loop {
            let answer = self.ask(method, params.clone(), session);
            let error = answer["error"]["message"].as_str().unwrap_or_default();
            let is_loading = LOADING.iter().any(|part| error.contains(part));
            if !is_loading || Instant::now() > until {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    fn ask(&mut self, method: &str, params: Value, session: Option<&str>) -> Value {
        self.count += 1;
        let number = self.count;
        let mut message = json!({ "id": number, "method": method, "params": params });
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        let mut text = message.to_string().into_bytes();
        text.push(0);
        self.to.write_all(&text).expect("the browser reads");
        let until = Instant::now() + HANG;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let received = self.received.recv_timeout(left);
            let received = received.unwrap_or_else(|_| panic!("no answer to {method}"));
            if received["method"] == "Network.requestWillBeSent" {
                let address = received["params"]["request"]["url"].as_str();
                self.requests.push(address.unwrap_or_default().to_owned());
            }
            if received["id"] == number {
                return received;
            }
        }
    }

    /// Opens a page.
    pub fn open(&mut self, address: &str) -> Page {
        self.open_sized(address, SIZE)
    }

    /// Opens a page with a size in pixels.
    pub fn open_sized(&mut self, address: &str, [width, height]: [u32; 2]) -> Page {
        let target = self.call("Target.createTarget", json!({ "url": "about:blank" }), None);
        let target = target["targetId"].as_str().expect("a page").to_owned();
        let how = json!({ "targetId": target, "flatten": true });
        let session = self.call("Target.attachToTarget", how, None);
        let session = session["sessionId"].as_str().expect("a session").to_owned();
        let page = Page { target, session };
        for domain in ["Page.enable", "Network.enable", "Runtime.enable"] {
            self.call(domain, json!({}), Some(&page.session));
        }
        let size =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call(
            "Emulation.setDeviceMetricsOverride",
            size,
            Some(&page.session),
        );
        self.call(
            "Page.navigate",
            json!({ "url": address }),
            Some(&page.session),
        );
        page
    }

    /// Reloads a page.
    pub fn reload(&mut self, page: &Page) {
        self.call("Page.reload", json!({}), Some(&page.session));
    }

    /// Closes a page.
    pub fn close(&mut self, page: &Page) {
        self.call(
            "Target.closeTarget",
            json!({ "targetId": page.target }),
            None,
        );
    }

    /// Makes a page hidden, or visible again. A Chromium without a window may treat every page as
    /// visible, whichever is in front.
    pub fn set_seen(&mut self, page: &Page, is_seen: bool) {
        let state = if is_seen { "visible" } else { "hidden" };
        let reported = format!(
            "Object.defineProperty(document, \"visibilityState\", {{ value: \"{state}\", configurable: true }});
            document.dispatchEvent(new Event(\"visibilitychange\"))"
        );
        self.value(page, &reported);
    }

    /// Returns the value of an expression in a page.
    pub fn value(&mut self, page: &Page, expression: &str) -> Value {
        let what = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", what, Some(&page.session));
        answer["result"]["value"].clone()
    }

    /// Returns the number that an expression has in a page; `None` while the page reloads.
    pub fn number(&mut self, page: &Page, expression: &str) -> Option<f64> {
        let what = json!({ "expression": expression, "returnByValue": true });
        let answer = self.ask("Runtime.evaluate", what, Some(&page.session));
        answer["result"]["result"]["value"].as_f64()
    }

    /// Takes a picture, as PNG in base 64.
    pub fn picture(&mut self, page: &Page) -> String {
        let shot = self.call(
            "Page.captureScreenshot",
            json!({ "format": "png" }),
            Some(&page.session),
        );
        shot["data"].as_str().expect("a picture").to_owned()
    }

    /// Takes a picture in a smaller format: JPEG.
    pub fn photograph(&mut self, page: &Page) -> Vec<u8> {
        let shot = self.call(
            "Page.captureScreenshot",
            json!({ "format": "jpeg", "quality": 90 }),
            Some(&page.session),
        );
        let shot = shot["data"].as_str().expect("a picture");
        BASE64_STANDARD.decode(shot).expect("base 64")
    }

    /// Returns the result of a script on a part of pictures: `parts` are their pixels, with their
    /// widths. The page itself decodes the pictures.
    fn of_parts(&mut self, page: &Page, pictures: &[&str], part: [f64; 4], script: &str) -> Value {
        let expression = format!(
            "(async () => {{
                const parts = await Promise.all({pictures:?}.map(async (picture) => {{
                    const image = new Image();
                    image.src = 'data:image/png;base64,' + picture;
                    await image.decode();
                    const [x, y, w, h] = {part:?};
                    const canvas = document.createElement('canvas');
                    const size = [Math.round(w * image.width), Math.round(h * image.height)];
                    [canvas.width, canvas.height] = size;
                    const to = canvas.getContext('2d');
                    to.drawImage(image, -Math.round(x * image.width), -Math.round(y * image.height));
                    return to.getImageData(0, 0, ...size);
                }}));
                {script}
            }})()"
        );
        self.value(page, &expression)
    }

    /// Returns the difference of a part between two pictures: a mean over its pixels and colours,
    /// of 255.
    pub fn difference(&mut self, page: &Page, pictures: [&str; 2], part: [f64; 4]) -> f64 {
        let script = "
            const [a, b] = parts.map((part) => part.data);
            let sum = 0;
            for (let i = 0; i < a.length; i++) sum += Math.abs(a[i] - b[i]);
            return sum / (0.75 * a.length);";
        let value = self.of_parts(page, &pictures, part, script);
        value.as_f64().expect("a number")
    }

    /// Returns the colours of a part of a picture: its position and size as shares of the whole.
    pub fn colours(
        &mut self,
        page: &Page,
        picture: &str,
        part: [f64; 4],
        near: &[[u8; 3]],
    ) -> Colours {
        let script = format!(
            "const data = parts[0].data;
            const seen = new Set(), wanted = {near:?}, near = wanted.map(() => 0);
            let hash = 7;
            for (let i = 0; i < data.length; i += 4) {{
                const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
                seen.add((r << 16) | (g << 8) | b);
                hash = (hash * 31 + r * 7 + g * 5 + b * 3) % 4294967291;
                wanted.forEach(([R, G, B], k) => {{
                    near[k] += Math.abs(r - R) + Math.abs(g - G) + Math.abs(b - B) < 60;
                }});
            }}
            return {{ count: seen.size, near, hash }};"
        );
        let value = self.of_parts(page, &[picture], part, &script);
        let near = value["near"].as_array().expect("counts");
        Colours {
            count: value["count"].as_u64().expect("a count") as usize,
            near: near
                .iter()
                .map(|n| n.as_u64().unwrap_or(0) as usize)
                .collect(),
            hash: value["hash"].as_f64().expect("a number") as u64,
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
