//! The campaign's watch over what is felt speaks of each thing that must not be: every violation
//! is forged, and the honest ticks beside it pass.

use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::force::{
    Controller, Damping, ForceLaw, Material, MaterialTable, Pattern, Shading, Texture,
};
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{Limits, Mode};
use hapterra_core::scene::Sample;
use hapterra_tests::campaign::felt::FeltWatch;
use hapterra_tests::campaign::ground::Felt;

const LAW: ForceLaw = ForceLaw {
    damping: Damping {
        controller: Controller::On,
        ..Damping::NONE
    },
    ..ForceLaw::PREMIUM
};

/// A tick in level ground at height 0, in cells of half a millimetre.
fn at(tick: u32, height: f32, force_n: Vec3) -> Sample {
    let place = |height| GridPoint::new([20, 20, 0], Vec3::new(0.5, 0.5, height));
    Sample {
        tick,
        hip: place(height),
        proxy: place(height.max(0.0)),
        force_n,
        state: match height < 0.0 {
            true => ContactState::Touching,
            false => ContactState::Free,
        },
        mode: Mode::Armed,
        ..Sample::default()
    }
}

fn watch(law: &ForceLaw, table: Option<&[Material]>) -> FeltWatch {
    let table = table.map(|all| MaterialTable::new(all).expect("some"));
    FeltWatch::new(Felt::of(law, table.as_ref()), 0.5)
}

/// What is said of one tick, 2 mm deep.
fn said(law: &ForceLaw, force_n: Vec3, limits: Limits) -> Result<(), String> {
    let sample = Sample {
        limits,
        ..at(0, -4.0, force_n)
    };
    watch(law, None).look(&sample, true)
}

#[test]
fn a_force_that_pulls_is_told_but_where_it_is_on_its_way() {
    let shaded = ForceLaw {
        shading: Shading::Smooth,
        ..LAW
    };
    for law in [LAW, shaded] {
        for force_n in [Vec3::Z, Vec3::ZERO, Vec3::new(1.0, 0.0, 0.01)] {
            assert_eq!(said(&law, force_n, Limits::empty()), Ok(()));
        }
        assert!(said(&law, -Vec3::Z * 0.01, Limits::empty()).is_err());
        assert_eq!(said(&law, -Vec3::Z * 0.01, Limits::SLEW_LIMITED), Ok(()));
    }
}

#[test]
fn a_force_larger_than_anything_makes_of_the_depth_is_told() {
    let plain = ForceLaw::PREMIUM;
    let textured = ForceLaw {
        texture: Texture {
            pattern: Pattern::Grating,
            amplitude_mm: 0.1,
            wavelength_mm: 1.0,
            ..Texture::NONE
        },
        ..plain
    };
    let most = |law: &ForceLaw, most_n: f32| {
        let force = |newtons: f32| said(law, Vec3::Z * newtons, Limits::empty());
        assert_eq!(force(most_n), Ok(()), "{law:?}");
        assert!(force(1.01 * most_n).is_err(), "{law:?}");
    };
    most(&plain, 1.0);
    most(&LAW, 2.0);
    most(&textured, 0.5 * 2.1_f32.hypot(0.2 * std::f32::consts::TAU));
    // The stiffest of the materials, in a scene that is twice as stiff as its table.
    let of = |stiffness_n_per_mm| Material {
        stiffness_n_per_mm,
        ..Material::of(&plain)
    };
    let table = [of(0.25), of(0.4), of(0.1)];
    let force = |newtons: f32| {
        let sample = at(0, -4.0, Vec3::Z * newtons);
        watch(&plain, Some(&table)).look(&sample, true)
    };
    assert_eq!(force(1.6), Ok(()));
    assert!(force(1.61).is_err());
}

/// In and out of the ground at 50 mm/s, with this much more force on the way out: whether it is
/// told, and how much was given.
fn tap(law: &ForceLaw, more: f32, is_calm: bool) -> (bool, f32) {
    taps(law, more, is_calm, 1)
}

/// The same so many times, without leaving the ground between.
fn taps(law: &ForceLaw, more: f32, is_calm: bool, times: usize) -> (bool, f32) {
    let mut watch = watch(law, None);
    let into = (0..20).map(|i| (0.5 - 0.1 * i as f32, 1.0));
    let dip = (0..30).map(|i: i32| match i < 15 {
        true => (-1.5 + 0.08 * i as f32, 1.0 + more),
        false => (-1.5 + 0.08 * (30 - i) as f32, 1.0),
    });
    let out = (0..20).map(|i| (-1.5 + 0.1 * i as f32, 1.0 + more));
    let dips = dip.cycle().take(30 * (times - 1));
    let mut told = false;
    for (tick, (height, times)) in (0..).zip(into.chain(dips).chain(out)) {
        let spring_n = -0.25 * height.min(0.0);
        let sample = at(tick, height, Vec3::Z * spring_n * times);
        told |= watch.look(&sample, is_calm).is_err();
    }
    (told, watch.most_given_mj)
}

#[test]
fn a_contact_that_gives_is_told_with_the_controller_on() {
    // A spring that is felt in ticks gives K (T / 2 + L) v a metre: 0.5 N/mm, 0.61 ms, 50 mm/s and
    // twice 0.75 mm.
    let (told, given) = tap(&LAW, 0.0, true);
    assert!(!told && (given - 0.0229).abs() < 0.001, "{given}");
    let (told, given) = tap(&LAW, 0.5, true);
    assert!(told && given > 0.05, "{given}");
    // Not while something goes wrong, or without the controller.
    assert_eq!(tap(&LAW, 0.5, false), (false, 0.0));
    assert_eq!(tap(&ForceLaw::PREMIUM, 0.0, true), (false, 0.0));
    let shaded = ForceLaw {
        shading: Shading::Smooth,
        ..LAW
    };
    // Shading may give 0.2 mJ more, and 0.2 times 0.375 N times 0.5 mm and 0.75 mm.
    let (told, given) = tap(&shaded, 0.99, true);
    assert!(!told && given > 0.1, "{given}");
    let (told, given) = taps(&shaded, 0.99, true, 3);
    assert!(told && given > 0.344, "{given}");
}
