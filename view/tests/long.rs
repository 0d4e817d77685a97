//! How memory grows while somebody touches for long: figures for the documentation.
//!
//! `MINUTES=10 HAPTERRA=PROGRAM cargo test --release --test long -- --ignored --nocapture`
//! takes so many minutes, at the device's own pace.

mod common;

use std::process::Stdio;
use std::time::{Duration, Instant};

use common::browser::{Browser, Page, program};
use common::{folder, hapterra, lines_of, memory_of, port_said, started_by};

/// What the viewer may take: the history is full after some minutes, and the rest is noise
/// of the allocator.
const VIEWER_BYTES: u64 = 300 << 20;
/// From 1 GB on a page begins anew, with the next piece that it is told.
const PAGE_BYTES: u64 = 5 << 28;

/// What a page takes, and what it was told.
#[derive(Clone, Copy, Debug, Default)]
struct OfPage {
    bytes: u64,
    told: u64,
    /// Since it began, or began anew.
    age_s: f64,
}

fn of_page(browser: &mut Browser, page: &Page) -> OfPage {
    let said = browser.value(
        page,
        "[window.hapterra?.memory, window.hapterra?.bytes, performance.now() / 1000]",
    );
    let number = |i: usize| said[i].as_u64().unwrap_or(0);
    OfPage {
        bytes: number(0),
        told: number(1),
        age_s: said[2].as_f64().unwrap_or(0.0),
    }
}

#[test]
#[ignore = "takes ten minutes"]
fn memory_stays_bounded_while_somebody_touches_for_long() {
    let Some(mut demo) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program");
        return;
    };
    let minutes = std::env::var("MINUTES").ok();
    let minutes: u64 = minutes.and_then(|it| it.parse().ok()).unwrap_or(10);
    let folder = folder("long");
    let seconds = (60 * minutes).to_string();
    let options = std::env::var("HAPTERRA_VIEW_OPTIONS").unwrap_or_default();
    let options = format!("--no-browser --port 0 --linger 0 {options}");
    demo.args(["demo", "--device", "native", "--rounds", "200", "--view"])
        .args(["--seconds", &seconds, "--out"])
        .arg(&folder)
        .env("HAPTERRA_VIEW_OPTIONS", options)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut demo = demo.spawn().expect("it starts");
    let told = lines_of(demo.stdout.take().expect("a pipe"));
    let said = lines_of(demo.stderr.take().expect("a pipe"));
    let address = format!("http://127.0.0.1:{}/", port_said(&said));
    let viewer = started_by(demo.id()).expect("the viewer runs");
    let mut browser = Browser::start(&program().expect("a Chromium"), &folder);
    let page = browser.open(&address);
    println!("minute | hapterra, MB | viewer, MB | page, MB, for s | told to the page, MB");
    let (began, mut minute) = (Instant::now(), 0);
    let mut most = [0; 2];
    while matches!(demo.try_wait(), Ok(None)) {
        std::thread::sleep(Duration::from_secs(1));
        if began.elapsed().as_secs() / 60 == minute {
            continue;
        }
        minute += 1;
        let of_page = of_page(&mut browser, &page);
        let of_viewer = memory_of(viewer);
        most = [most[0].max(of_viewer), most[1].max(of_page.bytes)];
        let figures = [memory_of(demo.id()), of_viewer, of_page.bytes, of_page.told];
        let [host, viewer, page, told] = figures.map(|bytes| bytes >> 20);
        let age = of_page.age_s;
        println!("{minute} | {host} | {viewer} | {page}, {age:.0} | {told}");
        if minute + 1 == minutes {
            // In the last one the viewer ends with the session.
            break;
        }
    }
    drop(browser);
    assert!(demo.wait().expect("it ends").success());
    let told = told.iter().chain(&said).collect::<Vec<_>>().join("\n");
    println!("{told}");
    assert!(told.contains(" 0 lost on the link, 0 dropped") && !told.contains("not shown"));
    assert!(most[0] < VIEWER_BYTES && most[1] < PAGE_BYTES, "{most:?}");
    let _ = std::fs::remove_dir_all(folder);
}
