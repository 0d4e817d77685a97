//! The live page in a real browser, without a screen.

mod common;

use std::path::Path;
use std::process::Stdio;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use hapterra_view_stream::Message;

use common::browser::{Browser, Colours, Page, program};
use common::recorded::{Csv, check, entities};
use common::scene::{batch, greeting, layer, resting, scene, tiles_around, zoomed_scene};
use common::{HANG, Running, Viewer, child_process, emulated, folder, hapterra, memory_of, signal};

/// The areas of the terrain and of the plots in the page.
const TERRAIN: [f64; 4] = [0.0, 0.05, 0.56, 0.88];
const PLOTS: [f64; 4] = [0.6, 0.5, 0.4, 0.4];
/// The colours of the proxy, of the outlines of stored tiles, and of the force's arrow, which is
/// shown during contact.
const MARKS: [[u8; 3]; 3] = [[255, 120, 20], [64, 224, 208], FORCE];
const FORCE: [u8; 3] = [255, 230, 60];

/// The area of the map, and the colour of the square of the visible part.
const MAP: [f64; 4] = [0.58, 0.05, 0.21, 0.4];
const WHITE: [u8; 3] = [255, 255, 255];
/// Minimum decrease of that square's pixels when its sides are a quarter as long.
const MIN_DECREASE: usize = 80;

/// Software draws the pages: one test at a time.
static ONE: Mutex<()> = Mutex::new(());

/// A live session that continues while a page shows it.
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
            assert!(session.viewer.send(&message));
        }
        session.feed_samples(1000);
        let address = session.viewer.address();
        (session, address)
    }

    fn feed_samples(&mut self, ticks: u64) {
        let until = self.tick + ticks;
        while self.tick < until {
            for message in batch(self.tick, self.tick + 100, &mut self.held) {
                assert!(self.viewer.send(&message));
            }
            self.tick += 100;
        }
    }
}

/// Takes pictures until `is_right` accepts the colours of both areas.
fn shown(
    browser: &mut Browser,
    page: &Page,
    feed_samples: &mut dyn FnMut(),
    is_right: impl Fn(&Colours, &Colours) -> bool,
) -> (Colours, Colours) {
    let until = Instant::now() + HANG;
    loop {
        feed_samples();
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

/// Returns true if there are hundreds of tints of relief, the proxy and outlines of tiles; and
/// curves.
fn is_whole(terrain: &Colours, plots: &Colours) -> bool {
    let marks = terrain.near.iter().take(2);
    terrain.count > 400 && { marks }.all(|marks| *marks > 10) && plots.count > 20
}

/// Returns the browser, or `None` with a message if there is none.
fn browser_in(folder: &Path) -> Option<Browser> {
    let program = program();
    if program.is_none() {
        println!("SKIPPED: no Chromium here; HAPTERRA_BROWSER can name one");
    }
    program.map(|program| Browser::start(&program, folder))
}

/// Returns the requests of pages to other machines than the one at an address.
fn foreign<'b>(browser: &'b Browser, address: &str) -> Vec<&'b String> {
    let requests = browser.requests.iter();
    requests
        .filter(|request| !request.starts_with(address))
        .filter(|request| {
            !["data:", "blob:", "about:"]
                .iter()
                .any(|own| request.starts_with(own))
        })
        .collect()
}

