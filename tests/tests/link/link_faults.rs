//! Links that lose, damage and repeat bytes, hosts that end abruptly, different versions: the
//! host's client with the device's own application, in memory.

use std::cell::{Cell, RefCell};
use std::io;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Arming, Event, LinkError, Native, Session, Timeouts, Transport};
use hapterra::phantom::PlacedTerrain;
use hapterra::replay::{OfflineDevice, on_native};
use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::Mode;
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::hello::PROTOCOL;
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::session::InSession;
use hapterra_core::wire::version::VersionCheck;
use hapterra_firmware::native::StoppedClock;
use hapterra_tests::faulty_links::{Fault, Faulty, Shared};
use hapterra_tests::random_paths::wander;
use hapterra_tests::timeouts::HANG;
use heightfield::Raster;

/// A device in memory answers at once: an answer that has not arrived after a moment is lost.
const AT_ONCE: Timeouts = Timeouts {
    retry: Duration::from_millis(2),
    heartbeat: Duration::from_millis(2),
    hello_retry: Duration::from_millis(10),
    give_up: HANG,
    goodbye: HANG,
    ..Timeouts::REAL_TIME
};

fn fractal() -> Raster {
    Synth::new(Kind::Fractal, 5, 30.0)
        .raster(300, 300)
        .expect("raster")
}

fn unit() -> Scale {
    Scale::new(1.0, 1.0).expect("scale")
}

fn rendered(sample: &TickRecord) -> (GridPoint, GridPoint, [u32; 3], ContactState) {
    let bits = sample.force_n.to_array().map(f32::to_bits);
    (sample.hip, sample.proxy, bits, sample.state)
}

#[test]
fn force_is_the_same_over_a_bad_link() {
    let raster = fractal();
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    let params = SurfaceParams::PREMIUM;
    let path = wander(&terrain, 9, 1200, 1.0);
    let walk = |replayer: &mut OfflineDevice<'_>| -> Vec<_> {
        let hips = path
            .iter()
            .map(|mm| unit().to_grid(*mm).expect("addressable"));
        hips.map(|hip| rendered(&replayer.step(hip).expect("rendered")))
            .collect()
    };
    let mut clean = on_native(&terrain, params).expect("opened");
    let expected = walk(&mut clean);
    // The last one duplicates everything, including the `Hello` message.
    for (fault, one_in) in [
        (Fault::Flip, 20),
        (Fault::Drop, 20),
        (Fault::Twice, 20),
        (Fault::Twice, 1),
    ] {
        let link = Faulty::new(Native::for_replay(), fault, one_in, 1);
        let harmed = Rc::clone(&link.harmed);
        let mut replayer =
            OfflineDevice::open(&terrain, params, Box::new(link), AT_ONCE).expect("opened");
        let got = walk(&mut replayer);
        assert!(expected == got, "{fault:?} changed the force");
        let stats = replayer.stats();
        eprintln!("{fault:?}: {} transfers harmed, {stats:?}", harmed.borrow());
        assert!(*harmed.borrow() > 50, "no fault was injected");
        if fault != Fault::Twice {
            assert!(stats.bad_frames > 0);
        }
    }
}

/// Reads the device's bytes before any fault: counts its samples, and stores its final count of
/// dropped ones.
struct Tap {
    device: Native,
    reader: Box<FrameReader<MAX_FRAME>>,
    made: Rc<Cell<(u64, u64)>>,
}

impl Transport for Tap {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.device.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        let n = self.device.receive(into, wait)?;
        let mut rest = &into[..n];
        while !rest.is_empty() {
            let (consumed, frame) = self.reader.push(rest);
            rest = &rest[consumed..];
            let message = frame.map(|frame| frame.and_then(decode::<InSession<ToHost>>));
            let (samples, dropped) = self.made.get();
            match message.map(|framed| framed.expect("whole").message) {
                Some(ToHost::Telemetry(telemetry)) => {
                    let samples = samples + telemetry.samples.len() as u64;
                    self.made.set((samples, dropped));
                }
                Some(ToHost::Goodbye(count)) => {
                    self.made.set((samples, u64::from(count.dropped)));
                }
                _ => {}
            }
        }
        Ok(n)
    }
}

/// Safety: images.
#[test]
fn telemetry_that_is_lost_is_counted() {
    let raster = fractal();
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    let placed = PlacedTerrain::new(&terrain, SurfaceParams::PREMIUM).expect("placed");
    let rig = placed.held_phantom();
    let made = Rc::new(Cell::new((0, 0)));
    let device: Native = Native::new(StoppedClock, Some(Box::new(rig)));
    let tap = Tap {
        device,
        reader: Box::default(),
        made: Rc::clone(&made),
    };
    let link = Faulty::new(tap, Fault::Drop, 10, 3);
    let (scene, link) = (placed.scene(), Box::new(link));
    let (mut session, _) =
        Session::open(&terrain, scene, Some(Arming::VIRTUAL), link, AT_ONCE).expect("opened");
    let mut last = 0;
    while last < 4000 {
        session
            .poll(Duration::ZERO, &mut |event| {
                if let Event::Sample(sample) = event {
                    assert!(sample.tick > last, "a sample arrived twice or too late");
                    last = sample.tick;
                }
            })
            .expect("it continues");
    }
    session.close(&mut |_| {}).expect("confirmed");
    let stats = session.stats();
    // Losses before the first and after the last sample received are counted as well.
    eprintln!("{last} ticks, {stats:?}");
    assert!(stats.lost + stats.dropped > 100, "no fault was injected");
    assert_eq!((stats.sessions, stats.uncertain), (1, 0));
    assert_eq!((stats.samples + stats.lost, stats.dropped), made.get());
}

