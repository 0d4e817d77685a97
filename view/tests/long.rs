//! Ten minutes of touching with the page open: its memory, and its effect on the session.
//!
//! `MINUTES=10 HAPTERRA=PROGRAM HAPTERRA_MPS2_ELF=IMAGE cargo test --release --test long --
//! --ignored --nocapture` runs for that many minutes on the emulated board; without an image, on
//! the device in memory. With `ALONE=1` one page is open all the time, and is not reloaded.

mod common;

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use common::browser::{Browser, Page, program};
use common::{Running, child_process, emulated, folder, hapterra, memory_of, signal};

/// Memory bound of the viewer: the history is full after some minutes, and the rest is noise of the
/// allocator.
const VIEWER_BYTES: u64 = 300 << 20;
/// Memory bound of `hapterra`: its terrain, its queue, and the rows of ten minutes that a demo
/// stores for its picture.
const HOST_BYTES: u64 = 300 << 20;
/// Memory bound of a page: at 1 GB it reloads, with the next piece that it receives.
const PAGE_BYTES: u64 = 5 << 28;

/// Memory of a page, and its messages.
#[derive(Clone, Copy, Debug, Default)]
struct OfPage {
    bytes: u64,
    reported: u64,
    /// Time since it was loaded or reloaded.
    age_s: f64,
    /// The device's second that it shows.
    shown_s: f64,
}

fn of_page(browser: &mut Browser, page: &Page) -> OfPage {
    let mut number = |expression: &str| browser.number(page, expression).unwrap_or(0.0);
    OfPage {
        bytes: number("window.hapterra?.memory") as u64,
        reported: number("window.hapterra?.bytes") as u64,
        age_s: number("performance.now() / 1000"),
        shown_s: number("window.hapterra?.shown?.()"),
    }
}

/// Starts a demo that runs longer than the test.
fn touching(into: &Path) -> Option<Command> {
    let mut demo = hapterra()?;
    demo.args(["demo", "--rounds", "300", "--view"]);
    match emulated() {
        Some(image) => demo.arg(format!("--device=emulated:{}", image.display())),
        None => demo.args(["--device", "native"]),
    };
    demo.arg("--out").arg(into);
    Some(demo)
}

/// Returns the lines of a session's summary about late ticks, lost samples, and tiles that were
/// requested but not delivered.
fn complaints(reported: &str) -> Vec<&str> {
    let good = [
        ("ticks ", " run, 0 late"),
        ("telemetry ", " 0 lost on the link, 0 dropped"),
    ];
    let is_good = |line: &&str, (begin, figure): &(&str, &str)| {
        line.starts_with(begin) && line.contains(figure)
    };
    let missing = good
        .iter()
        .filter(|good| !reported.lines().any(|line| is_good(&line, good)))
        .map(|(_, figure)| *figure);
    // The link reports frames that were not understood, requests without an answer and sessions
    // with an unknown end.
    let of_link = reported.lines().filter(|line| line.starts_with("link "));
    missing.chain(of_link).collect()
}

#[test]
fn each_bad_figure_is_reported() {
    let good = "ticks          9 run, 0 late\n\
                tiles          8 fetched (35044 bytes), 2 of them again\n\
                telemetry      9 samples, 0 lost on the link, 0 dropped by the device\n";
    assert!(complaints(good).is_empty());
    let unanswered = format!("{good}link           1 requests and queries without an answer\n");
    let bad = [
        good.replace("0 late", "10 late"),
        good.replace("0 lost", "40 lost"),
        good.replace("0 dropped", "3 dropped"),
        unanswered,
    ];
    for reported in &bad {
        assert_eq!(complaints(reported).len(), 1, "{reported}");
    }
}

#[test]
#[ignore = "runs for ten minutes"]
fn history_of_ten_minutes_is_bounded() {
    let folder = folder("long");
    let Some(mut demo) = touching(&folder) else {
        println!("SKIPPED: HAPTERRA names no program");
        return;
    };
    let minutes = std::env::var("MINUTES").ok();
    let minutes: u64 = minutes.and_then(|it| it.parse().ok()).unwrap_or(10);
    let is_alone = std::env::var_os("ALONE").is_some();
    let options = std::env::var("HAPTERRA_VIEW_OPTIONS").unwrap_or_default();
    let since = Instant::now();
    let mut demo = Running::start_with_viewer(&mut demo, &options);
    let address = demo.address();
    let viewer = child_process(demo.id(), "hapterra-view").expect("the viewer runs");
    let mut browser = Browser::start(&program().expect("a Chromium"), &folder);
    let page = browser.open(&address);
    let mut second = None;
    println!(
        "minute | hapterra, MB | viewer, MB | page, MB, for s | sent to the page, MB | second shown, of the session's"
    );
    let began = Instant::now();
    let mut maxima = [0; 3];
    for minute in 1..=minutes {
        let until = Duration::from_secs(60 * minute);
        std::thread::sleep(until.saturating_sub(began.elapsed()));
        assert!(demo.is_running(), "{}", demo.output());
        let of_page = of_page(&mut browser, &page);
        let figures = [memory_of(demo.id()), memory_of(viewer), of_page.bytes];
        for (max, now) in maxima.iter_mut().zip(figures) {
            *max = now.max(*max);
        }
        let [host, viewer_now, page_now] = figures.map(|bytes| bytes >> 20);
        let (age, reported) = (of_page.age_s, of_page.reported >> 20);
        let (shown, is) = (of_page.shown_s, since.elapsed().as_secs_f64());
        println!(
            "{minute} | {host} | {viewer_now} | {page_now}, {age:.0} | {reported} | {shown:.1}, {is:.1}"
        );
        // Once each: reloaded, opened twice, closed; at the end the viewer is killed.
        match minutes - minute {
            _ if is_alone => {}
            6 => browser.reload(&page),
            5 => second = Some(browser.open(&address)),
            4 => drop(second.take().map(|second| browser.close(&second))),
            1 => signal("-KILL", viewer),
            _ => {}
        }
    }
    drop(browser);
    demo.interrupt();
    let ended_well = demo.end();
    let reported = demo.output();
    println!("{reported}\nmost, bytes: {maxima:?}");
    assert!(ended_well, "{reported}");
    assert_eq!(complaints(&reported), Vec::<&str>::new(), "{reported}");
    let bounds = [HOST_BYTES, VIEWER_BYTES, PAGE_BYTES];
    let are_kept = maxima.iter().zip(bounds).all(|(max, bound)| *max < bound);
    assert!(are_kept, "{maxima:?}");
    let _ = std::fs::remove_dir_all(folder);
}
