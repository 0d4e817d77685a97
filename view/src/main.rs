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
const POLL_INTERVAL: Duration = Duration::from_millis(100);

fn main() -> ExitCode {
    let extra = std::env::var_os(OPTIONS).unwrap_or_default();
    let extra = extra.to_string_lossy().into_owned();
    let words = std::env::args_os().skip(1);
    let words = words.chain(extra.split_whitespace().map(OsString::from));
    let result = Options::read(words).and_then(|options| match options {
        Some(options) => show(&options),
        None => {
            print_line(HELP);
            Ok(())
        }
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            print_line(&format!("hapterra-view: error: {why:#}"));
            ExitCode::FAILURE
        }
    }
}

fn show(options: &Options) -> Result<()> {
    let history = History::new(options.history_bytes);
    let rrd = options.rrd.as_deref().map(RrdFile::create).transpose()?;
    let ports = options.ports();
    let served = Arc::clone(&history);
    let server = Server::start(options.bind, &ports, served, options.page_bytes)?;
    if server.is_open() {
        print_line(
            "hapterra-view: warning: other machines can open the page, and see the terrain and the hand",
        );
    }
    let url = server.url();
    let mut is_reported = false;
    let mut on_scene = || {
        is_reported = true;
        print_line(&format!("view           {url}"));
        if options.browser {
            open(&url);
        }
    };
    let ended = feed::draw(std::io::stdin().lock(), &history, rrd, &mut on_scene)?;
    if let Err(why) = &ended.rrd {
        print_line(&format!(
            "hapterra-view: warning: {why:#}: it is not complete"
        ));
    }
    if is_reported {
        linger(&history, options.linger, &watch_stdin(ended.is_reported));
    }
    let stats = history.stats();
    if stats.dropped > 0 {
        print_line(&format!(
            "view           pages were too slow {} times, and reconnected",
            stats.dropped
        ));
    }
    ended.rrd
}

/// Watches for the end of `hapterra`, which keeps the pipe open after the stream's end while it
/// runs.
fn watch_stdin(has_ended: bool) -> Arc<AtomicBool> {
    let has_hapterra_ended = Arc::new(AtomicBool::new(!has_ended));
    let reported = Arc::clone(&has_hapterra_ended);
    // Without a thread, `hapterra` counts as running.
    let _ = std::thread::Builder::new().spawn(move || {
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        reported.store(true, Ordering::Release);
    });
    has_hapterra_ended
}

/// Waits while a page is open, and for a page while `hapterra` runs.
fn linger(history: &History, linger: Option<Duration>, has_hapterra_ended: &AtomicBool) {
    let mut no_page_since = Instant::now();
    loop {
        let stats = history.stats();
        if stats.pages > 0 {
            no_page_since = Instant::now();
        }
        // Pages that received everything are not counted any more, so only the time since they
        // connected remains as a criterion.
        let timeout = linger.unwrap_or(LINGER);
        let may_end =
            linger.is_some() || stats.connected > 0 || has_hapterra_ended.load(Ordering::Acquire);
        if may_end && stats.pages == 0 && no_page_since.elapsed() >= timeout {
            return;
        }
        std::thread::sleep(POLL_INTERVAL);
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
fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
