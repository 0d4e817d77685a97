//! Friction: the rendered forces.

use std::vec::Vec;

use glam::Vec3;

use crate::contact::friction::Friction;
use crate::contact::test_random::Random;
use crate::contact::{Contact, ContactOutput, ContactSettings, ContactState};
use crate::grid::GridPoint;
use crate::rate::TickRate;
use crate::terrain::FieldSize;
use crate::terrain::testing::{Field, buffers};

fn at(p: [f32; 3]) -> GridPoint {
    GridPoint::new([20, 20, 0], Vec3::from_array(p))
}

/// Runs a contact on `height` over the given HIPs.
fn step(
    friction: Friction,
    height: impl Fn(i32, i32) -> f32 + 'static,
    path: impl IntoIterator<Item = [f32; 3]>,
) -> Vec<([f32; 3], ContactOutput)> {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(60, 60), height);
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ.with_friction(friction));
    path.into_iter()
        .map(|hip| (hip, *contact.step(&field.window, &at(hip))))
        .collect()
}

/// Ratio of tangential to normal force on a plane with these slopes.
fn ratio(output: &ContactOutput, slope: [f32; 2]) -> f32 {
    let normal = Vec3::new(-slope[0], -slope[1], 1.0).normalize();
    let pressed = output.displacement.dot(normal);
    (output.displacement - normal * pressed).length() / pressed
}

#[test]
fn sliding_friction_equals_coefficient_on_any_slope() {
    for slope in [[0.0, 0.0], [0.5, 0.0], [-1.0, 0.3], [0.2, 4.0]] {
        for mu in [0.05, 0.3, 0.8] {
            let plane =
                move |x: i32, y: i32| slope[0] * (x - 20) as f32 + slope[1] * (y - 20) as f32;
            let normal = Vec3::new(-slope[0], -slope[1], 1.0).normalize();
            let along = Vec3::new(1.0, 0.4, slope[0] + 0.4 * slope[1]).normalize();
            let path = (0..400).map(|tick| {
                let depth = (tick as f32 * 0.02 - 0.2).min(0.7);
                (along * (0.013 * tick as f32) - normal * depth).to_array()
            });
            let output = step(Friction::coulomb(mu), plane, path);
            for (hip, output) in &output[200..] {
                assert_eq!(output.state, ContactState::Touching);
                let is = ratio(output, slope);
                assert!(
                    (is / mu - 1.0).abs() < 1e-3,
                    "{slope:?}: {is} of {mu} at {hip:?}"
                );
            }
        }
    }
}

/// A tick that crosses a concave edge ends where friction would have ended it, beyond the edge or
/// on it.
#[test]
fn friction_ratio_is_kept_in_ticks_that_cross_an_edge() {
    const MU: f32 = 0.4;
    for bend in [-0.8, -0.3, 0.2, 0.5_f32] {
        let roof = move |x: i32, _: i32| bend * (x - 24).max(0) as f32;
        for phase in 0..40 {
            let path = (0..30).map(|tick| {
                let x = 0.0125 * phase as f32 + 0.5 * tick as f32 - 2.0;
                let depth = (0.2 * tick as f32 - 0.3).min(0.5);
                [x, 0.5, bend * (x - 4.0).max(0.0) - depth]
            });
            for (hip, output) in &step(Friction::coulomb(MU), roof, path)[8..] {
                let [cell, _, _] = output.proxy.cell();
                let x = cell as f32 + output.proxy.frac().x;
                if (x - 24.0).abs() < 1e-3 {
                    continue; // on the concave edge, between two planes
                }
                let is = ratio(output, [if x < 24.0 { 0.0 } else { bend }, 0.0]);
                assert!(
                    (is / MU - 1.0).abs() < 0.031,
                    "{bend} {phase}: {is} at {hip:?}"
                );
            }
        }
    }
}

#[test]
fn stuck_proxy_keeps_the_same_bits() {
    let twisted = |x: i32, y: i32| 0.1 * ((x * 7 + y * 13) % 5) as f32;
    let path = (0..3_000_u32).map(|tick| {
        let depth = (tick as f32 * 0.01 - 0.8).min(0.6);
        let noise = |seed: u32| ((tick * 7919 + seed * 31) % 97) as f32 / 97.0 - 0.5;
        [
            0.3 + 0.03 * noise(1),
            0.3 + 0.03 * noise(2),
            -depth + 0.03 * noise(3),
        ]
    });
    let output = step(Friction::coulomb(0.9), twisted, path);
    let stuck = output[300].1.proxy;
    for (hip, output) in &output[300..] {
        assert_eq!(output.proxy, stuck, "{hip:?}");
    }
}

