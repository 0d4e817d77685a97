//! Texture on planes, tested by the rendered displacement.

use std::vec::Vec;

use super::*;
use crate::cases::cases;
use crate::contact::{Contact, ContactSettings};
use crate::force::Pattern;
use crate::terrain::{FieldSize, TileArena};

const RATE: TickRate = TickRate::DEFAULT;
/// A tick, s.
const TICK_S: f64 = 1e-3;
/// A cell, mm.
const CELL_MM: f32 = 2.0;

const GRATING: Texture = Texture {
    pattern: Pattern::Grating,
    amplitude_mm: 0.1,
    wavelength_mm: 1.0,
    ..Texture::NONE
};
const GRAIN: Texture = Texture {
    pattern: Pattern::Grain,
    seed: 7,
    ..GRATING
};

fn texturer(texture: &Texture) -> Texturer {
    Texturer::of(texture, CELL_MM, RATE).expect("textured")
}

/// A place `x_mm` east and `y_mm` north of cell 30.
fn place(x_mm: f64, y_mm: f64) -> GridPoint {
    let split = |mm: f64| {
        let cells = mm / f64::from(CELL_MM);
        (30 + cells.floor() as i32, (cells - cells.floor()) as f32)
    };
    let ((x, u), (y, v)) = (split(x_mm), split(y_mm));
    GridPoint::new([x, y, 0], Vec3::new(u, v, 0.0))
}

/// The displacement in millimetres, tick by tick, of a hand `depth_mm` deep in a level plane that
/// moves east at `speed_mm_s`, without the first 100 ms.
fn rendered(texture: &Texture, speed_mm_s: f64, depth_mm: f32, ticks: u32) -> Vec<Vec3> {
    let mut texturer = texturer(texture);
    let displacement = Vec3::Z * (depth_mm / CELL_MM);
    let all = (0..100 + ticks).map(|tick| {
        let travel_mm = speed_mm_s * TICK_S * f64::from(tick);
        texturer.add(displacement, &place(travel_mm, 0.3)) * CELL_MM
    });
    all.skip(100).collect()
}

/// The amplitude at a frequency in Hz.
fn amplitude(rendered: &[Vec3], hz: f64, part: fn(&Vec3) -> f32) -> f64 {
    let turn = std::f64::consts::TAU * hz * TICK_S;
    let sums = rendered
        .iter()
        .enumerate()
        .fold((0.0, 0.0), |(c, s), (i, v)| {
            let (value, angle) = (f64::from(part(v)), turn * i as f64);
            (c + value * angle.cos(), s + value * angle.sin())
        });
    2.0 / rendered.len() as f64 * sums.0.hypot(sums.1)
}

#[test]
fn texture_reaches_its_amplitude_at_low_speed() {
    for (texture, ticks) in [(GRATING, 2_000), (GRAIN, cases(400_000, 200))] {
        let rendered = rendered(&texture, 10.0, 1.0, ticks);
        let max = rendered.iter().map(|v| v.z - 1.0).fold(f32::MIN, f32::max);
        let min = rendered.iter().map(|v| v.z - 1.0).fold(f32::MAX, f32::min);
        assert!(max <= 0.100_01 && min >= -0.100_01, "{max} {min}");
        if texture.pattern == Pattern::Grating {
            assert!(max > 0.099 && min < -0.099, "{max} {min}");
        } else if !cfg!(miri) {
            // A straight path rarely meets the middle of a highest or lowest grain.
            assert!(max > 0.08 && min < -0.08, "{max} {min}");
        }
    }
}

#[test]
fn grating_vibrates_only_at_speed_over_wavelength() {
    for hz in [10.0, 50.0, 100.0, 125.0] {
        // One wave per millimetre.
        let rendered = rendered(&GRATING, hz, 1.0, 4_000);
        let there = amplitude(&rendered, hz, |v| v.z);
        assert!((there - 0.1).abs() < 1e-3, "{hz} Hz: {there}");
        for other in (1..=100).map(|i| 5.0 * f64::from(i)).filter(|o| *o != hz) {
            let (up, along) = (
                amplitude(&rendered, other, |v| v.z),
                amplitude(&rendered, other, |v| v.x),
            );
            let max = if other == 500.0 { 2e-3 } else { 1e-3 };
            assert!(up < max && along < max, "{other} Hz at {hz}: {up} {along}");
        }
    }
}

