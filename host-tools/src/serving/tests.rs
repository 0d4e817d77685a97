//! Tests of every end of a service, with a device in memory.

use std::cell::{Cell, RefCell};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::rc::Rc;
use std::time::Duration;

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::Source;
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, SessionEnd};

use super::{End, ServedSession, Service, SessionHandler};
use crate::link::{
    Arming, ControlSession, Event, HostRequest, LinkError, LinkStats, Native, Timeouts, Transport,
};
use crate::terrain::{Scale, Terrain};
use heightfield::Raster;

const fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

/// Short, because the device answers at once.
const TIMEOUTS: Timeouts = Timeouts {
    retry: ms(10),
    heartbeat: ms(20),
    hello_retry: ms(40),
    give_up: ms(400),
    goodbye: ms(200),
    silence_s: DEFAULT_SILENCE_S,
};

/// A device, and the faults of the lines to it.
#[derive(Clone)]
struct Bench {
    device: Rc<RefCell<Native>>,
    /// Number of open lines.
    lines: Rc<Cell<u32>>,
    /// True if nothing arrives at the device.
    deaf: Rc<Cell<bool>>,
    /// Nothing arrives from the device either, over the lines up to this one.
    dead_up_to: Rc<Cell<u32>>,
    /// Number of lines opened so far.
    made: Rc<Cell<u32>>,
    reported: Rc<RefCell<Vec<String>>>,
    /// The host's time: a millisecond for each poll of a line.
    time: Rc<Cell<Duration>>,
}

/// A line to the device.
struct Line {
    bench: Bench,
    number: u32,
}

impl Transport for Line {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Bench { device, deaf, .. } = &self.bench;
        match deaf.get() || self.is_dead() {
            true => Ok(()),
            false => device.borrow_mut().send(bytes),
        }
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        let time = &self.bench.time;
        time.set(time.get() + ms(1));
        match self.is_dead() {
            true => Ok(0),
            false => self.bench.device.borrow_mut().receive(into, wait),
        }
    }

    fn now(&self) -> Duration {
        self.bench.time.get()
    }
}

impl Line {
    fn is_dead(&self) -> bool {
        self.number <= self.bench.dead_up_to.get()
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        let lines = &self.bench.lines;
        lines.set(lines.get() - 1);
    }
}

impl Bench {
    fn new() -> Self {
        let device = Native::for_replay().free_running().with_ticks_per_call(20);
        Self {
            device: Rc::new(RefCell::new(device)),
            lines: Rc::default(),
            deaf: Rc::default(),
            dead_up_to: Rc::default(),
            made: Rc::default(),
            reported: Rc::default(),
            time: Rc::default(),
        }
    }

    fn line(&self) -> Line {
        self.made.set(self.made.get() + 1);
        self.lines.set(self.lines.get() + 1);
        Line {
            bench: self.clone(),
            number: self.made.get(),
        }
    }

    /// Opens a line as USB does: fails while another is open.
    fn only_line(&self) -> Result<Box<dyn Transport>, LinkError> {
        match self.lines.get() {
            0 => Ok(Box::new(self.line())),
            _ => Err(absent()),
        }
    }

    /// Returns the end of the last session, as reported to the next host.
    fn last_end(&self) -> SessionEnd {
        self.deaf.set(false);
        let line = Box::new(self.line());
        let control = ControlSession::open(line, TIMEOUTS.give_up).expect("it answers");
        control.device().last.end
    }

    fn was_reported(&self) -> bool {
        let reported = self.reported.borrow();
        reported
            .iter()
            .any(|line| line.contains("switch the amplifiers off"))
    }
}

fn absent() -> LinkError {
    LinkError::Absent {
        searched_for: "a line".into(),
        why: "it is in use".into(),
    }
}

/// A handler that ends after a number of polls, and calls `last` in the last one.
struct LimitedHandler<'l> {
    left: u32,
    last: Box<dyn FnMut() + 'l>,
    received: Vec<String>,
}

