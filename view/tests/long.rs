//! How memory grows while somebody touches for long: figures for the documentation.
//!
//! `cargo test --release --test long -- --ignored --nocapture` takes as many minutes as
//! `MINUTES` says, ten unless it does, at the device's own pace.

mod common;

use std::time::{Duration, Instant};

use common::browser::{Browser, program};
use common::scene::{batch, greeting, layer, scene};
use common::{Viewer, folder};

const BATCH: u64 = 100;
/// The viewer's memory may grow by so much from the third minute on: the history is full
/// after some minutes, and the rest is noise of the allocator.
const VIEWER_BYTES: u64 = 300 << 20;
const PAGE_BYTES: u64 = 1 << 30;

#[test]
#[ignore = "takes ten minutes"]
fn memory_stays_bounded_while_somebody_touches_for_long() {
    let minutes = std::env::var("MINUTES")
        .ok()
        .and_then(|minutes| minutes.parse().ok());
    let end = Duration::from_secs(60 * minutes.unwrap_or(10));
    let mut viewer = Viewer::start(&["--linger", "0"]);
    let (mut held, mut tick) = (Vec::new(), 0);
    for message in [greeting(), scene(true), layer()] {
        assert!(viewer.tell(&message));
    }
    for message in batch(0, BATCH, &mut held) {
        assert!(viewer.tell(&message));
    }
    let address = format!("http://127.0.0.1:{}/", viewer.port());
    let folder = folder("long");
    let mut shown = program().map(|program| {
        let mut browser = Browser::start(&program, &folder);
        let page = browser.open(&address);
        (browser, page)
    });
    if shown.is_none() {
        println!("SKIPPED: the page: no Chromium here");
    }
    println!("minute | viewer, MB | page, MB | received by the page, MB");
    let (began, mut slowest) = (Instant::now(), Duration::ZERO);
    let (mut most, mut most_of_page, mut minute) = (0, 0, 0);
    while began.elapsed() < end {
        tick += BATCH;
        let told = Instant::now();
        for message in batch(tick, tick + BATCH, &mut held) {
            assert!(viewer.tell(&message));
        }
        slowest = slowest.max(told.elapsed());
        let due = Duration::from_millis(tick);
        std::thread::sleep(due.saturating_sub(began.elapsed()));
        if began.elapsed().as_secs() / 60 > minute {
            minute += 1;
            most = most.max(viewer.memory());
            let mut state = [0, 0];
            if let Some((browser, page)) = &mut shown {
                let figures =
                    browser.value(page, "[window.hapterra.memory, window.hapterra.bytes]");
                state = [0, 1].map(|i| figures[i].as_u64().unwrap_or(0));
                most_of_page = most_of_page.max(state[0]);
            }
            let [viewer, page, received] =
                [viewer.memory(), state[0], state[1]].map(|bytes| bytes >> 20);
            println!("{minute} | {viewer} | {page} | {received}");
        }
    }
    println!("the slowest tenth of a second was taken in {slowest:?}");
    assert!(most < VIEWER_BYTES, "{most}");
    assert!(most_of_page < PAGE_BYTES, "{most_of_page}");
    drop(shown);
    viewer.hang_up();
    assert!(viewer.end());
    let _ = std::fs::remove_dir_all(folder);
}