#[test]
fn static_friction_breaks_away_and_returns_after_a_rest() {
    let friction = Friction {
        static_mu: 0.8,
        dynamic_mu: 0.3,
        viscous_s: 0.0,
    };
    let press = (0..100).map(|tick| [0.0, 0.5, 0.5 - 0.015 * tick as f32]);
    let push = (0..200).map(|tick| [0.01 * tick as f32, 0.5, -1.0]);
    let rest = (0..50).map(|_| [1.99, 0.5, -1.0]);
    let again = (0..100).map(|tick| [1.99 + 0.01 * tick as f32, 0.5, -1.0]);
    let output = step(
        friction,
        |_, _| 0.0,
        press.chain(push).chain(rest).chain(again),
    );
    let lag = |tick: usize| -output[tick].1.displacement.x;
    assert!((lag(178) - 0.78).abs() < 1e-4, "{}", lag(178));
    assert!((lag(190) - 0.3).abs() < 1e-4, "it broke away: {}", lag(190));
    let max = (355..450).map(lag).fold(0.0, f32::max);
    assert!((0.75..=0.8).contains(&max), "it holds again: {max}");
}

#[test]
fn rare_encoder_counts_do_not_make_the_proxy_stick() {
    let friction = Friction {
        static_mu: 0.8,
        dynamic_mu: 0.3,
        viscous_s: 0.0,
    };
    let press = (0..100).map(|tick| [0.0, 0.5, 0.5 - 0.015 * tick as f32]);
    let push = (0..2_000).map(|tick| [(tick / 8) as f32 * 0.03, 0.5, -1.0]);
    let output = step(friction, |_, _| 0.0, press.chain(push));
    for (hip, output) in &output[600..] {
        assert!(-output.displacement.x < 0.301, "{hip:?}: {output:?}");
    }
}

/// On cells of 30 mm, an encoder count of 0.029 mm was less than the speed, in cells a tick, below
/// which a proxy comes to rest: a steady hand chattered.
#[test]
fn steady_hand_breaks_away_once_at_every_cell_size() {
    let friction = Friction {
        static_mu: 0.6,
        ..Friction::coulomb(0.3)
    };
    for (cell_mm, speed_mm_s, count_mm) in
        [(30.0, 10.0, 0.029), (50.0, 2.0, 0.029), (10.0, 5.0, 0.0)]
    {
        for hz in [1_000, 10_000] {
            let rate = TickRate::new(hz).expect("in range");
            let settings = ContactSettings::AT_1_KHZ.at_rate(rate).on_cells_of(cell_mm);
            let mut tiles = buffers::<2>();
            let field = Field::<2>::filled(&mut tiles, FieldSize::new(60, 60), |_, _| 0.0);
            let mut contact = Contact::new(settings.with_friction(friction));
            let (mut trailed_mm, mut breaks) = (0.0_f32, 0);
            for tick in 0..hz * 4 {
                let way_mm = speed_mm_s * tick as f32 / hz as f32;
                let at_mm = match count_mm > 0.0 {
                    true => (way_mm / count_mm).floor() * count_mm,
                    false => way_mm,
                };
                let depth_mm = if tick == 0 { -1.0 } else { 2.0 };
                let hip = at([at_mm / cell_mm, 0.5, -depth_mm / cell_mm]);
                let output = contact.step(&field.window, &hip);
                let trails_mm = -output.displacement.x * cell_mm;
                breaks += i32::from(trailed_mm - trails_mm > 0.3);
                trailed_mm = trails_mm;
            }
            assert_eq!(breaks, 1, "{cell_mm} mm a cell at {hz} Hz");
            assert!((trailed_mm - 0.6).abs() < 0.03, "{trailed_mm} mm");
        }
    }
}

#[test]
fn viscous_friction_grows_with_speed() {
    let friction = Friction {
        viscous_s: 0.02,
        ..Friction::coulomb(0.2)
    };
    for speed in [0.002_f32, 0.01] {
        let press = (0..100).map(|tick| [0.0, 0.5, 0.5 - 0.015 * tick as f32]);
        let push = (0..600).map(|tick| [speed * tick as f32, 0.5, -1.0]);
        let output = step(friction, |_, _| 0.0, press.chain(push));
        let lag = -output[690].1.displacement.x;
        let expected = 0.2 + 0.02 * speed * 1e3;
        assert!((lag / expected - 1.0).abs() < 1e-3, "{lag} for {expected}");
    }
}

