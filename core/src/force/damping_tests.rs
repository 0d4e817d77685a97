//! Damping and the controller, tested by their effect on a tip that moves along a spring.

use core::f64::consts::TAU;
use std::vec::Vec;

use glam::Vec3;

use super::super::passivity::Shares;
use super::super::{Pattern, Shading, Texture};
use super::*;
use crate::rate::TickRate;

/// The damper of a scene with an arm.
fn damper(params: &SurfaceParams, hz: u32) -> Option<Damper> {
    Damper::of(params, &context(hz, 0.1e-3))
}

/// The context of a scene with an arm.
fn context(hz: u32, latency_s: f32) -> EffectContext {
    EffectContext {
        cell_mm: 1.0,
        rate: TickRate::new(hz).expect("a rate"),
        latency_s,
        arm: true,
    }
}

fn params(stiffness_n_per_mm: f32, ns_per_m: f32, controller: Controller) -> SurfaceParams {
    SurfaceParams {
        stiffness_n_per_mm,
        damping: Damping {
            ns_per_m,
            controller,
        },
        ..SurfaceParams::PREMIUM
    }
}

#[test]
fn damping_opposes_motion_and_never_exceeds_the_spring() {
    let params = params(0.5, 4.0, Controller::Off);
    let damper = damper(&params, 1000).expect("damped");
    let normal = Vec3::new(0.6, 0.0, 0.8);
    let across = Vec3::new(-0.8, 0.0, 0.6);
    for deep_mm in [0.0_f32, 1e-6, 0.01, 1.0, 6.0, 16.0, 40.0] {
        for speed_mm_s in [-900.0_f32, -50.0, -1e-3, 0.0, 50.0, 900.0] {
            let velocity_mm_s = normal * speed_mm_s + across * 300.0;
            let force_n = damper.force_n(params.spring().force_n(normal * deep_mm), velocity_mm_s);
            let spring_n = (0.5 * deep_mm).min(8.5);
            let damping_n = (-0.004 * speed_mm_s).clamp(-spring_n, spring_n);
            let expected = normal * (spring_n + damping_n).clamp(0.0, 8.5);
            let off = (force_n - expected).length();
            assert!(off < 1e-4, "{deep_mm} mm, {speed_mm_s} mm/s: {force_n}");
        }
    }
    let lost = Vec3::splat(f32::NAN);
    assert_eq!(damper.force_n(normal * 0.5, lost), normal * 0.5);
}

#[test]
fn controller_acts_on_every_arm_unless_switched_off() {
    let acts = |stiffness, hz, controller| {
        let damper = damper(&params(stiffness, 0.0, controller), hz);
        damper.is_some_and(|damper| damper.controller.is_some())
    };
    for (stiffness, hz) in [(0.01, 10_000), (0.5, 1000), (4.0, 1000)] {
        assert!(acts(stiffness, hz, Controller::default()), "{hz} Hz");
        assert!(!acts(stiffness, hz, Controller::Off), "{hz} Hz");
    }
    assert_eq!(SurfaceParams::PREMIUM.damping.controller, Controller::On);
    // A replay has no hand.
    let points = EffectContext {
        arm: false,
        ..context(1000, 0.1e-3)
    };
    let points = Damper::of(&params(4.0, 0.0, Controller::On), &points);
    assert!(points.is_none());
}

/// The energy, mJ, that the observer records with `ramps`: with a tip at rest, and with one that
/// leaves under the full spring force.
fn created_mj_with(ramps: impl Fn(u16) -> Shares) -> [f32; 2] {
    let params = params(1.0, 0.0, Controller::On);
    let mut damper = damper(&params, 1000).expect("controlled");
    let mut at = |tick: u16, up_mm: f32, moved_mm: f32| {
        damper.observe(&PassivityInputs {
            displacement_mm: Vec3::Z * -up_mm,
            moved_mm: Vec3::Z * moved_mm,
            velocity_mm_s: Vec3::ZERO,
            commanded_n: Vec3::Z * 2.0,
            max_n: 8.5,
            shares: ramps(tick),
        });
        damper.created_mj()
    };
    let at_rest = (0..100).map(|tick| at(tick, -2.0, 0.0)).last();
    [at_rest.unwrap_or_default(), at(100, -1.5, 0.5)]
}

