//! A plane pressed by a millimetre, from encoder counts to the amplifiers' inputs, in the boards'
//! own images.

use hapterra::phantom::{ArmFrame, PhantomModel};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_image_tests::bus::Effect;
use hapterra_image_tests::device::{Device, Plane, on_each_board};
use hapterra_image_tests::machine::Stop;
use heightfield::Raster;

fn plane() -> Plane {
    Plane {
        model: PhantomModel::premium_1_5(),
        place: ArmFrame {
            home_mm: [100.0, 100.0, 75.0],
        },
        slope: [0.25, -0.125],
        height_mm: 55.0,
        params: SurfaceParams::PREMIUM,
    }
}

#[test]
fn plane_at_a_millimetre_has_the_currents_of_f64() {
    let plane = plane();
    let height = |x: u32, y: u32| 55.0 + 0.25 * x as f32 - 0.125 * y as f32;
    let raster = Raster::from_fn(201, 201, height).expect("raster");
    on_each_board(&raster, plane.place.home_mm, |machine, terrain, scene| {
        let chip = machine.chip;
        let mut device = Device::arm(machine, terrain, scene);
        device.wait_for_full_force();
        let mut worst = 0.0f64;
        for at in [[100.0, 100.0], [70.0, 90.0], [131.5, 118.25], [88.0, 60.0]] {
            device.move_to(plane.counts_at(at, -3.0));
            device.run_ms(40);
            device.move_to(plane.counts_at(at, 1.0));
            device.run_ms(40);
            let sample = device.latest.expect("telemetry");
            assert_eq!(sample.fault, None, "{}", chip.board);
            assert_eq!(
                sample.state,
                ContactState::Touching,
                "{}: {sample:?}",
                chip.board
            );
            let truth = plane.currents_a(device.counts);
            assert!(truth.iter().any(|a| a.abs() > 0.1), "{truth:?}");
            let expected = truth.map(|a| device.machine.borrow().bus().code(a));
            let got = device.commands();
            for (got, expected) in got.into_iter().zip(expected) {
                worst = worst.max((f64::from(got) - expected).abs());
            }
            assert!(
                worst <= 1.0,
                "{} at {at:?}: {got:?}, {expected:?} expected",
                chip.board
            );
            assert!(device.machine.borrow().is_enabled());
        }
        println!("{}: at most {worst:.2} codes from f64", chip.board);
        let mut machine = device.machine.borrow_mut();
        let effects = machine.take_effects();
        let enables = effects
            .iter()
            .filter(|e| matches!(e, Effect::Enable(_)))
            .count();
        assert_eq!(enables, 1, "switched on once and never off");
    });
}

/// Most instructions of the angles' sines and cosines, the tip and the three levers together.
const POSE: u32 = 120;

#[test]
fn pose_runs_once_per_tick_within_instruction_budget() {
    let plane = plane();
    let raster = Raster::from_fn(201, 201, |_, _| 55.0).expect("raster");
    on_each_board(&raster, plane.place.home_mm, |machine, terrain, scene| {
        let board = machine.chip.board;
        let device = Device::arm(machine, terrain, scene);
        let mut machine = device.machine.borrow_mut();
        let pose = machine.image.function_like(&["Pose", "from_angles"]);
        let counted = machine.count(pose);
        assert_eq!(machine.run_ticks(100), Stop::Requested);
        let (calls, instructions) = counted.get();
        let each = instructions / calls;
        println!("{board}: {each} instructions a pose, {calls} in 100 ticks");
        assert!(
            (100..=101).contains(&calls) && (100..=POSE).contains(&each),
            "{board}"
        );
    });
}
