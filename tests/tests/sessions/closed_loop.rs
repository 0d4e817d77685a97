//! The virtual Phantom in a loop with the device's own application: the results in millimetres and
//! newtons.

use std::time::Duration;

use hapterra::link::{Arming, Event, Native, Session, Timeouts};
use hapterra::phantom::PlacedTerrain;
use hapterra::phantom::{ArmFrame, HandModel, HeldPhantom, PhantomModel, Script, Touch};
use hapterra::replay::Record;
use hapterra::synth::{Kind, Synth};
use hapterra::telemetry::Figures;
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_firmware::native::StoppedClock;
use heightfield::Raster;

/// Runs a device until a tick. Returns every sample it reported.
fn run(terrain: &Terrain<'_>, scene: Scene, rig: HeldPhantom, ticks: u32) -> Vec<TickRecord> {
    let device: Native = Native::new(StoppedClock, Some(Box::new(rig.arming())));
    let device = Box::new(device);
    let (mut session, _) = Session::open(
        terrain,
        scene,
        Some(Arming::VIRTUAL),
        device,
        Timeouts::EMULATED,
    )
    .expect("opened");
    let mut samples = Vec::new();
    while samples
        .last()
        .is_none_or(|last: &TickRecord| last.tick < ticks)
    {
        let mut on_event = |event: Event<'_>| {
            if let Event::Sample(sample) = event {
                samples.push(*sample);
            }
        };
        session
            .poll(Duration::ZERO, &mut on_event)
            .expect("it continues");
    }
    assert_eq!(session.stats().lost + session.stats().dropped, 0);
    assert!(samples.iter().all(|sample| sample.fault.is_none()));
    samples
}

/// Renders a plane 20 mm up with a stiffness, with a hand that presses with 2 N in its middle and
/// lifts. Returns the samples and the start of the lift.
fn press(stiffness_n_per_mm: f32) -> (Vec<TickRecord>, usize, Scale) {
    let raster = Raster::from_fn(101, 101, |_, _| 20.0).expect("raster");
    let scale = Scale::new(2.0, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let hand = HandModel::default();
    let wall = f64::from(stiffness_n_per_mm);
    let pressed =
        Touch::start(&|_, _| Some(20.0), &hand, wall, [100.0, 100.0], 10.0).press(2.0, 1.5);
    let lift_s = pressed.script().duration_s();
    let script: Script = pressed.lift(10.0).finish().wait(0.5);
    let ticks = ((HeldPhantom::ARMED_S + script.duration_s()) * 1e3) as u32;
    let home_mm = [100.0, 100.0, 24.0];
    // With all its weight, which the device compensates.
    let model = PhantomModel::premium_1_5();
    let rig = HeldPhantom::new(model, hand, ArmFrame { home_mm }, script).expect("in reach");
    let params = SurfaceParams {
        stiffness_n_per_mm,
        max_force_n: 8.5,
        ..SurfaceParams::PREMIUM
    };
    let home = scale.to_grid(home_mm).expect("addressable");
    let scene = terrain.scene(params, Source::Encoders, home);
    let samples = run(&terrain, scene, rig, ticks);
    (
        samples,
        ((HeldPhantom::ARMED_S + lift_s) * 1e3) as usize,
        scale,
    )
}

#[test]
fn tip_rests_at_the_depth_of_two_newtons() {
    for stiffness in [0.5f32, 0.25, 1.0] {
        let (samples, lift, scale) = press(stiffness);
        let expected_mm = 2.0 / f64::from(stiffness);
        // Friction carries 0.01 N·m on an arm of 0.21 m against the springs of wall and hand
        // together; two encoders are half a count off.
        let hand_n_per_mm = 1e-3 / HandModel::default().compliance_m_per_n();
        let bound_mm = 0.01 / 0.2095 / (f64::from(stiffness) + hand_n_per_mm) + 0.03;
        for sample in &samples[lift - 300..lift - 5] {
            assert_eq!(sample.state, ContactState::Touching);
            let depth = 20.0 - scale.to_mm(&sample.hip)[2];
            assert!(
                (depth - expected_mm).abs() < bound_mm,
                "{stiffness} N/mm: {depth} mm deep, {expected_mm} ± {bound_mm} expected"
            );
            let spring = f64::from(stiffness) * depth;
            assert!((f64::from(sample.force_n.z) - spring).abs() < 1e-3);
        }
    }
}

#[test]
fn lifted_hand_has_no_force() {
    let (samples, _, _) = press(0.5);
    let end = &samples[samples.len() - 300..];
    assert!(end.iter().all(|s| s.state == ContactState::Free));
    assert!(end.iter().all(|s| s.force_n.length() == 0.0));
}

/// Mean error of the proxy's height against the bilinear surface in `f64`, mm.
const HEIGHT_ERROR_MM: f64 = 1e-5;

#[test]
fn sliding_proxy_stays_on_surface_and_force_in_bounds() {
    for kind in [Kind::Fractal, Kind::Crater] {
        let raster = Synth::new(kind, 2, 30.0).raster(400, 400).expect("raster");
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let placed = PlacedTerrain::new(&terrain, SurfaceParams::PREMIUM).expect("placed");
        let ticks = (placed.duration_s() * 1e3) as u32;
        let rig = placed.held_phantom();
        let samples = run(&terrain, placed.scene(), rig, ticks);
        let mut figures = Figures::default();
        for sample in &samples {
            let record = Record::of_tick(sample, 1000, &scale);
            figures.add(sample, &record, &terrain);
        }
        let mean = figures.height_error_mm.mean();
        eprintln!(
            "{kind:?}: {} ticks in contact, mean height error {mean:.2e} mm, mean force {:.2} N",
            figures.force_n.count(),
            figures.force_n.mean()
        );
        assert!(figures.height_error_mm.count() > 4000, "hardly a touch");
        assert!(mean < HEIGHT_ERROR_MM, "{kind:?}: {mean} mm");
        assert!((0.3..3.0).contains(&figures.force_n.mean()));
        assert!(figures.force_n.max() <= 8.5);
        let last = samples.last().expect("samples");
        assert_eq!(
            (last.state, last.force_n.length()),
            (ContactState::Free, 0.0)
        );
    }
}