#[test]
fn returning_host_resumes_the_session_of_its_device() {
    let raster = fractal();
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    let placed = PlacedTerrain::new(&terrain, SurfaceParams::PREMIUM).expect("placed");
    let rig = placed.held_phantom();
    let device: Native = Native::new(StoppedClock, Some(Box::new(rig)));
    let device = Rc::new(RefCell::new(device));
    let watch = |session: &mut Session<'_>, until: u32| {
        let mut last = TickRecord::default();
        while last.tick < until {
            session
                .poll(Duration::ZERO, &mut |event| {
                    if let Event::Sample(sample) = event {
                        last = *sample;
                    }
                })
                .expect("it continues");
        }
        last
    };
    let link = || Box::new(Shared(Rc::clone(&device)));
    let scene = placed.scene();
    let (mut session, hello) =
        Session::open(&terrain, scene, Some(Arming::VIRTUAL), link(), AT_ONCE).expect("opened");
    assert_eq!(hello.epoch, None);
    let before = watch(&mut session, 4500);
    assert_eq!(before.mode, Mode::Armed);
    assert_eq!(before.state, ContactState::Touching);
    let fetched = session.stats().tiles;
    drop(session);
    // It ends in the middle of a frame, and is absent for half a second.
    device.borrow_mut().send(&[7; 30]).expect("sent");
    device.borrow_mut().run_ticks(500);
    let (mut session, hello) =
        Session::open(&terrain, placed.scene(), None, link(), AT_ONCE).expect("opened again");
    assert_eq!(
        hello.epoch,
        Some(placed.scene().epoch),
        "the scene was kept"
    );
    let after = watch(&mut session, before.tick + 700);
    assert_eq!(after.state, ContactState::Touching);
    assert!(after.tick >= before.tick + 500, "its time went on");
    assert_eq!((after.mode, after.fault), (Mode::Armed, None));
    let again = session.stats().tiles;
    assert!(again < fetched, "{again} tiles again after {fetched}");
}

#[test]
fn device_restart_ends_a_replay_with_an_error() {
    let raster = fractal();
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    /// Replaces the device by a new one during the session.
    struct Restarting(Native, u32);
    impl Transport for Restarting {
        fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
            self.1 += 1;
            if self.1 == 30 {
                self.0 = Native::for_replay();
            }
            self.0.send(bytes)
        }
        fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
            self.0.receive(into, wait)
        }
    }
    let link = Box::new(Restarting(Native::for_replay(), 0));
    let mut replayer =
        OfflineDevice::open(&terrain, SurfaceParams::PREMIUM, link, AT_ONCE).expect("opened");
    let path = wander(&terrain, 9, 100, 1.0);
    let mut hips = path
        .iter()
        .map(|mm| unit().to_grid(*mm).expect("addressable"));
    let error = hips.find_map(|hip| replayer.step(hip).err());
    assert!(matches!(error, Some(LinkError::Restarted)), "{error:?}");
}

/// Returns the answer of a device to bytes outside of any session.
fn refusal(device: &mut Native, bytes: &[u8]) -> Option<VersionCheck> {
    device.send(bytes).expect("in memory");
    let mut chunk = [0; 512];
    let n = device
        .receive(&mut chunk, Duration::ZERO)
        .expect("in memory");
    let mut reader = FrameReader::<MAX_FRAME>::new();
    let (_, frame) = reader.push(&chunk[..n]);
    frame.map(|frame| frame.and_then(decode).expect("a refusal"))
}

#[test]
fn host_of_another_version_is_refused() {
    let mut device = Native::for_replay();
    let mut frame = [0; 64];
    for protocol in [PROTOCOL + 1, PROTOCOL - 1, u16::MAX] {
        let query = VersionCheck::Query { protocol };
        let bytes = encode(&query, &mut frame).expect("fits");
        let refused = VersionCheck::Refused { protocol: PROTOCOL };
        assert_eq!(refusal(&mut device, bytes), Some(refused), "{protocol}");
    }
}

#[test]
fn version_mismatch_error_names_both_protocols() {
    /// Answers every message with a refusal.
    struct Newer;
    impl Transport for Newer {
        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            Ok(())
        }
        fn receive(&mut self, into: &mut [u8], _: Duration) -> io::Result<usize> {
            let protocol = PROTOCOL + 1;
            let frame = encode(&VersionCheck::Refused { protocol }, into);
            Ok(frame.expect("fits").len())
        }
    }
    let raster = fractal();
    let terrain = Terrain::new(&raster, unit(), 0).expect("terrain");
    let replayer = OfflineDevice::open(&terrain, SurfaceParams::PREMIUM, Box::new(Newer), AT_ONCE);
    let error = replayer.err().expect("refused").to_string();
    let (ours, theirs) = (PROTOCOL, PROTOCOL + 1);
    assert!(error.contains("version mismatch"), "{error}");
    assert!(
        error.contains(&format!("speaks link protocol {theirs}")),
        "{error}"
    );
    assert!(
        error.contains(&format!("this command speaks {ours}")),
        "{error}"
    );
}