/// Grain has no waves shorter than its wavelength, except those of its smooth rises.
#[test]
fn grain_reaches_the_frequency_of_its_wavelength() {
    let rendered = rendered(&GRAIN, 50.0, 1.0, cases(20_000, 400));
    let power = |from: u32, to: u32| -> f64 {
        let all = (from..to).map(|hz| amplitude(&rendered, f64::from(hz), |v| v.z).powi(2));
        all.sum()
    };
    let (within, beyond) = (power(1, 60), power(60, 400));
    assert!(
        cfg!(miri) || beyond < 0.1 * within,
        "{beyond:e} of {within:e}"
    );
    assert!(cfg!(miri) || power(120, 400) < 1e-3 * within);
}

#[test]
fn texture_fades_before_it_would_alias() {
    let swing = |mm_s| {
        let rendered = rendered(&GRATING, mm_s, 1.0, 2_000);
        let up = rendered.iter().map(|v| (v.z - 1.0).abs());
        up.fold(0.0, f32::max)
    };
    assert!(swing(120.0) > 0.099);
    // The middle between an eighth and a quarter of a wave a tick.
    let half = swing(187.5);
    assert!((half - 0.05).abs() < 1e-3, "{half}");
    assert!(swing(160.0) > half && half > swing(220.0) && swing(220.0) > 0.0);
    for too_fast in [250.1, 300.0, 999.0, 1_000.0, 5_000.0] {
        assert_eq!(swing(too_fast), 0.0, "{too_fast} mm/s");
    }
}

#[test]
fn texture_at_rest_is_independent_of_the_previous_position() {
    for texture in [GRATING, GRAIN] {
        let there = place(0.7, -0.4);
        let at_rest = |from: GridPoint| {
            let mut texturer = texturer(&texture);
            texturer.add(Vec3::Z, &from);
            (0..200).map(|_| texturer.add(Vec3::Z, &there)).last()
        };
        let first = at_rest(there);
        for (x, y) in [(0.1, 0.2), (-50.0, 3.0), (1e6, -1e6), (0.7, -0.4)] {
            assert_eq!(at_rest(place(x, y)), first, "{x} {y}");
        }
    }
}

/// In steps of a millionth of a wave no force jumps: over cells, tiles and grains, and at contact
/// onset and lift-off.
#[test]
fn texture_is_continuous_across_cells_tiles_and_contact_onset() {
    let textures = [
        GRATING,
        GRAIN,
        Texture {
            direction_deg: 33.0,
            ..GRATING
        },
    ];
    for texture in textures {
        let mut texturer = texturer(&texture);
        let depth = |i: f64| 0.3 * (1.0 - (i / 3_000.0).cos());
        let mut before: Option<Vec3> = None;
        const STEPS: u32 = cases(40_000, 500);
        for i in 0..STEPS {
            // Over the border of the tile that ends with column and row 32.
            let (along, depth) = (3.6 + f64::from(i) * 2e-5, depth(f64::from(i)) as f32);
            let normal = Vec3::new(0.6, 0.0, 0.8);
            let rendered = texturer.add(normal * depth, &place(along, along));
            if let Some(before) = before
                && i > 100
            {
                let step = (rendered - before).length();
                assert!(step < 4e-4, "{texture:?} {i}: {step:e}");
            }
            before = Some(rendered);
        }
    }
}

/// Along the force, the texture never reverses it; it adds no more than is stated; and it vanishes
/// with the depth.
#[test]
fn textured_force_never_pulls_and_stays_within_bounds() {
    let steep = Texture {
        amplitude_mm: 0.125,
        ..GRAIN
    };
    for texture in [GRATING, GRAIN, steep] {
        let mut texturer = texturer(&texture);
        let (a, l) = (texture.amplitude_mm, texture.wavelength_mm);
        let mut farthest = 0.0_f32;
        for i in 0..cases(50_000, 500) {
            let depth_mm = [1e-30, 1e-6, 0.01, 0.1, 0.5, 3.0, 1e3, 1e9][i as usize / 3 % 8];
            let normal = [Vec3::Z, Vec3::X, Vec3::new(-0.48, 0.6, 0.64)][i as usize % 3];
            let plain = normal * (depth_mm / CELL_MM);
            let rendered = texturer.add(plain, &place(0.013 * f64::from(i), 0.007 * f64::from(i)));
            let more_mm = (rendered - plain) * CELL_MM;
            let (up, along) = (more_mm.dot(normal), more_mm.reject_from_normalized(normal));
            let rounding = 1e-5 * depth_mm;
            assert!(rendered.dot(normal) >= -1e-30, "{depth_mm} {rendered}");
            assert!(
                up.abs() <= a.min(depth_mm) * 1.000_01 + rounding,
                "{depth_mm}: {up}"
            );
            let max = (depth_mm * std::f32::consts::TAU * a / l).min(0.131 * l);
            assert!(
                along.length() <= max * 1.000_1 + rounding,
                "{depth_mm}: {along}"
            );
            if depth_mm == 3.0 {
                farthest = farthest.max(along.length());
            }
        }
        let expected = if texture.pattern == Pattern::Grain {
            0.09
        } else {
            0.13
        };
        assert!(
            cfg!(miri) || farthest > expected * l,
            "{texture:?}: {farthest}"
        );
    }
}