/// Safety: 14.
#[test]
fn ramp_and_clutch_record_only_energy_of_the_motion() {
    let share = |tick: u16| 0.01 * f32::from(tick.min(50) + 1);
    for ramps in [
        (|share| Shares {
            ramp: share,
            ..Shares::ALL
        }) as fn(f32) -> Shares,
        |share| Shares {
            clutch: share,
            ..Shares::ALL
        },
    ] {
        let [at_rest, leaving] = created_mj_with(|tick| ramps(share(tick)));
        assert_eq!(at_rest, 0.0);
        // 2 N acted over 0.5 mm, and 0.51 of the spring released 0.51 · ½ (2² − 1.5²).
        let released_mj = 2.0 * 0.5 - 0.51 * 0.5 * (4.0 - 2.25);
        assert!(
            (leaving - released_mj).abs() < 1e-5,
            "{leaving} mJ, not {released_mj}"
        );
    }
    // The speed limit also lets a force return, without an action of the user.
    let [at_rest, _] = created_mj_with(|tick| Shares {
        speed: share(tick),
        ..Shares::ALL
    });
    assert!((at_rest - 0.5 * 0.5 * 4.0).abs() < 1e-5, "{at_rest} mJ");
}

/// Safety: 14.
#[test]
fn damping_scales_with_the_rendered_share_of_the_spring() {
    // Energy created by half of a spring requires as much damping per newton as by all of one.
    let damped = |shares: Shares| {
        let params = params(1.0, 0.0, Controller::On);
        let mut damper = damper(&params, 1000).expect("controlled");
        let velocity_mm_s = Vec3::Z * 100.0;
        let inside = shares.clutch;
        let outside = shares.ramp * shares.speed;
        for tick in 0..20 {
            let deep_mm = 5.0 - 0.1 * tick as f32;
            damper.observe(&PassivityInputs {
                displacement_mm: Vec3::Z * deep_mm,
                moved_mm: Vec3::Z * 0.1,
                velocity_mm_s,
                commanded_n: Vec3::Z * (deep_mm + 0.1) * inside * outside,
                max_n: 8.5,
                shares,
            });
        }
        let spring_n = Vec3::Z * 3.1 * inside;
        damper.force_n(spring_n, velocity_mm_s).z / spring_n.z
    };
    let whole = damped(Shares::ALL);
    assert!(whole < 0.99, "{whole}");
    for shares in [
        Shares {
            ramp: 0.5,
            ..Shares::ALL
        },
        Shares {
            clutch: 0.5,
            ..Shares::ALL
        },
        Shares {
            speed: 0.5,
            ..Shares::ALL
        },
    ] {
        let part = damped(shares);
        assert!(
            (part - whole).abs() < 1e-3,
            "{shares:?}: {part}, not {whole}"
        );
    }
}

/// Taps of a tip on a level surface, along a sine some 3 mm deep.
#[derive(Clone, Copy)]
struct Taps {
    hz: u32,
    /// Time from the start of a tick until its force acts, s, and the damper's latency.
    latency_s: f64,
    reported_s: f64,
    /// Taps a second; at 9 the tip moves at up to 170 mm/s.
    tap_hz: f64,
}

impl Taps {
    const fn new(hz: u32, latency_s: f64) -> Self {
        Self {
            hz,
            latency_s,
            reported_s: latency_s,
            tap_hz: 9.0,
        }
    }