/// Removes a folder to which parts of a killed browser may still write for a moment.
fn remove(folder: &Path) {
    let until = Instant::now() + HANG;
    while let Err(why) = std::fs::remove_dir_all(folder) {
        assert!(Instant::now() < until, "{why}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn page_shows_live_scene_and_plots_without_foreign_requests() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("browser");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    let (mut session, address) = Session::start("--linger 0s");
    let page = browser.open(&address);
    let mut feed_samples = || session.feed_samples(200);
    let (terrain, plots) = shown(&mut browser, &page, &mut feed_samples, is_whole);
    // They change while the hand moves.
    let moved = |now: &Colours, then: &Colours| now.hash != then.hash;
    shown(&mut browser, &page, &mut feed_samples, |now, plotted| {
        is_whole(now, plotted) && moved(now, &terrain) && moved(plotted, &plots)
    });
    // A second page hides the first, which reloads when it is visible again; then the first one is
    // reloaded by the browser.
    let began = browser.number(&page, "performance.timeOrigin");
    browser.set_seen(&page, false);
    let second = browser.open(&address);
    shown(&mut browser, &second, &mut feed_samples, is_whole);
    browser.close(&second);
    browser.set_seen(&page, true);
    let until = Instant::now() + HANG;
    while browser.number(&page, "performance.timeOrigin") == began {
        feed_samples();
        std::thread::sleep(Duration::from_millis(200));
        assert!(Instant::now() < until, "the page does not reload");
    }
    shown(&mut browser, &page, &mut feed_samples, is_whole);
    browser.reload(&page);
    shown(&mut browser, &page, &mut feed_samples, is_whole);
    let foreign = foreign(&browser, &address);
    assert!(foreign.is_empty(), "requests elsewhere: {foreign:?}");
    assert!(
        browser
            .requests
            .iter()
            .any(|request| request.ends_with("/feed?gathered"))
    );
    // Killing the browser has no effect on the session.
    drop(browser);
    session.feed_samples(2000);
    assert!(session.viewer.end());
    remove(&folder);
}

#[test]
fn oversized_page_reloads_and_continues() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("grown");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    let (mut session, address) = Session::start("--linger 0s --page 64MB");
    let page = browser.open(&address);
    let mut until = |condition: &dyn Fn(f64, f64) -> bool| {
        let until = Instant::now() + HANG;
        loop {
            session.feed_samples(500);
            std::thread::sleep(Duration::from_millis(500));
            let began = browser.number(&page, "performance.timeOrigin");
            let bytes = browser.number(&page, "window.hapterra.bytes");
            if let (Some(began), Some(bytes)) = (began, bytes)
                && condition(began, bytes)
            {
                return began;
            }
            assert!(Instant::now() < until, "{began:?}, {bytes:?} bytes");
        }
    };
    let first = until(&|_, bytes| bytes > 0.0);
    // It receives the earlier entries again, and the new ones.
    let reconnected = until(&|began, bytes| began != first && bytes > 0.0);
    // Not at once: its first entries may already be larger.
    assert!(
        reconnected - first > 20_000.0,
        "after {} ms",
        reconnected - first
    );
    drop(browser);
    assert!(session.viewer.end());
    remove(&folder);
}

#[test]
fn page_shows_live_contact_on_the_emulated_board() {
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
    // Long enough for a page on a busy machine; the test ends it.
    demo.args(["demo", "--rounds", "900", "--view"])
        .arg(format!("--device=emulated:{}", image.display()))
        .arg("--out")
        .arg(&folder);
    let mut demo = Running::start_with_viewer(&mut demo, &format!("-o {}", live.display()));
    let address = demo.address();
    let page = browser.open(&address);
    let mut is_touched = || {
        assert!(demo.is_running(), "it ended before the page was seen");
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
    let reported = demo.output();
    for figure in [" run, 0 late", " 0 lost on the link, 0 dropped"] {
        assert!(reported.contains(figure), "{reported}");
    }
    assert!(!reported.contains("not shown"), "{reported}");
    check(&Csv::read(&folder.join("fractal.csv")), &entities(&live));
    remove(&folder);
}

/// Bounds of the difference of equal pictures, and of different ones: means over all pixels and
/// colours, of 255.
const SAME: f64 = 0.5;
const OTHER: f64 = 4.0;

#[test]
fn pan_and_zoom_under_a_resting_hand_move_the_picture_and_back() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("moved");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    let mut viewer = Viewer::start("--linger 0s");
    let begin = [greeting(), scene(true), layer()];
    for message in begin.iter().chain(&tiles_around([2, 2])) {
        assert!(viewer.send(message));
    }
    let mut tick = 0;
    let mut rest = |viewer: &mut Viewer, scale: f64, east_mm: f64| {
        // Longer than the trace, so that the earlier one is no longer in the picture.
        let ticks = tick..tick + 6000;
        tick = ticks.end;
        let samples = ticks.map(resting(scale, east_mm)).collect::<Vec<_>>();
        for samples in samples.chunks(100) {
            assert!(viewer.send(&Message::Samples(samples.to_vec())));
        }
    };
    rest(&mut viewer, 1.0, 0.0);
    let page = browser.open(&viewer.address());
    let mut feed_samples = || rest(&mut viewer, 1.0, 0.0);
    shown(&mut browser, &page, &mut feed_samples, is_whole);
    // Waits for a correct picture that is followed by an equal one.
    let mut settled = |is_right: &dyn Fn(&mut Browser, &str) -> bool| {
        let until = Instant::now() + HANG;
        let mut before = browser.picture(&page);
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let picture = browser.picture(&page);
            let is_still = browser.difference(&page, [&before, &picture], TERRAIN) < 0.05;
            if is_still && is_right(&mut browser, &picture) {
                return picture;
            }
            before = picture;
            assert!(
                Instant::now() < until,
                "the picture does not become correct"
            );
        }
    };
    let first = settled(&|_, _| true);
    for (scale, east_mm) in [(1.0, 25.0), (1.0, 0.0), (2.0, 0.0), (1.0, 0.0)] {
        assert!(viewer.send(&zoomed_scene(scale, east_mm)));
        rest(&mut viewer, scale, east_mm);
        let is_first = (scale, east_mm) == (1.0, 0.0);
        settled(&|browser, picture| {
            let difference = browser.difference(&page, [&first, picture], TERRAIN);
            if is_first {
                difference < SAME
            } else {
                difference > OTHER
            }
        });
    }
    drop(browser);
    assert!(viewer.end());
    remove(&folder);
}

