//! The host leaves, with or without closing the session.

use hapterra::phantom::{HandModel, Touch};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::guard::{GuardInputs, GuardOutputs, Limits, Mode};
use heightfield::Raster;

use crate::guard::rig::{Bed, MIDDLE_MM, NOTHING, PLANE_MM, PRESSED, on_plane, plane, press};

/// Returns the largest change of the currents from one tick to the next, A.
fn max_step(log: &[(GuardInputs, GuardOutputs)]) -> f32 {
    let steps = log.windows(2).map(|pair| {
        let change = pair[1].1.currents_a - pair[0].1.currents_a;
        change.abs().max_element()
    });
    steps.fold(0.0, f32::max)
}

/// Safety: 25, response times.
#[test]
fn force_fades_at_edge_of_stored_tiles_after_host_leaves() {
    // Cells of a quarter of a millimetre: a tile is 8 mm, so the hand leaves the stored tiles.
    let raster = Raster::from_fn(801, 801, |_, _| PLANE_MM as f32).expect("raster");
    let scale = Scale::new(0.25, 1.0).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    let [x, y] = MIDDLE_MM;
    let hand = HandModel::default();
    let surface = |_: f64, _: f64| Some(PLANE_MM);
    let script = Touch::start(&surface, &hand, 0.5, MIDDLE_MM, 10.0)
        .press(1.0, 1.0)
        .slide(&[[x + 60.0, y]], 1.0, 40.0)
        .finish();
    let mut bed = Bed::new(&terrain, script, NOTHING).run(PRESSED);
    assert!(bed.sample(PRESSED).force_n.z > 0.8);
    bed.session = None;
    let passed = 4_000;
    bed.device.borrow_mut().run_ticks(passed);
    {
        let log = bed.log.borrow();
        let alone = &log[PRESSED as usize..];
        assert!(
            alone
                .iter()
                .all(|(_, d)| d.enabled || d == &alone[alone.len() - 1].1)
        );
        let weight = alone[alone.len() - 2].1.currents_a;
        let step = max_step(&alone[..alone.len() - 1]);
        eprintln!("largest step {step:.3} A, at the end {weight} A");
        assert!(step < 0.06, "{step} A");
        // Only the arm's weight remains: −0.062 A on axis 2, and the same on 3.
        assert!(weight.abs().max_element() < 0.3, "{weight}");
    }
    // After the return the force ramps up as gently.
    bed.open(None);
    let before = bed.log.borrow().len() - 1;
    bed = bed.run(PRESSED + u64::from(passed) + 600);
    let log = bed.log.borrow();
    let step = max_step(&log[before..log.len() - 1]);
    eprintln!("largest step after the return {step:.3} A");
    assert!(step < 0.06, "{step} A");
    let last = bed.samples.last().expect("samples");
    // Released at the edge, the surface is rendered again after the hand was above it.
    assert_eq!((last.mode, last.fault), (Mode::Armed, None));
    assert_eq!(
        (last.state, last.missing_tile),
        (ContactState::Unseeded, None)
    );
    // While the host was away, the device reported why the force was lower.
    let reasons = bed.samples.iter().map(|s| s.limits);
    let why = reasons.fold(Limits::empty(), |all, limits| all | limits);
    eprintln!("limits: {why:?}");
}

/// Safety: 25, response times.
#[test]
fn closing_ramps_the_force_down_and_disarms() {
    let raster = plane();
    let terrain = on_plane(&raster);
    let mut bed = Bed::new(&terrain, press(2.0).finish(), NOTHING).run(PRESSED);
    let session = bed.session.as_mut().expect("open");
    session.close(&mut |_| {}).expect("confirmed");
    assert!(!bed.device.borrow().outputs().enabled, "as reported");
    bed.device.borrow_mut().run_ticks(300);
    let log = bed.log.borrow();
    let off = bed.off_at() as usize;
    assert!((90..130).contains(&(off - PRESSED as usize)), "{off}");
    let going = &log[PRESSED as usize - 10..off];
    let before = going[0].1.currents_a.abs().max_element();
    let step = max_step(going);
    assert!(before > 1.0 && step < 0.02 * before, "{before} A, {step} A");
    assert!(log[off..].iter().all(|(_, drive)| !drive.enabled));
}