#[test]
fn friction_never_drags_a_lifted_hip() {
    let press = (0..100).map(|tick| [0.0, 0.5, 0.5 - 0.015 * tick as f32]);
    let push = (0..100).map(|tick| [0.01 * tick as f32, 0.5, -1.0]);
    let lift = (0..100).map(|tick| [1.0, 0.5, -1.0 + 0.02 * tick as f32]);
    let output = step(
        Friction::coulomb(0.5),
        |_, _| 0.0,
        press.chain(push).chain(lift),
    );
    for (hip, output) in &output[200..] {
        let depth = (-hip[2]).max(0.0);
        let max = 0.5 * depth + 1e-5;
        assert!(
            output.displacement.truncate().length() <= max,
            "{hip:?}: {output:?}"
        );
        assert!(output.displacement.z >= 0.0);
    }
    assert_eq!(output[299].1.state, ContactState::Free);
}

#[test]
fn invalid_friction_parameters_are_rejected() {
    assert!(Friction::NONE.is_valid() && Friction::NONE.is_none());
    assert!(Friction::coulomb(0.5).is_valid());
    assert!(!Friction::coulomb(0.5).is_none());
    let bad = [
        Friction::coulomb(-0.1),
        Friction::coulomb(f32::NAN),
        Friction::coulomb(f32::INFINITY),
        Friction {
            dynamic_mu: 0.6,
            ..Friction::coulomb(0.5)
        },
        Friction {
            viscous_s: -1.0,
            ..Friction::NONE
        },
        Friction {
            viscous_s: f32::NAN,
            ..Friction::NONE
        },
    ];
    for friction in bad {
        assert!(!friction.is_valid(), "{friction:?}");
    }
}

/// A hand moves half a cell a tick over rough ground: the budget cut off half of the ticks that
/// slid twice.
#[test]
fn fast_hand_on_rough_ground_converges_within_its_tick() {
    let mut tiles = buffers::<2>();
    let mut random = Random(7);
    let mut height = || random.between(-0.2, 0.2) as f32;
    let heights: Vec<f32> = (0..61 * 61).map(|_| height()).collect();
    let ground = move |x: i32, y: i32| heights[(y.clamp(0, 60) * 61 + x.clamp(0, 60)) as usize];
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(60, 60), ground);
    let friction = Friction {
        viscous_s: 0.001,
        ..Friction::coulomb(0.3)
    };
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ.with_friction(friction));
    let (mut touches, mut late) = (0, 0);
    for tick in 0..20_000 {
        let turn = 0.031 * tick as f32;
        let x = 12.0 * (turn * 1.3).sin();
        let z = if tick == 0 { 2.0 } else { -0.3 };
        let hip = at([x, 12.0 * turn.cos(), z]);
        let output = contact.step(&field.window, &hip);
        if output.state == ContactState::Touching {
            touches += 1;
            late += i32::from(!output.converged);
        }
    }
    assert!(
        touches > 5_000 && late * 10 < touches,
        "{late} of {touches}"
    );
}

/// The distance that friction held a proxy back is exact to the last place of the path. Multiplied
/// by the ticks of trailing, it exceeded the friction that the proxy was compared with, and one in
/// seven proxies moved to the HIP itself.
#[test]
fn proxy_trailing_a_far_hip_does_not_jump_to_it() {
    let friction = Friction {
        viscous_s: 0.05,
        ..Friction::coulomb(0.05)
    };
    let plane = |x: i32, y: i32| -0.57 * (x - 20) as f32 + 0.07 * (y - 20) as f32;
    for depth in [0.001, 0.005, 0.02, 0.1, 0.4] {
        let on = |x: f32, depth: f32| [x, 0.5, 0.035 - 0.57 * x - depth];
        for phase in 0..50 {
            let from = 0.01 * phase as f32;
            let path = [on(from, -1.0), on(from, depth), on(36.0, depth)];
            let output = step(friction, plane, path);
            let trails = output[2].1.displacement.length();
            assert!(trails > 39.0, "{depth} {from}: {trails} of 41");
        }
    }
}