/// So a hand that presses hard is not unstable on a wave.
#[test]
fn tangential_stiffness_stays_below_the_surface_stiffness() {
    for texture in [
        GRATING,
        GRAIN,
        Texture {
            amplitude_mm: 0.125,
            ..GRAIN
        },
    ] {
        for depth_mm in [0.05, 0.2, 1.0, 15.0] {
            let rendered = rendered(&texture, 1.0, depth_mm, cases(20_000, 200));
            let pairs = rendered.windows(2);
            let changes = pairs.map(|pair| (pair[1].x - pair[0].x).abs() / 1e-3);
            let stiffest = changes.fold(0.0, f32::max);
            assert!(stiffest < 1.02, "{texture:?} {depth_mm} mm: {stiffest}");
        }
    }
}

/// Up to the depth limit of the component along the surface, the force is that of a spring on the
/// surface with its relief: a closed path releases no energy.
#[test]
fn closed_loop_over_a_texture_releases_no_energy() {
    for texture in [GRATING, GRAIN] {
        let mut texturer = texturer(&texture);
        let (mut released, mut size) = (0.0_f64, 0.0);
        let mut before: Option<([f64; 3], Vec3)> = None;
        const STEPS: u32 = cases(40_000, 2_000);
        for i in 0..=2 * STEPS {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(STEPS);
            let [x, y] = [1.7 * angle.cos(), 1.7 * angle.sin()];
            let depth = 0.15 + 0.04 * (3.0 * angle).sin();
            let rendered = texturer.add(Vec3::Z * (depth as f32 / CELL_MM), &place(x, y)) * CELL_MM;
            let here = [x, y, -depth];
            if let Some((there, force)) = before
                && i > STEPS
            {
                let force = (0.5 * (rendered + force)).to_array();
                let work: f64 = (0..3)
                    .map(|k| f64::from(force[k]) * (here[k] - there[k]))
                    .sum();
                released += work;
                size += work.abs();
            }
            before = Some((here, rendered));
        }
        assert!(
            cfg!(miri) || released.abs() < 2e-3 * size,
            "{released:e} of {size:e}"
        );
    }
}

/// A slow hand's proxy moves by an encoder count in one tick and rests in others; after a jump, a
/// texture fades in evenly.
#[test]
fn texture_share_neither_flutters_nor_jumps() {
    let mut coarse = texturer(&GRATING);
    let mut fine = texturer(&GRATING);
    for tick in 0..cases(3_000, 300) {
        // On one line of equal height: 180 mm/s on average, alternately 0.2 and 0.16 mm a tick.
        let y_mm = 0.18 * f64::from(tick) + if tick % 2 == 0 { 0.02 } else { 0.0 };
        let [by_counts, evenly] = [(&mut coarse, y_mm), (&mut fine, 0.2 * f64::from(tick))]
            .map(|(texturer, y_mm)| texturer.add(Vec3::Z, &place(0.25, y_mm)).z);
        if tick > 100 {
            assert!((by_counts - evenly).abs() < 0.01, "{by_counts} {evenly}");
        }
    }
    let mut texturer = texturer(&GRATING);
    texturer.add(Vec3::Z, &place(500.0, 500.0));
    let crest = place(0.25, 0.0);
    let shares: Vec<f32> = (0..40)
        .map(|_| (texturer.add(Vec3::Z, &crest).z - 1.0) * CELL_MM / 0.1)
        .collect();
    let largest = shares.windows(2).map(|pair| pair[1] - pair[0]);
    let largest = largest.fold(0.0, f32::max);
    assert!(shares[10] == 0.0 && shares[21] > 0.99, "{shares:?}");
    assert!(largest < 0.25, "{largest} in a tick");
}

