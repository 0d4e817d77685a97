//! The relief against a computation in f64 and integers.

use glam::Vec3;

use super::*;
use crate::cases::cases;
use crate::force::texture::Texture;

/// Cells near the origin and at the ends of the address range.
const CELLS: [i32; 7] = [0, 1, -7, 100_000_000, -100_000_001, 1 << 29, -(1 << 29)];

fn texture(pattern: Pattern, direction_deg: f32, seed: u32) -> Texture {
    Texture {
        pattern,
        amplitude_mm: 0.1,
        wavelength_mm: 1.0,
        direction_deg,
        seed,
    }
}

/// Random numbers from 0 to 1.
fn dice() -> impl FnMut() -> f32 {
    let mut state = 1_u32;
    move || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 8) as f32 / 16_777_216.0
    }
}

/// A coordinate in integer multiples of 2⁻⁵⁶: the whole part, and the rest.
fn exactly(per_cell: f32, cell: i32, frac: f32) -> (i64, f64) {
    let per_cell = (f64::from(per_cell) * 2_f64.powi(32)) as i128;
    let place = i128::from(cell) * (1 << 24) + (f64::from(frac) * 2_f64.powi(24)) as i128;
    let product = per_cell * place;
    let rest = product & ((1 << 56) - 1);
    ((product >> 56) as i64, rest as f64 / 2_f64.powi(56))
}

fn random_height(col: i64, row: i64, seed: u32) -> f64 {
    let mut x = (col as u32).wrapping_mul(0x9E37_79B1);
    x = x.wrapping_add((row as u32).wrapping_mul(0x85EB_CA77));
    x = x.wrapping_add(wellons(seed));
    f64::from(wellons(x) as i32) / 2_f64.powi(31)
}

