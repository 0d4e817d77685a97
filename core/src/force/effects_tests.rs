//! Shading beside the passivity controller.

use super::*;
use crate::contact::ContactSettings;
use crate::force::{Controller, Damping, Moment, Shading};
use crate::grid::GridPoint;
use crate::terrain::{FieldSize, FieldStorage};

const LAW: ForceLaw = ForceLaw {
    shading: Shading::Smooth,
    damping: Damping {
        controller: Controller::On,
        ..Damping::NONE
    },
    ..ForceLaw::PREMIUM
};

/// The displacement beside a ridge, without shading and with it, where the book has so much in it.
fn beside_a_ridge(law: &ForceLaw, created_mj: f32) -> [Vec3; 2] {
    let size = FieldSize::new(40, 40);
    let ridge = |x: i32, _| -0.5 * (x - 20).abs() as f32;
    let mut field = FieldStorage::<2>::from_fn(size, ridge).expect("it fits");
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::REAL_TIME);
    for height in [1.0, -0.5] {
        contact.step(
            &window,
            &GridPoint::new([20, 20, 0], Vec3::new(0.2, 0.5, height)),
        );
    }
    let felt = FeltWith {
        cell_mm: 1.0,
        rate: TickRate::DEFAULT,
        latency_s: 0.0,
        arm: true,
    };
    let mut effects = Effects::of(law, &felt).expect("shaded");
    if let Some(damper) = &mut effects.damper {
        // At one depth the force does so much work.
        for tip_mm in [Vec3::ZERO, Vec3::Z] {
            damper.observe(&Moment {
                displacement_mm: Vec3::Z,
                tip_mm,
                velocity_mm_s: Vec3::ZERO,
                asked_n: Vec3::Z * created_mj,
                most_n: 8.5,
            });
        }
    }
    let table = MaterialTable::EMPTY;
    let plain = contact.output().displacement;
    [plain, effects.displacement(&window, &contact, &table)]
}

#[test]
fn the_more_the_controller_has_to_take_back_the_less_the_force_is_turned() {
    let [plain, shaded] = beside_a_ridge(&LAW, 0.0);
    let angle = plain.angle_between(shaded);
    assert!(angle > 0.1, "{angle}");
    let mut last = angle;
    for created_mj in [0.01, 0.03, 0.06, 0.09] {
        let [_, less] = beside_a_ridge(&LAW, created_mj);
        assert!((less.length() - plain.length()).abs() < 1e-5 * plain.length());
        let turned = plain.angle_between(less);
        let wanted = angle * (1.0 - created_mj / 0.1);
        assert!((turned - wanted).abs() < 0.1 * angle, "{turned} {wanted}");
        assert!(turned < last);
        last = turned;
    }
    for created_mj in [0.1, 0.5, 3.0] {
        let [_, unturned] = beside_a_ridge(&LAW, created_mj);
        assert!((unturned - plain).length() < 1e-6, "{created_mj}");
    }
}

#[test]
fn without_the_controller_nothing_is_known_of_energy_and_all_of_it_is_turned() {
    let uncontrolled = ForceLaw {
        damping: Damping::NONE,
        ..LAW
    };
    let [_, shaded] = beside_a_ridge(&LAW, 0.0);
    assert_eq!(beside_a_ridge(&uncontrolled, 3.0)[1], shaded);
}