/// With the contact itself: the proxy is the same as without texture.
#[test]
fn texture_acts_along_the_normal_of_a_slope() {
    let size = FieldSize::new(60, 60);
    let mut field = TileArena::<2>::from_fn(size, |x, _| 0.75 * x as f32).expect("a field");
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut texturer = texturer(&GRATING);
    contact.step(
        &window,
        &GridPoint::new([20, 20, 0], Vec3::new(0.0, 0.5, 17.0)),
    );
    let normal = Vec3::new(-0.6, 0.0, 0.8);
    let mut max = 0.0_f32;
    for i in 0..3_000 {
        let x = i as f32 * 1e-3;
        let hip = GridPoint::new(
            [20, 20, 0],
            Vec3::new(x, 0.5, 0.75 * (20.0 + x)) - normal * 0.3,
        );
        let output = *contact.step(&window, &hip);
        let rendered = texturer.add(output.displacement, &output.proxy);
        let up = rendered.dot(normal) - 0.3;
        max = max.max(up.abs());
        assert!(rendered.y.abs() < 1e-5, "the ridges lead north: {rendered}");
    }
    let expected = GRATING.amplitude_mm / CELL_MM;
    assert!((max - expected).abs() < 0.01 * expected, "{max}");
}

#[test]
fn texture_output_is_finite_for_non_finite_input() {
    for texture in [GRATING, GRAIN] {
        let mut texturer = texturer(&texture);
        for bad in [
            f32::NAN,
            f32::INFINITY,
            f32::MAX,
            f32::MIN_POSITIVE,
            1e-45,
            0.0,
        ] {
            let at = GridPoint::new([i32::MAX; 3], Vec3::splat(bad));
            let rendered = texturer.add(Vec3::new(0.0, bad, 1.0), &at);
            let force = crate::force::SurfaceParams::PREMIUM
                .spring()
                .force_n(rendered);
            assert!(force.is_finite(), "{bad}: {force}");
        }
        // And the speed is cleared.
        let rendered: Vec<_> = (0..100)
            .map(|_| texturer.add(Vec3::Z, &place(0.3, 0.3)))
            .collect();
        assert!(
            rendered[99].is_finite() && rendered[99] != Vec3::Z,
            "{}",
            rendered[99]
        );
        // Too deep for a texture: the displacement stays unchanged.
        let deep = Vec3::new(-3e24, 4e30, 1e20);
        assert_eq!(texturer.add(deep, &place(0.3, 0.3)), deep);
    }
}

#[test]
fn out_of_range_texture_parameters_are_invalid() {
    assert!(Texture::NONE.is_valid() && GRATING.is_valid() && GRAIN.is_valid());
    let bad = [f32::NAN, f32::INFINITY, -1.0];
    let with = |change: fn(&mut Texture, f32), value| {
        let mut texture = GRATING;
        change(&mut texture, value);
        texture
    };
    for value in bad.into_iter().chain([0.126]) {
        assert!(
            !with(|t, x| t.amplitude_mm = x, value).is_valid(),
            "{value}"
        );
    }
    for value in bad.into_iter().chain([0.0, 0.24, 101.0]) {
        assert!(
            !with(|t, x| t.wavelength_mm = x, value).is_valid(),
            "{value}"
        );
    }
    for value in [f32::NAN, 361.0, -361.0] {
        assert!(
            !with(|t, x| t.direction_deg = x, value).is_valid(),
            "{value}"
        );
    }
    let wide = Texture {
        wavelength_mm: 100.0,
        ..GRATING
    };
    assert!(
        Texture {
            amplitude_mm: 2.0,
            ..wide
        }
        .is_valid()
    );
    assert!(
        !Texture {
            amplitude_mm: 2.1,
            ..wide
        }
        .is_valid()
    );
    assert!(GRATING.fits(1.0) && !GRATING.fits(1e7) && !GRATING.fits(1e-7));
    assert!(!GRATING.fits(f32::NAN) && Texture::NONE.fits(1e7));
    assert!(Texturer::of(&GRATING, 1e7, RATE).is_none());
}

#[test]
fn shortest_wavelength_depends_on_the_tick_rate() {
    assert_eq!(Texture::shortest_mm(RATE), 0.4);
    let fast = TickRate::new(4_000).expect("a rate");
    assert_eq!(Texture::shortest_mm(fast), 0.25);
}
