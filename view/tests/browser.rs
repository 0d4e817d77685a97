//! The live page in a real browser, without a screen.

mod common;

use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use common::browser::{Browser, Colours, Page, program};
use common::recorded::{Csv, check, entities};
use common::scene::{batch, greeting, layer, scene};
use common::{Running, Viewer, emulated, folder, hapterra};

/// Until the page shows what is asked of it; software draws it, on a busy machine.
const SHOWN_WITHIN: Duration = Duration::from_secs(300);
/// The terrain's part of the page, and the plots'.
const TERRAIN: [f64; 4] = [0.0, 0.05, 0.56, 0.88];
const PLOTS: [f64; 4] = [0.6, 0.4, 0.4, 0.5];
/// The colours of the proxy and of the lines around held tiles, and of the force's arrow,
/// which is there while the hand touches.
const MARKS: [[u8; 3]; 3] = [[255, 120, 20], [64, 224, 208], FORCE];
const FORCE: [u8; 3] = [255, 230, 60];

/// Software draws the pages: one test at a time.
static ONE: Mutex<()> = Mutex::new(());

/// A live session that goes on while the page is looked at.
struct Session {
    viewer: Viewer,
    tick: u64,
    held: Vec<[i32; 2]>,
}

impl Session {
    fn start(options: &str) -> (Self, String) {
        let mut session = Self {
            viewer: Viewer::start(options),
            tick: 0,
            held: vec![],
        };
        for message in [greeting(), scene(true), layer()] {
            assert!(session.viewer.tell(&message));
        }
        session.go_on(1000);
        let address = session.viewer.address();
        (session, address)
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
    go_on: &mut dyn FnMut(),
    is_right: impl Fn(&Colours, &Colours) -> bool,
) -> (Colours, Colours) {
    let until = Instant::now() + SHOWN_WITHIN;
    loop {
        go_on();
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

/// Hundreds of tints of relief, the proxy and outlines of tiles; and curves.
fn is_whole(terrain: &Colours, plots: &Colours) -> bool {
    let marks = terrain.near.iter().take(2);
    terrain.count > 400 && { marks }.all(|marks| *marks > 10) && plots.count > 20
}

/// The browser; none, and a line that says so, where there is none.
fn browser_in(folder: &Path) -> Option<Browser> {
    let program = program();
    if program.is_none() {
        println!("SKIPPED: no Chromium here; HAPTERRA_BROWSER can name one");
    }
    program.map(|program| Browser::start(&program, folder))
}

/// What pages asked of other machines than the one at an address.
fn foreign<'b>(browser: &'b Browser, address: &str) -> Vec<&'b String> {
    let requests = browser.requests.iter();
    requests
        .filter(|asked| !asked.starts_with(address))
        .filter(|asked| {
            !["data:", "blob:", "about:"]
                .iter()
                .any(|own| asked.starts_with(own))
        })
        .collect()
}

#[test]
fn a_browser_shows_terrain_hand_and_plots_and_asks_nobody_else() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("browser");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    let (mut session, address) = Session::start("--linger 0");
    let page = browser.open(&address);
    let mut go_on = || session.go_on(200);
    let (terrain, plots) = shown(&mut browser, &page, &mut go_on, is_whole);
    // They change while the hand moves.
    let moved = |now: &Colours, then: &Colours| now.hash != then.hash;
    shown(&mut browser, &page, &mut go_on, |now, plotted| {
        is_whole(now, plotted) && moved(now, &terrain) && moved(plotted, &plots)
    });
    // A second page, and the first one anew.
    let second = browser.open(&address);
    shown(&mut browser, &second, &mut go_on, is_whole);
    browser.close(&second);
    browser.reload(&page);
    shown(&mut browser, &page, &mut go_on, is_whole);
    let foreign = foreign(&browser, &address);
    assert!(foreign.is_empty(), "requests elsewhere: {foreign:?}");
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
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("grown");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    let (mut session, address) = Session::start("--linger 0 --page-mb 64");
    let page = browser.open(&address);
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

#[test]
fn the_page_shows_what_the_emulated_board_feels_while_it_is_touched() {
    let (Some(mut demo), Some(image)) = (hapterra(), emulated()) else {
        println!("SKIPPED: no hapterra and no emulated board; cargo xtask view --test names both");
        return;
    };
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("emulated");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    let live = folder.join("live.rrd");
    // For as long as it takes a page to be seen on a busy machine: it is ended then.
    demo.args(["demo", "--device", "emulated", "--rounds", "90", "--view"])
        .arg("--image")
        .arg(image)
        .arg("--out")
        .arg(&folder);
    let mut demo = Running::shown(&mut demo, &format!("--rrd {}", live.display()));
    let address = demo.address();
    let page = browser.open(&address);
    let mut is_touched = || {
        assert!(demo.goes_on(), "it ended before the page was seen");
    };
    let (terrain, plots) = shown(&mut browser, &page, &mut is_touched, is_whole);
    shown(&mut browser, &page, &mut is_touched, |now, plotted| {
        is_whole(now, plotted) && now.hash != terrain.hash && plotted.hash != plots.hash
    });
    shown(&mut browser, &page, &mut is_touched, |now, _| {
        now.near[2] > 10
    });
    // So that there is enough to compare.
    std::thread::sleep(Duration::from_secs(5));
    is_touched();
    let foreign = foreign(&browser, &address);
    assert!(foreign.is_empty(), "requests elsewhere: {foreign:?}");
    drop(browser);
    demo.interrupt();
    assert!(demo.end());
    let told = demo.words();
    for figure in [" run, 0 late", " 0 lost on the link, 0 dropped"] {
        assert!(told.contains(figure), "{told}");
    }
    assert!(!told.contains("not shown"), "{told}");
    check(&Csv::read(&folder.join("fractal.csv")), &entities(&live));
    std::fs::remove_dir_all(folder).expect("it goes");
}
