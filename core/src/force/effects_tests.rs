//! Shading together with the passivity controller.

use super::*;
use crate::contact::ContactSettings;
use crate::force::{Controller, Damping, PassivityInputs, Shading, Shares};
use crate::grid::GridPoint;
use crate::rate::TickRate;
use crate::terrain::{FieldSize, TileArena};

const PARAMS: SurfaceParams = SurfaceParams {
    shading: Shading::Smooth,
    damping: Damping {
        controller: Controller::On,
        ..Damping::NONE
    },
    ..SurfaceParams::PREMIUM
};

fn context() -> EffectContext {
    EffectContext {
        cell_mm: 1.0,
        rate: TickRate::DEFAULT,
        latency_s: 0.0,
        arm: true,
    }
}

/// Makes the force create this much energy at constant depth.
fn created(effects: &mut Effects, created_mj: f32) {
    if let Some(damper) = &mut effects.damper {
        for moved_mm in [Vec3::ZERO, Vec3::Z] {
            damper.observe(&PassivityInputs {
                displacement_mm: Vec3::Z,
                moved_mm,
                velocity_mm_s: Vec3::ZERO,
                commanded_n: Vec3::Z * created_mj,
                max_n: 8.5,
                shares: Shares::ALL,
            });
        }
    }
}

/// The displacement beside a ridge, without and with shading, after this much created energy.
fn beside_a_ridge(params: &SurfaceParams, created_mj: f32) -> [Vec3; 2] {
    let size = FieldSize::new(40, 40);
    let ridge = |x: i32, _| -0.5 * (x - 20).abs() as f32;
    let mut field = TileArena::<2>::from_fn(size, ridge).expect("it fits");
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    for height in [1.0, -0.5] {
        contact.step(
            &window,
            &GridPoint::new([20, 20, 0], Vec3::new(0.2, 0.5, height)),
        );
    }
    let mut effects = Effects::of(params, &context()).expect("shaded");
    created(&mut effects, created_mj);
    let table = MaterialTable::EMPTY;
    let plain = contact.output().displacement;
    [plain, effects.displacement(&window, &contact, &table)]
}

#[test]
fn shading_turn_shrinks_as_controller_dissipates_more() {
    let [plain, shaded] = beside_a_ridge(&PARAMS, 0.0);
    let angle = plain.angle_between(shaded);
    assert!(angle > 0.1, "{angle}");
    // The energy of an edge at this depth, plus a tenth of a millijoule.
    let deep_mm = plain.length();
    let edge_mj = 0.1 * 0.5 * deep_mm * (1.0 + deep_mm) + 0.1;
    for share in [0.3, 0.99] {
        assert_eq!(beside_a_ridge(&PARAMS, share * edge_mj)[1], shaded);
    }
    let mut last = angle;
    for share in [0.1, 0.4, 0.7, 0.9] {
        let [_, less] = beside_a_ridge(&PARAMS, (1.0 + share) * edge_mj);
        assert!((less.length() - plain.length()).abs() < 1e-5 * plain.length());
        let turned = plain.angle_between(less);
        let expected = angle * (1.0 - share);
        assert!(
            (turned - expected).abs() < 0.1 * angle,
            "{turned} {expected}"
        );
        assert!(turned < last);
        last = turned;
    }
    for created_mj in [2.001 * edge_mj, 1.0, 3.0] {
        let [_, unturned] = beside_a_ridge(&PARAMS, created_mj);
        assert!((unturned - plain).length() < 1e-6, "{created_mj}");
    }
}

#[test]
fn max_observed_energy_suppresses_the_shading_turn() {
    // A cell of a metre: an edge releases more than the observer records.
    let damper = |created_mj: f32| {
        let mut effects = Effects::of(&PARAMS, &context()).expect("shaded");
        created(&mut effects, created_mj);
        effects.damper.expect("controlled")
    };
    assert_eq!(damper(1.0).turn_share(100.0, 1e3), 1.0);
    assert_eq!(damper(9.0).turn_share(100.0, 1e3), 0.0);
}

