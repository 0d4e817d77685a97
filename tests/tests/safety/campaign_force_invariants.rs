//! The campaign's checks of the force report each violation: every violation is forged, and the
//! correct ticks before and after it pass.

use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::force::{
    Controller, Damping, Material, MaterialTable, Pattern, Shading, SurfaceParams, Texture,
};
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{Limits, Mode};
use hapterra_core::scene::TickRecord;
use hapterra_tests::campaign::force_invariants::ForceChecks;
use hapterra_tests::campaign::ground::SceneSurfaces;

const PARAMS: SurfaceParams = SurfaceParams {
    damping: Damping {
        controller: Controller::On,
        ..Damping::NONE
    },
    ..SurfaceParams::PREMIUM
};

const OFF: SurfaceParams = SurfaceParams {
    damping: Damping {
        controller: Controller::Off,
        ..Damping::NONE
    },
    ..SurfaceParams::PREMIUM
};

/// Returns a tick on level ground at height 0, in cells of half a millimetre.
fn at(tick: u32, height: f32, force_n: Vec3) -> TickRecord {
    let place = |height| GridPoint::new([20, 20, 0], Vec3::new(0.5, 0.5, height));
    TickRecord {
        tick,
        hip: place(height),
        proxy: place(height.max(0.0)),
        force_n,
        state: match height < 0.0 {
            true => ContactState::Touching,
            false => ContactState::Free,
        },
        mode: Mode::Armed,
        ..TickRecord::default()
    }
}

fn watch(params: &SurfaceParams, table: Option<&[Material]>) -> ForceChecks {
    let table = table.map(|all| MaterialTable::new(all).expect("some"));
    ForceChecks::new(SceneSurfaces::of(params, table.as_ref()), 0.5)
}

/// Returns the verdict on one tick, 2 mm deep.
fn verdict(params: &SurfaceParams, force_n: Vec3, limits: Limits) -> Result<(), String> {
    let sample = TickRecord {
        limits,
        ..at(0, -4.0, force_n)
    };
    watch(params, None).check(&sample, true)
}

#[test]
fn pulling_force_is_reported_unless_slew_limited() {
    let shaded = SurfaceParams {
        shading: Shading::Smooth,
        ..PARAMS
    };
    for params in [PARAMS, shaded] {
        for force_n in [Vec3::Z, Vec3::ZERO, Vec3::new(1.0, 0.0, 0.01)] {
            assert_eq!(verdict(&params, force_n, Limits::empty()), Ok(()));
        }
        assert!(verdict(&params, -Vec3::Z * 0.01, Limits::empty()).is_err());
        assert_eq!(
            verdict(&params, -Vec3::Z * 0.01, Limits::SLEW_LIMITED),
            Ok(())
        );
    }
}

#[test]
fn force_above_the_maximum_for_its_depth_is_reported() {
    let plain = OFF;
    let textured = SurfaceParams {
        texture: Texture {
            pattern: Pattern::Grating,
            amplitude_mm: 0.1,
            wavelength_mm: 1.0,
            ..Texture::NONE
        },
        ..plain
    };
    let most = |params: &SurfaceParams, max_n: f32| {
        let force = |newtons: f32| verdict(params, Vec3::Z * newtons, Limits::empty());
        assert_eq!(force(max_n), Ok(()), "{params:?}");
        assert!(force(1.01 * max_n).is_err(), "{params:?}");
    };
    most(&plain, 1.0);
    most(&PARAMS, 2.0);
    most(&textured, 0.5 * 2.1_f32.hypot(0.2 * std::f32::consts::TAU));
    // The stiffest material, in a scene twice as stiff as its table.
    let of = |stiffness_n_per_mm| Material {
        stiffness_n_per_mm,
        ..Material::of(&plain)
    };
    let table = [of(0.25), of(0.4), of(0.1)];
    let force = |newtons: f32| {
        let sample = at(0, -4.0, Vec3::Z * newtons);
        watch(&plain, Some(&table)).check(&sample, true)
    };
    assert_eq!(force(1.6), Ok(()));
    assert!(force(1.61).is_err());
}

/// Enters and leaves the ground at 50 mm/s, with `more` additional force during the exit. Returns
/// true if it is reported, and the energy that the contact added.
fn tap(params: &SurfaceParams, more: f32, is_calm: bool) -> (bool, f32) {
    taps(params, more, is_calm, 1)
}

/// Same as `tap`, repeated `times` times without leaving the ground in between.
fn taps(params: &SurfaceParams, more: f32, is_calm: bool, times: usize) -> (bool, f32) {
    let mut watch = watch(params, None);
    let into = (0..20).map(|i| (0.5 - 0.1 * i as f32, 1.0));
    let dip = (0..30).map(|i: i32| match i < 15 {
        true => (-1.5 + 0.08 * i as f32, 1.0 + more),
        false => (-1.5 + 0.08 * (30 - i) as f32, 1.0),
    });
    let out = (0..20).map(|i| (-1.5 + 0.1 * i as f32, 1.0 + more));
    let dips = dip.cycle().take(30 * (times - 1));
    let mut reported = false;
    for (tick, (height, times)) in (0..).zip(into.chain(dips).chain(out)) {
        let spring_n = -0.25 * height.min(0.0);
        let sample = at(tick, height, Vec3::Z * spring_n * times);
        reported |= watch.check(&sample, is_calm).is_err();
    }
    (reported, watch.max_gained_mj)
}

