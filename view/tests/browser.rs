//! The live page in a real browser, without a screen.

mod common;

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use common::browser::{Browser, Colours, Page, program};
use common::scene::{batch, greeting, layer, scene};
use common::{Viewer, folder};

/// Until the page shows what is asked of it; software draws it, on a busy machine.
const SHOWN_WITHIN: Duration = Duration::from_secs(300);
/// The terrain's part of the page, and the plots'.
const TERRAIN: [f64; 4] = [0.0, 0.05, 0.56, 0.88];
const PLOTS: [f64; 4] = [0.6, 0.4, 0.4, 0.5];
/// The colours of the proxy and of the lines around held tiles.
const MARKS: [[u8; 3]; 2] = [[255, 120, 20], [64, 224, 208]];

/// Software draws the pages: one test at a time.
static ONE: Mutex<()> = Mutex::new(());

/// A live session that goes on while the page is looked at.
struct Session {
    viewer: Viewer,
    tick: u64,
    held: Vec<[i32; 2]>,
}

impl Session {
    fn start(options: &[&str]) -> (Self, u16) {
        let mut session = Self {
            viewer: Viewer::start(options),
            tick: 0,
            held: vec![],
        };
        for message in [greeting(), scene(true), layer()] {
            assert!(session.viewer.tell(&message));
        }
        session.go_on(1000);
        let port = session.viewer.port();
        (session, port)
    }

    fn go_on(&mut self, ticks: u64) {
        let until = self.tick + ticks;
        while self.tick < until {
            for message in batch(self.tick, self.tick + 100, &mut self.held) {
                assert!(self.viewer.tell(&message));
            }
            self.tick += 100;
        }
    }
}

/// Takes pictures until `is_right` of the colours of both parts.
fn shown(
    browser: &mut Browser,
    page: &Page,
    session: &mut Session,
    is_right: impl Fn(&Colours, &Colours) -> bool,
) -> (Colours, Colours) {
    let until = Instant::now() + SHOWN_WITHIN;
    loop {
        session.go_on(200);
        std::thread::sleep(Duration::from_millis(200));
        let picture = browser.picture(page);
        let terrain = browser.colours(page, &picture, TERRAIN, &MARKS);
        let plots = browser.colours(page, &picture, PLOTS, &[]);
        if is_right(&terrain, &plots) {
            return (terrain, plots);
        }
        let state = browser.value(
            page,
            "JSON.stringify([window.hapterra, document.body.innerText])",
        );
        assert!(Instant::now() < until, "{terrain:?} {plots:?} {state}");
    }
}

#[test]
fn a_browser_shows_terrain_hand_and_plots_and_asks_nobody_else() {
    let Some(program) = program() else {
        println!("SKIPPED: no Chromium here; HAPTERRA_BROWSER can name one");
        return;
    };
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("browser");
    let (mut session, port) = Session::start(&["--linger", "0"]);
    let mut browser = Browser::start(&program, &folder);
    let address = format!("http://127.0.0.1:{port}/");
    let page = browser.open(&address);
    // Hundreds of tints of relief, the proxy and outlines of tiles.
    let is_whole = |terrain: &Colours, plots: &Colours| {
        terrain.count > 400 && terrain.near.iter().all(|marks| *marks > 10) && plots.count > 20
    };
    let (terrain, plots) = shown(&mut browser, &page, &mut session, is_whole);
    // They change while the hand moves.
    let moved = |now: &Colours, then: &Colours| now.hash != then.hash;
    shown(&mut browser, &page, &mut session, |now, plotted| {
        is_whole(now, plotted) && moved(now, &terrain) && moved(plotted, &plots)
    });
    // A second page, and the first one anew.
    let second = browser.open(&address);
    shown(&mut browser, &second, &mut session, is_whole);
    browser.close(&second);
    browser.reload(&page);
    shown(&mut browser, &page, &mut session, is_whole);
    let foreign: Vec<_> = browser
        .requests
        .iter()
        .filter(|asked| !asked.starts_with(&address))
        .filter(|asked| {
            !["data:", "blob:", "about:"]
                .iter()
                .any(|own| asked.starts_with(own))
        })
        .collect();
    assert!(
        foreign.is_empty(),
        "requests to other machines: {foreign:?}"
    );
    assert!(
        browser
            .requests
            .iter()
            .any(|asked| asked.ends_with("/feed"))
    );
    // Killing the browser does no harm.
    drop(browser);
    session.go_on(2000);
    assert!(session.viewer.end());
    std::fs::remove_dir_all(folder).expect("it goes");
}

#[test]
fn a_page_that_has_grown_too_large_begins_anew_and_goes_on() {
    let Some(program) = program() else {
        println!("SKIPPED: no Chromium here; HAPTERRA_BROWSER can name one");
        return;
    };
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("grown");
    let (mut session, port) = Session::start(&["--linger", "0", "--page-mb", "64"]);
    let mut browser = Browser::start(&program, &folder);
    let page = browser.open(&format!("http://127.0.0.1:{port}/"));
    let mut until = |wanted: &dyn Fn(f64, f64) -> bool| {
        let until = Instant::now() + SHOWN_WITHIN;
        loop {
            session.go_on(500);
            std::thread::sleep(Duration::from_millis(500));
            let began = browser.number(&page, "performance.timeOrigin");
            let bytes = browser.number(&page, "window.hapterra.bytes");
            if let (Some(began), Some(bytes)) = (began, bytes)
                && wanted(began, bytes)
            {
                return began;
            }
            assert!(Instant::now() < until, "{began:?}, {bytes:?} bytes");
        }
    };
    let first = until(&|_, bytes| bytes > 0.0);
    // It is told anew what was there, and what comes.
    until(&|began, bytes| began != first && bytes > 0.0);
    drop(browser);
    assert!(session.viewer.end());
    std::fs::remove_dir_all(folder).expect("it goes");
}