/// Slides 20 mm over facets of two cells at a depth, and compares each tick with the same without
/// the controller: returns the maximum step of the force of both, N, and the rendered share of the
/// turn.
fn slid(stiffness_n_per_mm: f32, slope: f32, depth: f32, mm_s: f32) -> [f32; 3] {
    let params = SurfaceParams {
        stiffness_n_per_mm,
        ..PARAMS
    };
    let uncontrolled = SurfaceParams {
        damping: Damping {
            controller: Controller::Off,
            ..Damping::NONE
        },
        ..params
    };
    let height = |x: f32| slope * (x.rem_euclid(4.0) - 2.0).abs();
    let size = FieldSize::new(60, 60);
    let mut field = TileArena::<2>::from_fn(size, |x, _| height(x as f32)).expect("it fits");
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut controlled = Effects::of(&params, &context()).expect("shaded");
    let mut free = Effects::of(&uncontrolled, &context()).expect("shaded");
    let table = MaterialTable::EMPTY;
    let step = mm_s * TickRate::DEFAULT.tick_s();
    let (mut last, mut commanded_n) = (None, Vec3::ZERO);
    let (mut steps, mut turned) = ([0.0_f32; 2], [0.0_f32; 2]);
    // First down to the depth, then along it.
    let (down, on) = (100, (20.0 / step) as usize);
    for tick in 0..down + on {
        let x = 20.3 + step * tick.saturating_sub(down) as f32;
        let above = (1.0 - (tick as f32 / down as f32)).max(0.0) * (depth + 0.1) - depth;
        let hip = GridPoint::new([0, 20, 0], Vec3::new(x, 0.4, height(x) + above));
        contact.step(&window, &hip.normalised());
        let plain = contact.output().displacement;
        let context = [&mut controlled, &mut free]
            .map(|effects| effects.displacement(&window, &contact, &table));
        if let Some(damper) = &mut controlled.damper {
            let tip_mm = Vec3::new(x, 0.4, height(x) + above);
            let moved_mm = last.map_or(Vec3::ZERO, |(before, _): (Vec3, _)| tip_mm - before);
            let velocity_mm_s = moved_mm * TickRate::DEFAULT.hz() as f32;
            damper.observe(&PassivityInputs {
                displacement_mm: context[0],
                moved_mm,
                velocity_mm_s,
                commanded_n,
                max_n: 8.5,
                shares: Shares::ALL,
            });
            commanded_n = damper.force_n(params.spring().force_n(context[0]), velocity_mm_s);
            let forces = context.map(|displacement| params.spring().force_n(displacement));
            if let Some((_, before)) = last.replace((tip_mm, forces))
                && tick > down
            {
                for (worst, (now, before)) in steps.iter_mut().zip(forces.iter().zip(before)) {
                    *worst = worst.max((*now - before).length());
                }
                for (sum, displacement) in turned.iter_mut().zip(context) {
                    *sum += plain.angle_between(displacement);
                }
            }
        }
    }
    let [with, without] = steps;
    [with, without, turned[0] / turned[1]]
}

#[test]
fn controller_does_not_roughen_a_slide_over_facets() {
    for (stiffness, slope, depth, mm_s) in [
        (2.0, 0.2, 2.0, 100.0),
        (2.0, 0.2, 2.0, 30.0),
        (1.5, 0.2, 1.0, 100.0),
        (2.0, 0.05, 1.0, 100.0),
        (1.0, 0.3, 2.0, 300.0),
        (4.0, 0.1, 1.0, 200.0),
        (1.0, 0.5, 1.0, 100.0),
        (0.5, 0.5, 3.0, 100.0),
        (2.0, 0.8, 1.0, 100.0),
    ] {
        let [with, without, left] = slid(stiffness, slope, depth, mm_s);
        let what = std::format!("{stiffness} N/mm, {slope}, {depth} mm, {mm_s} mm/s");
        assert!(
            with < 1.1 * without + 1e-3,
            "{what}: {with} N, {without} without"
        );
        assert!(left > 0.99, "{what}: {left} of the turn");
    }
    // At an edge that creates more than a millijoule, part of the turn is rendered.
    let [_, _, left] = slid(2.0, 0.3, 3.0, 50.0);
    assert!((0.75..0.9).contains(&left), "{left} of the turn");
}

#[test]
fn shading_turns_all_force_without_the_controller() {
    let uncontrolled = SurfaceParams {
        damping: Damping {
            controller: Controller::Off,
            ..Damping::NONE
        },
        ..PARAMS
    };
    let [_, shaded] = beside_a_ridge(&PARAMS, 0.0);
    assert_eq!(beside_a_ridge(&uncontrolled, 3.0)[1], shaded);
}
