//! Damping and the controller, judged by what they do to a tip that moves along a spring.

use core::f64::consts::TAU;
use std::vec::Vec;

use glam::Vec3;

use super::*;

/// A scene's damper with an arm.
fn damper(law: &ForceLaw, hz: u32) -> Option<Damper> {
    let rate = TickRate::new(hz).expect("a rate");
    Damper::of(law, rate, true)
}

fn law(stiffness_n_per_mm: f32, ns_per_m: f32, controller: Controller) -> ForceLaw {
    ForceLaw {
        stiffness_n_per_mm,
        damping: Damping {
            ns_per_m,
            controller,
        },
        ..ForceLaw::PREMIUM
    }
}

#[test]
fn damping_is_against_the_motion_and_no_more_than_the_spring() {
    let law = law(0.5, 4.0, Controller::Off);
    let damper = damper(&law, 1000).expect("damped");
    let normal = Vec3::new(0.6, 0.0, 0.8);
    let across = Vec3::new(-0.8, 0.0, 0.6);
    for deep_mm in [0.0_f32, 1e-6, 0.01, 1.0, 6.0, 16.0, 40.0] {
        for speed_mm_s in [-900.0_f32, -50.0, -1e-3, 0.0, 50.0, 900.0] {
            let velocity_mm_s = normal * speed_mm_s + across * 300.0;
            let force_n = damper.force_n(law.force_n(normal * deep_mm), velocity_mm_s);
            let spring_n = (0.5 * deep_mm).min(8.5);
            let damping_n = (-0.004 * speed_mm_s).clamp(-spring_n, spring_n);
            let wanted = normal * (spring_n + damping_n).clamp(0.0, 8.5);
            let off = (force_n - wanted).length();
            assert!(off < 1e-4, "{deep_mm} mm, {speed_mm_s} mm/s: {force_n}");
        }
    }
    let lost = Vec3::splat(f32::NAN);
    assert_eq!(damper.force_n(normal * 0.5, lost), normal * 0.5);
}

#[test]
fn the_controller_acts_where_the_stiffness_is_above_what_the_rate_allows() {
    let acts = |stiffness, hz, controller| {
        let damper = damper(&law(stiffness, 0.0, controller), hz);
        damper.is_some_and(|damper| damper.controller.is_some())
    };
    for (stiffness, hz, by_itself) in [
        (0.5, 1000, false),
        (1.0, 1000, false),
        (1.01, 1000, true),
        (1.9, 2000, false),
        (2.1, 2000, true),
        (3.2, 10_000, false),
        (3.4, 10_000, true),
    ] {
        assert_eq!(acts(stiffness, hz, Controller::Auto), by_itself, "{hz}");
        assert!(acts(stiffness, hz, Controller::On));
        assert!(!acts(stiffness, hz, Controller::Off));
    }
    // Nothing is asked for, and nothing is there.
    assert!(damper(&ForceLaw::PREMIUM, 1000).is_none());
    // Points have no hand.
    let points = Damper::of(&law(4.0, 0.0, Controller::On), TickRate::DEFAULT, false);
    assert!(points.is_none());
}

/// Energy that a level surface gives to a tip that goes in and out along a sine, mJ, in each
/// of a few taps. A tick's force acts `late_s` later; it is integrated a hundred times a tick.
fn given_mj(law: &ForceLaw, hz: u32, late_s: f64) -> Vec<f64> {
    const DEEP_MM: f64 = 3.0;
    const TAP_HZ: f64 = 9.0;
    let mut damper = damper(law, hz);
    let tick_s = 1.0 / f64::from(hz);
    let height_mm = |t_s: f64| DEEP_MM * libm::cos(TAU * TAP_HZ * t_s);
    let mut forces_n = [0.0_f64; 2];
    let (mut given, mut taps) = (0.0, Vec::new());
    for tick in 0..(5.0 / TAP_HZ / tick_s) as u32 {
        let now_s = f64::from(tick) * tick_s;
        let tip_mm = Vec3::Z * height_mm(now_s) as f32;
        let displacement_mm = Vec3::Z * -tip_mm.z.min(0.0);
        let speed_mm_s = (height_mm(now_s) - height_mm(now_s - tick_s)) / tick_s;
        let asked_n = Vec3::Z * forces_n[1] as f32;
        let mut force_n = law.force_n(displacement_mm);
        if let Some(damper) = &mut damper {
            damper.observe(displacement_mm, tip_mm, asked_n, 8.5);
            force_n = damper.force_n(force_n, Vec3::Z * speed_mm_s as f32);
        }
        forces_n = [forces_n[1], f64::from(force_n.z)];
        for part in 0..100 {
            let (from, to) = (f64::from(part) / 100.0, f64::from(part + 1) / 100.0);
            let acts_n = forces_n[usize::from(from * tick_s >= late_s)];
            given += acts_n * (height_mm(now_s + to * tick_s) - height_mm(now_s + from * tick_s));
        }
        // Well above the surface: a tap is over.
        if height_mm(now_s) > 0.9 * DEEP_MM && given != 0.0 {
            taps.push(given);
            given = 0.0;
        }
    }
    taps
}

#[test]
fn with_the_controller_no_tap_gives_energy_and_without_it_every_one_does() {
    for hz in [1000, 2000, 4000, 10_000] {
        for stiffness in [0.2, 0.5, 1.0, 2.0, 4.0] {
            for late_s in [0.0, 0.04e-3, 0.08e-3] {
                let without = given_mj(&law(stiffness, 0.0, Controller::Off), hz, late_s);
                let with = given_mj(&law(stiffness, 0.0, Controller::On), hz, late_s);
                assert!(without.len() >= 4 && with.len() >= 4);
                assert!(without.iter().all(|mj| *mj > 0.0), "{hz} Hz: {without:?}");
                // What the last tick before the tip leaves creates is taken back in the next tap.
                for (with, without) in with.iter().zip(&without) {
                    assert!(
                        *with < 0.01 * without,
                        "{hz} Hz, {stiffness} N/mm, {late_s} s: {with} mJ, {without} without"
                    );
                }
            }
        }
    }
}

#[test]
fn what_is_taken_back_is_not_much_more_than_was_created() {
    // A controller that damped more would be felt as honey.
    for hz in [1000, 4000] {
        let without = given_mj(&law(1.0, 0.0, Controller::Off), hz, 0.08e-3);
        let with = given_mj(&law(1.0, 0.0, Controller::On), hz, 0.08e-3);
        for (given, taken) in without.iter().zip(&with) {
            assert!(-taken < *given, "{hz} Hz: {taken} mJ, {given} without");
        }
    }
}

#[test]
fn what_was_created_is_forgotten_at_rest_and_never_more_than_a_little() {
    let law = law(1.0, 0.0, Controller::On);
    let mut damper = damper(&law, 1000).expect("controlled");
    let mut at = |up_mm: f32, asked_n: f32| {
        damper.observe(
            Vec3::Z * (5.0 - up_mm),
            Vec3::Z * up_mm,
            Vec3::Z * asked_n,
            8.5,
        );
        damper.created_mj()
    };
    assert_eq!(at(0.0, 0.0), 0.0);
    // Pressed in without a force against it: what the spring holds came from nowhere.
    let created = at(-0.2, 0.0);
    assert!(
        (created - (0.5 * 5.2 * 5.2 - 0.5 * 25.0)).abs() < 1e-5,
        "{created}"
    );
    assert_eq!(at(-3.0, 0.0), 2.0);
    damper.rest();
    assert_eq!(damper.created_mj(), 0.0);
}