#[test]
fn commands_of_a_session_zoom_its_page_and_reset_it() {
    let Some(mut demo) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    };
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder("commands");
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    demo.args(["demo", "--device", "native", "--rounds", "900", "--view"])
        .args(["--commands", "-", "--out"])
        .arg(&folder)
        .stdin(Stdio::piped());
    let mut demo = Running::start_with_viewer(&mut demo, "");
    let page = browser.open(&demo.address());
    shown(&mut browser, &page, &mut || {}, is_whole);
    // White on the map, twice the expected value in a row: the hand continues to cross the lines.
    let mut white = |is_right: &dyn Fn(usize) -> bool| {
        let (until, mut before) = (Instant::now() + HANG, false);
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let picture = browser.picture(&page);
            let count = browser.colours(&page, &picture, MAP, &[WHITE]).near[0];
            let is_so = is_right(count);
            if is_so && before {
                return count;
            }
            before = is_so;
            assert!(Instant::now() < until, "{count} pixels");
        }
    };
    let whole = white(&|count| count > MIN_DECREASE);
    demo.type_lines("zoom 2\nzoom 2\n");
    let zoomed = white(&|count| count + MIN_DECREASE < whole);
    demo.type_lines("reset\n");
    white(&|count| count > zoomed + MIN_DECREASE / 2);
    drop(browser);
    demo.interrupt();
    assert!(demo.end());
    let reported = demo.output();
    assert!(!reported.contains("not shown"), "{reported}");
    remove(&folder);
}

/// The program that is killed while a page is open.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Killed {
    Hapterra,
    Viewer,
}

fn killed(who: Killed, says: &str) {
    let Some(mut demo) = hapterra() else {
        println!("SKIPPED: HAPTERRA names no program; cargo xtask view --test does");
        return;
    };
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder(&format!("killed-{}", who as u8));
    let Some(mut browser) = browser_in(&folder) else {
        return;
    };
    demo.args([
        "demo", "--device", "native", "--rounds", "900", "--view", "--out",
    ]);
    let mut demo = Running::start_with_viewer(demo.arg(&folder), "");
    let page = browser.open(&demo.address());
    let viewer = child_process(demo.id(), "hapterra-view").expect("a viewer");
    shown(&mut browser, &page, &mut || {}, is_whole);
    signal(
        "-KILL",
        if who == Killed::Viewer {
            viewer
        } else {
            demo.id()
        },
    );
    let until = Instant::now() + HANG;
    while !{ browser.value(&page, "document.getElementById('said').textContent") }
        .as_str()
        .is_some_and(|text| text.contains(says))
    {
        assert!(Instant::now() < until, "the page does not show it");
        std::thread::sleep(Duration::from_millis(200));
    }
    drop(browser);
    if who == Killed::Viewer {
        std::thread::sleep(Duration::from_secs(1));
        assert!(demo.is_running());
        demo.interrupt();
        assert!(demo.end());
        let reported = demo.output();
        assert!(
            reported.contains(" 0 lost on the link, 0 dropped"),
            "{reported}"
        );
        assert!(
            reported.contains("were not shown: the viewer was slow, or had ended"),
            "{reported}"
        );
    }
    // No page is open any more.
    let until = Instant::now() + HANG;
    while memory_of(viewer) > 0 {
        assert!(Instant::now() < until, "the viewer does not end");
        std::thread::sleep(Duration::from_millis(50));
    }
    remove(&folder);
}

#[test]
fn page_reports_hapterra_killed_and_viewer_exits() {
    killed(Killed::Hapterra, "hapterra ended unexpectedly");
}

#[test]
fn page_reports_viewer_killed_and_session_continues() {
    killed(Killed::Viewer, "hapterra-view has ended");
}