    /// Energy that the surface releases in each of a few taps, mJ, integrated a hundred times a
    /// tick. The force obeys the guard's rate limit.
    fn released_mj(self, params: &SurfaceParams) -> Vec<f64> {
        const DEEP_MM: f64 = 3.0;
        let mut damper = Damper::of(params, &context(self.hz, self.reported_s as f32));
        let tick_s = 1.0 / f64::from(self.hz);
        let slew_n = 1000.0 * tick_s as f32;
        let height_mm = |t_s: f64| DEEP_MM * libm::cos(TAU * self.tap_hz * t_s);
        let mut forces_n: Vec<f64> = Vec::new();
        let (mut released_mj, mut taps) = (0.0, Vec::new());
        for tick in 0..(5.0 / self.tap_hz / tick_s) as usize {
            let now_s = tick as f64 * tick_s;
            let tip_mm = Vec3::Z * height_mm(now_s) as f32;
            let displacement_mm = Vec3::Z * -tip_mm.z.min(0.0);
            let speed_mm_s = (height_mm(now_s) - height_mm(now_s - tick_s)) / tick_s;
            let velocity_mm_s = Vec3::Z * speed_mm_s as f32;
            let moved_mm = Vec3::Z * (height_mm(now_s) - height_mm(now_s - tick_s)) as f32;
            let commanded_n = Vec3::Z * forces_n.last().map_or(0.0, |last| *last as f32);
            let mut force_n = params.spring().force_n(displacement_mm);
            if let Some(damper) = &mut damper {
                damper.observe(&PassivityInputs {
                    displacement_mm,
                    moved_mm,
                    velocity_mm_s,
                    commanded_n,
                    max_n: 8.5,
                    shares: Shares::ALL,
                });
                force_n = damper.force_n(force_n, velocity_mm_s);
            }
            let change_n = (force_n - commanded_n).z.clamp(-slew_n, slew_n);
            forces_n.push(f64::from(commanded_n.z + change_n));
            for part in 0..100 {
                let (from, to) = (f64::from(part) / 100.0, f64::from(part + 1) / 100.0);
                let ago = (self.latency_s / tick_s - from - 1e-9).ceil().max(0.0) as usize;
                let acts_n = forces_n.get(tick.wrapping_sub(ago)).copied();
                let moves_mm = height_mm(now_s + to * tick_s) - height_mm(now_s + from * tick_s);
                released_mj += acts_n.unwrap_or(0.0) * moves_mm;
            }
            // Well above the surface: the tap has ended.
            if height_mm(now_s) > 0.9 * DEEP_MM && released_mj != 0.0 {
                taps.push(released_mj);
                released_mj = 0.0;
            }
        }
        taps
    }
}

const LATENCIES_S: [f64; 5] = [0.0, 0.08e-3, 0.2e-3, 0.6e-3, 1.19e-3];

#[test]
fn passivity_controller_removes_the_energy_of_every_tap() {
    for hz in [1000, 2000, 4000, 10_000] {
        for stiffness in [0.2, 0.5, 1.0, 2.0, 4.0] {
            for latency_s in LATENCIES_S {
                let taps = Taps::new(hz, latency_s);
                let without = taps.released_mj(&params(stiffness, 0.0, Controller::Off));
                let with = taps.released_mj(&params(stiffness, 0.0, Controller::On));
                assert!(without.len() >= 4 && with.len() >= 4);
                assert!(without.iter().all(|mj| *mj > 0.0), "{hz} Hz: {without:?}");
                for (with, without) in with.iter().zip(&without) {
                    assert!(
                        *with < 1e-4 * without,
                        "{hz} Hz, {stiffness} N/mm, {latency_s} s: {with} mJ, {without} without"
                    );
                }
            }
        }
    }
}

