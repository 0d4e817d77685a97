//! Other tick rates.

use hapterra::link::{Arming, Event, Native, Session, Timeouts};
use hapterra::phantom::{ArmFrame, HandModel, HeldPhantom, PhantomModel};
use hapterra_core::force::SurfaceParams;
use hapterra_core::guard::{Fault, Mode};
use hapterra_core::scene::{Source, TickRecord};
use hapterra_firmware::native::StoppedClock;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use crate::guard::rig::{MIDDLE_MM, PLANE_MM, PRESSED, on_plane, plane, press};

#[test]
fn arming_ramp_and_force_are_unchanged_at_10_khz() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let [x, y] = MIDDLE_MM;
    let home_mm = [x, y, PLANE_MM + 4.0];
    let model = PhantomModel::premium_1_5();
    let (hand, place) = (HandModel::default(), ArmFrame { home_mm });
    let rig = HeldPhantom::new(model, hand, place, press(1.0).finish()).expect("in reach");
    let off = Rc::new(RefCell::new(None));
    let seen = Rc::clone(&off);
    let released = 10 * PRESSED;
    let device = Native::new(StoppedClock::<10>, Some(Box::new(rig.arming()))).with_fault_injector(
        Box::new(move |tick, sense, drive| {
            if tick > released && !drive.enabled {
                seen.borrow_mut().get_or_insert(tick - 1);
            }
            sense.dead_man &= tick < released;
        }),
    );
    let home = terrain.scale().to_grid(home_mm).expect("addressable");
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Encoders, home);
    let (arming, link) = (Arming::VIRTUAL, Box::new(device));
    let opened = Session::open(&terrain, scene, Some(arming), link, Timeouts::EMULATED);
    let (mut session, hello) = opened.expect("opened");
    assert_eq!(hello.tick_hz, 10_000);
    let mut samples: Vec<TickRecord> = Vec::new();
    while samples.last().map_or(0, |last| u64::from(last.tick)) < released + 1_000 {
        let polled = session.poll(Duration::ZERO, &mut |event| {
            if let Event::Sample(sample) = event {
                samples.push(*sample);
            }
        });
        polled.expect("it continues");
    }
    let stats = session.stats();
    assert_eq!(
        (stats.lost, stats.dropped),
        (0, 0),
        "a thousand samples a second"
    );
    assert!(
        samples
            .windows(2)
            .all(|pair| pair[1].tick - pair[0].tick == 10)
    );
    let at = |mode| {
        samples
            .iter()
            .find(|s| s.mode == mode)
            .expect("reached")
            .tick
    };
    assert!((19_990..=20_010).contains(&(at(Mode::Armed) - at(Mode::Ramping))));
    let before = samples.iter().rev().find(|s| u64::from(s.tick) < released);
    let force = before.expect("samples").force_n;
    assert!((force.z - 1.0).abs() < 0.1, "{force}");
    assert_eq!(*off.borrow(), Some(released));
    let fault = samples.last().and_then(|sample| sample.fault);
    assert_eq!(fault, Some(Fault::DeadManReleased));
}
