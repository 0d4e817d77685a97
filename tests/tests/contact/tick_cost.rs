//! Cost of the whole chain from count to current on the emulated Cortex-M4F, in instructions, and
//! the depth of its stack.

use std::time::Duration;

use hapterra::link::{
    Arming, Emulator, Event, HostRequest, INSTRUCTIONS_PER_COUNT, Session, Timeouts, serve_plant,
};
use hapterra::phantom::PlacedTerrain;
use hapterra::synth::{Kind, Synth};
use hapterra::telemetry::Mean;
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::{Controller, Damping, SurfaceParams};
use hapterra_core::guard::Mode;
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::status::Status;
use hapterra_tests::emulation::emulated_board;

/// Most instructions of a tick in contact, on average: kinematics, contact, guard, torques, and the
/// rest of the loop. The controller is off; its cost is in `bench/instructions-m4f.csv`.
const IN_CONTACT: f64 = 2_500.0;

/// Returns the demonstration's samples on the emulated board, and its final status.
fn rendered() -> Option<(Vec<TickRecord>, Status)> {
    let (qemu, image) = emulated_board()?;
    let raster = Synth::new(Kind::Fractal, 1, 30.0)
        .raster(400, 400)
        .expect("raster");
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let params = SurfaceParams {
        damping: Damping {
            controller: Controller::Off,
            ..Damping::NONE
        },
        ..SurfaceParams::PREMIUM
    };
    let placed = PlacedTerrain::new(&terrain, params).expect("placed");
    let mut rig = placed.held_phantom();
    let (emulator, lines) = Emulator::start(&qemu, &image).expect("started");
    let mut plant = lines.plant;
    let ticks = (1e3 * placed.duration_s()) as u32;
    let rendered = std::thread::scope(|scope| {
        // Until the board disconnects.
        scope.spawn(move || serve_plant(&mut plant, &mut rig, &|| false));
        let link = Box::new(lines.link);
        let (scene, timeout) = (placed.scene(), Timeouts::EMULATED);
        let opened = Session::open(&terrain, scene, Some(Arming::VIRTUAL), link, timeout);
        let (mut session, _) = opened.expect("opened");
        let (mut samples, mut status): (Vec<TickRecord>, Option<Status>) = (vec![], None);
        let mut queried = false;
        while status.is_none() {
            session
                .poll(Duration::from_millis(100), &mut |event| match event {
                    Event::Sample(sample) => samples.push(*sample),
                    Event::Status(reported) => status = Some(reported.clone()),
                    _ => {}
                })
                .expect("it continues");
            if !queried && samples.last().is_some_and(|last| last.tick >= ticks) {
                session.enqueue(HostRequest::Status);
                queried = true;
            }
        }
        session.close(&mut |_| {}).expect("confirmed");
        emulator.finish().expect("the board ended well");
        (samples, status.expect("reported"))
    });
    Some(rendered)
}

#[test]
fn tick_in_contact_is_within_work_and_stack_budgets() {
    let Some((samples, status)) = rendered() else {
        return;
    };
    // A window of 16 × 16 tiles is moved over the stack when the board starts.
    let stack = status.stack;
    eprintln!(
        "stack: {} of {} bytes used at most",
        stack.high_water, stack.size
    );
    assert_eq!(stack.size, 56 * 1024);
    assert!(stack.high_water > 500, "{stack:?}");
    assert!(3 * stack.high_water <= 2 * stack.size, "{stack:?}");
    let mut costs: [(&str, Mean); 4] =
        ["disarmed", "free", "unseeded", "touching"].map(|name| (name, Mean::default()));
    for pair in samples.windows(2) {
        // A sample reports the cost of the tick before.
        let (sample, cost) = (&pair[0], f64::from(pair[1].cost));
        let kind = match (sample.mode, sample.state) {
            (Mode::Armed, ContactState::Free) => 1,
            (Mode::Armed, ContactState::Unseeded) => 2,
            (Mode::Armed, ContactState::Touching) => 3,
            _ => 0,
        };
        costs[kind].1.add(cost * INSTRUCTIONS_PER_COUNT);
    }
    for (name, cost) in &costs {
        let (mean, max) = (cost.mean(), cost.max());
        eprintln!(
            "{name:<9} {:>6} ticks: mean {mean:.0}, worst {max:.0} instructions",
            cost.count()
        );
    }
    let touching = costs[3].1;
    assert!(touching.count() > 4_000, "hardly a touch");
    assert!(
        touching.mean() <= IN_CONTACT,
        "{} instructions",
        touching.mean()
    );
    assert_eq!(samples.last().map(|s| s.late), Some(0));
}