/// Energy, mJ, that a point with a fixed proxy releases in a second to a tip on circles of 4 mm
/// around it at 200 mm/s: no motion is along the force.
fn released_on_circles_mj(params: &SurfaceParams, hz: u32) -> f64 {
    const RADIUS_MM: f64 = 4.0;
    let tick_s = 1.0 / f64::from(hz);
    let tip_mm = |t_s: f64| {
        let (sin, cos) = libm::sincos(200.0 / RADIUS_MM * t_s);
        Vec3::new(cos as f32, sin as f32, 0.0) * RADIUS_MM as f32
    };
    let mut damper = Damper::of(params, &context(hz, 0.0));
    let (mut released_mj, mut commanded_n) = (0.0, Vec3::ZERO);
    for tick in 0..hz {
        let now_s = f64::from(tick) * tick_s;
        let moved_mm = tip_mm(now_s) - tip_mm(now_s - tick_s);
        let velocity_mm_s = moved_mm * hz as f32;
        let mut force_n = params.spring().force_n(-tip_mm(now_s));
        if let Some(damper) = &mut damper {
            damper.observe(&PassivityInputs {
                displacement_mm: -tip_mm(now_s),
                moved_mm,
                velocity_mm_s,
                commanded_n,
                max_n: 8.5,
                shares: Shares::ALL,
            });
            force_n = damper.force_n(force_n, velocity_mm_s);
        }
        commanded_n = force_n;
        released_mj += f64::from(force_n.dot(tip_mm(now_s + tick_s) - tip_mm(now_s)));
    }
    released_mj
}

#[test]
fn tip_on_circles_around_a_point_gains_no_energy() {
    for hz in [1000, 2000, 4000, 10_000] {
        for stiffness in [0.2, 0.5, 1.0, 2.0] {
            let without = released_on_circles_mj(&params(stiffness, 0.0, Controller::Off), hz);
            let with = released_on_circles_mj(&params(stiffness, 0.0, Controller::On), hz);
            assert!(without > 0.3, "{hz} Hz, {stiffness} N/mm: {without} mJ");
            assert!(
                with.abs() < 0.02 * without,
                "{hz} Hz, {stiffness} N/mm: {with} mJ, {without} without"
            );
        }
    }
}

#[test]
fn shaded_or_textured_force_is_not_damped_sideways() {
    let texture = Texture {
        pattern: Pattern::Grain,
        amplitude_mm: 0.1,
        wavelength_mm: 2.0,
        ..Texture::NONE
    };
    let shaded = SurfaceParams {
        shading: Shading::Smooth,
        ..params(1.0, 0.0, Controller::On)
    };
    let textured = SurfaceParams {
        texture,
        ..params(1.0, 0.0, Controller::On)
    };
    for params in [shaded, textured] {
        assert!(released_on_circles_mj(&params, 1000) > 1.0);
    }
}

#[test]
fn energy_of_unstated_latency_is_not_all_dissipated() {
    // So a board must state the latency of itself and of its amplifiers.
    let on = params(1.0, 0.0, Controller::On);
    let stated = Taps::new(1000, 1.1e-3);
    let unstated = Taps {
        reported_s: 0.1e-3,
        ..stated
    };
    let without = stated.released_mj(&params(1.0, 0.0, Controller::Off));
    let (stated, unstated) = (stated.released_mj(&on), unstated.released_mj(&on));
    for ((stated, unstated), without) in stated.iter().zip(&unstated).zip(&without) {
        assert!(*stated < 0.0, "{stated} mJ");
        assert!(
            *unstated > 0.2 * without,
            "{unstated} mJ, {without} without"
        );
    }
}

#[test]
fn force_earlier_than_stated_delay_creates_no_energy() {
    // A duty cycle is read 0.5 to 1 ms after it is set.
    for hz in [1000, 2000, 4000] {
        for latency_s in [0.63e-3, 0.88e-3] {
            let taps = Taps {
                reported_s: 1.13e-3,
                ..Taps::new(hz, latency_s)
            };
            let with = taps.released_mj(&params(1.0, 0.0, Controller::On));
            assert!(with.iter().all(|mj| *mj < 0.0), "{hz} Hz: {with:?} mJ");
        }
    }
}