fn wellons(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

/// The height at a place, from a grain's corners or the sine.
fn expected(relief: &Relief, seed: u32, at: &GridPoint) -> f64 {
    let (cell, frac) = (at.cell(), at.frac());
    let x = exactly(relief.per_cell[0], cell[0], frac.x);
    let y = exactly(relief.per_cell[1], cell[1], frac.y);
    if !relief.is_grain {
        let turns = x.1 + y.1 + f64::from(wellons(seed)) / 2_f64.powi(32);
        return (std::f64::consts::TAU * turns).sin();
    }
    let eased = |x: f64| x * x * (3.0 - 2.0 * x);
    let (u, v) = (eased(x.1), eased(y.1));
    let at = |east: i64, north: i64| random_height(x.0 + east, y.0 + north, seed);
    let south = at(0, 0) * (1.0 - u) + at(1, 0) * u;
    let north = at(0, 1) * (1.0 - u) + at(1, 1) * u;
    south * (1.0 - v) + north * v
}

#[test]
fn height_matches_f64_at_every_scale_near_and_far() {
    let mut dice = dice();
    const CASES: u32 = cases(2_000, 20);
    for exponent in -20..=20 {
        for case in 0..CASES / 40 {
            let pattern = [Pattern::Grain, Pattern::Grating][case as usize % 2];
            let (seed, degrees) = (case * 7, 720.0 * dice() - 360.0);
            let waves = 2_f32.powi(exponent) * (1.0 + dice());
            let relief = Relief::of(&texture(pattern, degrees, seed), waves);
            for x in CELLS {
                let y = CELLS[(case as usize) % CELLS.len()];
                let at = GridPoint::new([x, y, 3], Vec3::new(dice(), dice(), dice()));
                let (height, expected) = (relief.at(&at).height, expected(&relief, seed, &at));
                let off = (f64::from(height) - expected).abs();
                // The sine's own error, and rounding.
                let max_error = if relief.is_grain { 2e-6 } else { 4.5e-4 };
                assert!(
                    off < max_error,
                    "{relief:?} at {at:?}: {height} but {expected}"
                );
            }
        }
    }
}

#[test]
fn relief_far_from_origin_has_the_same_bits() {
    // 16 waves per 32 cells, so a grating repeats every 32 cells.
    let relief = Relief::of(&texture(Pattern::Grating, 0.0, 5), 0.5);
    for i in 0..1_000 {
        let (cell, frac) = (i / 31, Vec3::X * ((i % 31) as f32 / 31.0));
        let near = relief.at(&GridPoint::new([cell, 0, 0], frac));
        for far in [100_000_000, -100_000_000 / 32 * 32, (1 << 29) - 64] {
            let there = relief.at(&GridPoint::new([cell + far / 32 * 32, 0, 0], frac));
            assert_eq!(near, there, "{i} {far}");
        }
    }
}

/// Neighbouring heights, over borders of cells and grains: the difference quotient is the slope of
/// the relief, and the slope changes by no more than the maximum bend.
#[test]
fn height_and_slope_are_continuous_over_cells_and_grains() {
    const STEP: f32 = 1.0 / 4096.0;
    let patterns = [Pattern::Grain, Pattern::Grating];
    for (pattern, waves) in patterns.into_iter().zip([0.37, 0.0213, 3.7]) {
        for along in [Vec3::X, Vec3::Y, Vec3::new(0.8, 0.6, 0.0)] {
            let relief = Relief::of(&texture(pattern, 20.0, 3), waves);
            let mut before: Option<ReliefPoint> = None;
            for i in 0..40_000 {
                let at = GridPoint::new([99_999_998; 3], along * (i as f32 * STEP));
                let rise = relief.at(&at);
                if let Some(before) = before {
                    let slope =
                        |rise: &ReliefPoint| rise.slopes[0] * along.x + rise.slopes[1] * along.y;
                    let mean = 0.5 * (slope(&before) + slope(&rise));
                    let off = (rise.height - before.height - mean * STEP).abs();
                    assert!(off < 1e-6, "{pattern:?} {i}: {off:e}");
                    let slope_change = (slope(&rise) - slope(&before)).abs();
                    assert!(
                        slope_change < 48.0 * waves * waves * STEP + 1e-5,
                        "{i}: {slope_change:e}"
                    );
                }
                before = Some(rise);
            }
        }
    }
}

/// The bounds that the tangential part of the force relies on.
#[test]
fn heights_and_slopes_reach_but_never_exceed_their_bounds() {
    for (pattern, steepest) in [
        (Pattern::Grain, 6.0),
        (Pattern::Grating, std::f32::consts::TAU),
    ] {
        let relief = Relief::of(&texture(pattern, 30.0, 9), 0.25);
        let (mut highest, mut lowest, mut slope, mut sum) = (0_f32, 0_f32, 0_f32, 0.0);
        const SIDE: i32 = cases(1_200, 40) as i32;
        for i in 0..SIDE * SIDE {
            let (x, y) = (i % SIDE, i / SIDE);
            let frac = Vec3::new((x % 8) as f32, (y % 8) as f32, 0.0) / 8.0;
            let rise = relief.at(&GridPoint::new([x / 8, y / 8, 0], frac));
            highest = highest.max(rise.height);
            lowest = lowest.min(rise.height);
            let [east, north] = rise.slopes;
            slope = slope.max(east.hypot(north));
            sum += f64::from(rise.height);
        }
        assert!(
            highest <= 1.000_001 && lowest >= -1.000_001,
            "{highest} {lowest}"
        );
        assert!(slope <= 0.25 * steepest * 1.000_01, "{pattern:?}: {slope}");
        if !cfg!(miri) {
            assert!(
                highest > 0.99 && lowest < -0.99,
                "{pattern:?}: {highest} {lowest}"
            );
            assert!(slope > 0.25 * steepest * 0.85, "{pattern:?}: {slope}");
            let mean = sum / f64::from(SIDE * SIDE);
            assert!(mean.abs() < 0.03, "{pattern:?}: {mean}");
        }
    }
}

#[test]
fn each_seed_selects_another_texture() {
    let at = GridPoint::new([5, 6, 7], Vec3::new(0.3, 0.2, 0.1));
    for pattern in [Pattern::Grain, Pattern::Grating] {
        let heights: [f32; 20] = core::array::from_fn(|seed| {
            let relief = Relief::of(&texture(pattern, 0.0, seed as u32), 0.25);
            relief.at(&at).height
        });
        for (i, height) in heights.iter().enumerate() {
            let others = heights.iter().skip(i + 1);
            assert!(others.into_iter().all(|other| other != height));
        }
    }
}
