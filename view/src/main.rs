//! `hapterra-view`: reads the messages of `hapterra` from standard input and shows them as a page.

use std::ffi::OsString;
use std::io::Write as _;
use std::process::{Command, ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;

use hapterra_view::feed::{self, RrdFile};
use hapterra_view::history::History;
use hapterra_view::options::{HELP, Options};
use hapterra_view::server::Server;

/// Variable with more options, separated by spaces, because `hapterra` starts this program.
const OPTIONS: &str = "HAPTERRA_VIEW_OPTIONS";
/// Time for which the page remains after the session's end, when no page is open.
const LINGER: Duration = Duration::from_secs(15);
/// Time between two checks for an open page.
const LOOK: Duration = Duration::from_millis(100);

fn main() -> ExitCode {
    let stated = std::env::var_os(OPTIONS).unwrap_or_default();
    let stated = stated.to_string_lossy().into_owned();
    let words = std::env::args_os().skip(1);
    let words = words.chain(stated.split_whitespace().map(OsString::from));
    let shown = Options::read(words).and_then(|options| match options {
        Some(options) => show(&options),
        None => {
            tell(HELP);
            Ok(())
        }
    });
    match shown {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            tell(&format!("hapterra-view: error: {why:#}"));
            ExitCode::FAILURE
        }
    }
}

fn show(options: &Options) -> Result<()> {
    let history = History::new(options.history_bytes);
    let rrd = options.rrd.as_deref().map(RrdFile::create).transpose()?;
    let ports = options.ports();
    let kept = Arc::clone(&history);
    let server = Server::start(options.bind, &ports, kept, options.page_bytes)?;
    if server.is_open() {
        tell(
            "hapterra-view: warning: other machines can open the page, and see the terrain and the hand",
        );
    }
    let url = server.url();
    let mut is_reported = false;
    let mut on_scene = || {
        is_reported = true;
        tell(&format!("view           {url}"));
        if options.browser {
            open(&url);
        }
    };
    let ended = feed::draw(std::io::stdin().lock(), &history, rrd, &mut on_scene)?;
    if let Err(why) = &ended.rrd {
        tell(&format!(
            "hapterra-view: warning: {why:#}: it is not complete"
        ));
    }
    if is_reported {
        linger(&history, options.linger, &watched(ended.is_reported));
    }
    let kept = history.kept();
    if kept.cut > 0 {
        tell(&format!(
            "view           pages were too slow {} times, and came again",
            kept.cut
        ));
    }
    ended.rrd
}

/// Watches for the end of `hapterra`, which keeps the pipe open after the stream's end while it
/// runs.
fn watched(has_ended: bool) -> Arc<AtomicBool> {
    let is_gone = Arc::new(AtomicBool::new(!has_ended));
    let reported = Arc::clone(&is_gone);
    // Without a thread, `hapterra` counts as running.
    let _ = std::thread::Builder::new().spawn(move || {
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        reported.store(true, Ordering::Release);
    });
    is_gone
}

/// Waits while a page is open, and for a page while `hapterra` runs.
fn linger(history: &History, linger: Option<Duration>, is_gone: &AtomicBool) {
    let mut alone_since = Instant::now();
    loop {
        let kept = history.kept();
        if kept.pages > 0 {
            alone_since = Instant::now();
        }
        // Pages that received everything are not counted any more, so only the time since they
        // connected remains as a criterion.
        let timeout = linger.unwrap_or(LINGER);
        let may_go = linger.is_some() || kept.came > 0 || is_gone.load(Ordering::Acquire);
        if may_go && kept.pages == 0 && alone_since.elapsed() >= timeout {
            return;
        }
        std::thread::sleep(LOOK);
    }
}

/// Opens the page in a browser, if there is a screen.
fn open(url: &str) {
    let has_screen = ["DISPLAY", "WAYLAND_DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()));
    let (program, words): (_, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ if has_screen => ("xdg-open", &[]),
        _ => return,
    };
    let null = || Stdio::null();
    let started = Command::new(program)
        .args(words)
        .arg(url)
        .stdin(null())
        .stdout(null())
        .stderr(null())
        .spawn();
    // If no browser starts, the user has already read the page's address.
    drop(started);
}

/// Prints a line, and ignores a closed output.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