#[test]
fn tip_beyond_the_force_rate_limit_gains_no_energy() {
    // Up to 565 mm/s: at 4 N/mm the force would exceed its rate limit by a factor of two.
    for hz in [1000, 4000, 10_000] {
        for stiffness in [1.0, 2.0, 4.0] {
            let taps = Taps {
                tap_hz: 30.0,
                ..Taps::new(hz, 0.2e-3)
            };
            let with = taps.released_mj(&params(stiffness, 0.0, Controller::On));
            assert!(
                with.len() >= 4 && with.iter().all(|mj| *mj < 0.0),
                "{hz} Hz, {stiffness} N/mm: {with:?} mJ"
            );
        }
    }
}

#[test]
fn net_dissipation_stays_below_the_created_energy() {
    // With more damping the surface would be rendered as honey.
    for hz in [1000, 4000] {
        for latency_s in LATENCIES_S {
            let taps = Taps::new(hz, latency_s);
            let without = taps.released_mj(&params(1.0, 0.0, Controller::Off));
            let with = taps.released_mj(&params(1.0, 0.0, Controller::On));
            for (released_mj, dissipated) in without.iter().zip(&with) {
                assert!(
                    -dissipated < *released_mj,
                    "{hz} Hz: {dissipated} mJ, {released_mj} without"
                );
            }
        }
    }
}

#[test]
fn surface_softens_for_fast_tip_and_recovers_at_rest() {
    let params = params(2.0, 0.0, Controller::On);
    let mut damper = damper(&params, 1000).expect("controlled");
    let mut share = |up_mm: f32, speed_mm_s: f32, ticks: u32| {
        let displacement_mm = Vec3::Z * (-up_mm).max(0.0);
        for _ in 0..ticks {
            damper.observe(&PassivityInputs {
                displacement_mm,
                moved_mm: Vec3::ZERO,
                velocity_mm_s: Vec3::Z * speed_mm_s,
                commanded_n: Vec3::ZERO,
                max_n: 8.5,
                shares: Shares::ALL,
            });
        }
        damper
            .force_n(params.spring().force_n(displacement_mm), Vec3::ZERO)
            .z
            / params.spring().force_n(Vec3::Z * -up_mm).z
    };
    // 500 N/s is half of the guard's rate limit.
    assert_eq!(share(-1.0, 250.0, 1), 1.0);
    assert!((share(-1.0, -500.0, 1) - 0.5).abs() < 1e-6);
    // The share does not decrease while the tip moves, in any direction.
    assert!((share(-1.0, 11.0, 1000) - 0.5).abs() < 1e-6);
    assert!((share(-1.0, 0.0, 299) - 0.5).abs() < 1e-6);
    // From 1 mJ, half in 0.1 s.
    let recovering = share(-1.0, 0.0, 50);
    assert!((recovering - 0.75).abs() < 0.01, "{recovering}");
    assert_eq!(share(-1.0, 0.0, 60), 1.0);
    assert!((share(-1.0, 500.0, 1) - 0.5).abs() < 1e-6);
    share(1.0, 500.0, 1);
    assert_eq!(share(-1.0, 0.0, 1), 1.0);
}

#[test]
fn created_energy_is_capped_and_reset_at_rest() {
    let params = params(1.0, 0.0, Controller::On);
    let mut damper = damper(&params, 1000).expect("controlled");
    let mut at = |up_mm: f32, commanded_n: f32| {
        damper.observe(&PassivityInputs {
            displacement_mm: Vec3::Z * (5.0 - up_mm),
            moved_mm: Vec3::ZERO,
            velocity_mm_s: Vec3::ZERO,
            commanded_n: Vec3::Z * commanded_n,
            max_n: 8.5,
            shares: Shares::ALL,
        });
        damper.created_mj()
    };
    assert_eq!(at(0.0, 0.0), 0.0);
    // The tip was pressed in without a counterforce: the spring's energy was created.
    let created = at(-0.2, 0.0);
    assert!(
        (created - (0.5 * 5.2 * 5.2 - 0.5 * 25.0)).abs() < 1e-5,
        "{created}"
    );
    assert_eq!(at(-3.0, 0.0), 2.0);
    damper.reset();
    assert_eq!(damper.created_mj(), 0.0);
}