#[test]
fn energy_created_by_taps_is_reported_with_controller_on() {
    // A spring that is sampled in ticks adds K (T / 2 + L) v a metre: 0.5 N/mm, 0.61 ms, 50 mm/s
    // and twice 0.75 mm.
    let (reported, energy_mj) = tap(&PARAMS, 0.0, true);
    assert!(
        !reported && (energy_mj - 0.0229).abs() < 0.001,
        "{energy_mj}"
    );
    let (reported, energy_mj) = tap(&PARAMS, 0.5, true);
    assert!(reported && energy_mj > 0.05, "{energy_mj}");
    // Not checked during a fault or without the controller.
    assert_eq!(tap(&PARAMS, 0.5, false), (false, 0.0));
    assert_eq!(tap(&OFF, 0.0, true), (false, 0.0));
    let shaded = SurfaceParams {
        shading: Shading::Smooth,
        ..PARAMS
    };
    // Shading may add 0.2 mJ, and 0.2 times 0.375 N times 0.5 mm and 0.75 mm.
    let (reported, energy_mj) = tap(&shaded, 0.99, true);
    assert!(!reported && energy_mj > 0.1, "{energy_mj}");
    let (reported, energy_mj) = taps(&shaded, 0.99, true, 3);
    assert!(reported && energy_mj > 0.344, "{energy_mj}");
}

/// Presses 2 mm deep at rest during the ramp, from the confirmation on, with `times` times the
/// force that the ramp allows.
fn ramped(times: f32) -> Result<(), String> {
    let mut watch = watch(&PARAMS, None);
    let mut check = |tick: u32, mode: Mode, force_n: f32, limits: Limits| {
        let sample = TickRecord {
            mode,
            limits,
            ..at(tick, -4.0, Vec3::Z * force_n)
        };
        watch.check(&sample, true)
    };
    check(0, Mode::Confirming, 0.0, Limits::empty())?;
    for tick in 1..1000 {
        let spring_n = tick as f32 / 2000.0;
        check(tick, Mode::Ramping, spring_n * times, Limits::RAMPING)?;
    }
    Ok(())
}

#[test]
fn ramped_force_is_checked_against_the_ramp_share() {
    assert_eq!(ramped(1.0), Ok(()));
    // Damping may double it.
    assert_eq!(ramped(1.99), Ok(()));
    assert!(ramped(2.01).is_err());
    assert!(ramped(-0.01).is_err());
}

/// Taps during the ramp, with more force during the exit, as in an old version of the tick.
#[test]
fn energy_created_by_taps_in_the_ramp_is_reported() {
    let tapped = |more: f32| {
        let mut watch = watch(&PARAMS, None);
        let mut reported = false;
        for tick in 0..1500_u32 {
            let share = tick as f32 / 2000.0;
            let phase = tick.saturating_sub(1000) % 200;
            let height = match phase {
                0..100 => 1.0 - 0.04 * phase as f32,
                _ => -3.0 + 0.04 * (phase - 100) as f32,
            };
            let more = if phase < 100 { 1.0 } else { 1.0 + more };
            let spring_n = -0.25 * height.min(0.0) * share * more;
            let sample = TickRecord {
                mode: match tick {
                    0 => Mode::Confirming,
                    _ => Mode::Ramping,
                },
                ..at(tick, height, Vec3::Z * spring_n)
            };
            reported |= watch.check(&sample, true).is_err();
        }
        (reported, watch.max_gained_mj)
    };
    let (reported, energy_mj) = tapped(0.0);
    assert!(!reported, "{energy_mj}");
    assert!(tapped(0.5).0);
}

#[test]
fn rising_force_during_fade_out_is_reported() {
    let reported = |second_n: f32| {
        let mut watch = watch(&PARAMS, None);
        let fades = |tick, force_n| TickRecord {
            mode: Mode::Fading,
            limits: Limits::FADING,
            ..at(tick, -4.0, Vec3::Z * force_n)
        };
        watch.check(&fades(0, 1.0), true).is_ok() && watch.check(&fades(1, second_n), true).is_err()
    };
    assert!(!reported(0.99) && !reported(1.0) && reported(1.01));
}

#[test]
fn force_with_open_clutch_is_reported_unless_slew_limited() {
    let reported = |limits| {
        let mut watch = watch(&PARAMS, None);
        let open = |tick, force_n| TickRecord {
            limits,
            ..at(tick, -4.0, force_n)
        };
        let _ = watch.check(&open(0, Vec3::ZERO), true);
        watch.check(&open(1, Vec3::Z * 0.5), true).is_err()
    };
    assert!(reported(Limits::CLUTCH_OPEN));
    assert!(!reported(Limits::CLUTCH_OPEN | Limits::SLEW_LIMITED));
}

#[test]
fn limit_cycle_is_reported_but_hand_tremor_is_not() {
    let reported = |hz: f32, amplitude_mm: f32| {
        let mut watch = watch(&PARAMS, None);
        let mut reported = false;
        for tick in 0..1000_u32 {
            let turn = std::f32::consts::TAU * hz * tick as f32 * 1e-3;
            let height = -4.0 + 2.0 * amplitude_mm * turn.sin();
            let sample = at(tick, height, Vec3::Z * -0.25 * height);
            reported |= watch.check(&sample, true).is_err();
        }
        reported
    };
    assert!(reported(40.0, 0.4) && reported(25.0, 2.0));
    assert!(!reported(11.2, 0.4) && !reported(40.0, 0.14));
}