impl<'l> LimitedHandler<'l> {
    fn times(left: u32, last: impl FnMut() + 'l) -> Self {
        Self {
            left,
            last: Box::new(last),
            received: vec![],
        }
    }
}

impl SessionHandler<'_> for LimitedHandler<'_> {
    fn on_event(&mut self, _: Event<'_>) {}

    fn notify(&mut self, line: &str) {
        self.received.push(line.to_owned());
    }

    fn requests(&mut self) -> Vec<HostRequest> {
        vec![]
    }

    fn show(&mut self, _: &LinkStats) {
        self.left -= 1;
        if self.left == 0 {
            (self.last)();
        }
    }

    fn is_over(&self) -> bool {
        self.left == 0
    }
}

/// Runs a service to the bench's device over lines from `connect`.
fn run_service<T>(
    bench: &Bench,
    should_continue: &dyn Fn() -> bool,
    connect: &mut dyn FnMut() -> Result<Box<dyn Transport>, LinkError>,
    run: impl FnOnce(Service<'_, '_>) -> T,
) -> T {
    let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("raster");
    let scale = Scale::new(1.0, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let home = GridPoint::default();
    run(Service {
        terrain: &terrain,
        scene: terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home),
        arming: Arming::default(),
        timeouts: TIMEOUTS,
        connect: Box::new(|| connect().map(|line| line as Box<dyn Transport>)),
        device: "the bench".into(),
        retry: ms(1),
        should_continue,
        notify: &|line| bench.reported.borrow_mut().push(line.to_owned()),
    })
}

fn open<'s, 't>(service: Service<'s, 't>) -> Result<ServedSession<'s, 't>, LinkError> {
    service.open(|_| Ok(())).map(|(served, _)| served)
}

/// Serves for a number of polls; calls `last` in the last one.
fn served(bench: &Bench, polls: u32, last: &mut dyn FnMut()) -> (End, Vec<String>) {
    let mut handler = LimitedHandler::times(polls, last);
    let end = run_service(bench, &|| true, &mut || bench.only_line(), |service| {
        let served = open(service).expect("it answers");
        served.serve(&mut handler)
    });
    (end, handler.received)
}

#[test]
fn finished_run_closes_the_session_or_reports_no_confirmation() {
    let bench = Bench::new();
    let (end, _) = served(&bench, 5, &mut || {});
    assert!(end.result.is_ok() && end.disarmed.is_ok(), "{end:?}");
    assert_eq!(bench.last_end(), SessionEnd::Goodbye);
    let (end, _) = served(&bench, 5, &mut || bench.deaf.set(true));
    assert!(end.result.is_ok(), "{end:?}");
    assert!(matches!(end.disarmed, Err(LinkError::NotConfirmed)));
    assert_eq!(bench.last_end(), SessionEnd::Replaced);
}

/// Safety: 26.
#[test]
fn panic_closes_the_session_or_warns_the_user() {
    for deaf in [false, true] {
        let bench = Bench::new();
        let mut last = || {
            bench.deaf.set(deaf);
            panic!("written bytes are not read");
        };
        let panicked = catch_unwind(AssertUnwindSafe(|| served(&bench, 5, &mut last)));
        assert!(panicked.is_err());
        assert_eq!(bench.was_reported(), deaf);
        let end = [SessionEnd::Goodbye, SessionEnd::Replaced][usize::from(deaf)];
        assert_eq!(bench.last_end(), end);
    }
}

/// Safety: 26.
#[test]
fn failed_start_closes_the_session_or_warns_the_user() {
    for deaf in [false, true] {
        let bench = Bench::new();
        // The host before was killed.
        let line = Box::new(bench.line());
        let killed = ControlSession::open(line, TIMEOUTS.give_up).expect("it answers");
        bench.deaf.set(deaf);
        drop(killed);
        let start = run_service(&bench, &|| true, &mut || bench.only_line(), |service| {
            service.open(|_| Err(absent())).map(|_| ())
        });
        assert!(matches!(start, Err(LinkError::Absent { .. })), "{start:?}");
        assert_eq!(bench.was_reported(), deaf);
        let end = [SessionEnd::Goodbye, SessionEnd::Replaced][usize::from(deaf)];
        assert_eq!(bench.last_end(), end);
    }
    let bench = Bench::new();
    bench.deaf.set(true);
    let start = run_service(&bench, &|| true, &mut || bench.only_line(), |service| {
        open(service).map(|_| ())
    });
    assert!(matches!(start, Err(LinkError::Silent(_))), "{start:?}");
    assert!(bench.was_reported());
}

#[test]
fn interrupt_during_opening_closes_the_session() {
    let bench = Bench::new();
    let start = run_service(&bench, &|| false, &mut || bench.only_line(), |service| {
        open(service).map(|_| ())
    });
    assert!(matches!(start, Err(LinkError::Interrupted)), "{start:?}");
    assert_eq!(bench.last_end(), SessionEnd::Goodbye);
}

#[test]
fn silent_device_is_reopened_once_its_first_line_is_closed() {
    let bench = Bench::new();
    let mut handler = LimitedHandler::times(2_000, || {});
    let mut connect = || {
        // Fail here, because the test would hang otherwise.
        let waits = bench.lines.get() > 0 && bench.made.get() > 0;
        assert!(!waits, "the line before is not closed");
        bench.only_line()
    };
    let end = run_service(&bench, &|| true, &mut connect, |service| {
        let served = open(service).expect("it answers");
        bench.dead_up_to.set(1);
        served.serve(&mut handler)
    });
    assert!(end.result.is_ok() && end.disarmed.is_ok(), "{end:?}");
    let received = handler.received.join("\n");
    assert!(received.contains("continues where it was"), "{received}");
    assert_eq!(bench.last_end(), SessionEnd::Goodbye);
}

#[test]
fn close_during_an_outage_is_sent_after_it() {
    for back in [true, false] {
        let bench = Bench::new();
        let should_continue = Cell::new(true);
        let mut made = 0;
        let mut connect = || {
            made += 1;
            match made {
                1 => bench.only_line(),
                2 => {
                    should_continue.set(false);
                    Err(absent())
                }
                _ if back => bench.only_line(),
                _ => Err(absent()),
            }
        };
        let mut handler = LimitedHandler::times(u32::MAX, || {});
        let end = run_service(&bench, &|| should_continue.get(), &mut connect, |service| {
            let served = open(service).expect("it answers");
            bench.dead_up_to.set(1);
            served.serve(&mut handler)
        });
        assert!(end.result.is_ok(), "{end:?}");
        assert_eq!(end.disarmed.is_ok(), back, "{end:?}");
        let last = [SessionEnd::Replaced, SessionEnd::Goodbye][usize::from(back)];
        assert_eq!(bench.last_end(), last);
    }
}

/// Safety: 32.
#[test]
fn losing_the_device_warns_of_an_armed_arm() {
    let bench = Bench::new();
    let mut another = None;
    let mut handler = LimitedHandler::times(u32::MAX, || {});
    let end = run_service(&bench, &|| true, &mut || bench.only_line(), |service| {
        let served = open(service).expect("it answers");
        let line = Box::new(bench.line());
        another = Some(ControlSession::open(line, TIMEOUTS.give_up).expect("it answers"));
        served.serve(&mut handler)
    });
    let Err(taken @ LinkError::Taken) = end.result else {
        panic!("{end:?}");
    };
    assert!(taken.to_string().contains("may be armed"), "{taken}");
    assert!(end.disarmed.is_ok());
    drop(another);
    assert_eq!(bench.last_end(), SessionEnd::Replaced);
}
