//! Shading, compared in f64 with the samples themselves.

use std::vec::Vec;

use super::*;
use crate::cases::cases;
use crate::contact::{ContactSettings, Friction};
use crate::grid::{Cell, GridPoint};
use crate::terrain::testing::{Field, buffers};
use crate::terrain::{FieldSize, TileKey};

/// Depth of the HIP below the surface, cells: the proxy is nearly above it.
const DEPTH: f64 = 0.01;
/// Distance from one HIP to the next, cells.
const STEP: f64 = 0.01;

/// Result for a HIP: the proxy, and the force without and with shading.
struct ShadedTick {
    proxy: GridPoint,
    plain: Vec3,
    shaded: Vec3,
    missing: Option<TileIndex>,
}

/// A height in cells at a sample.
type Height = fn(i32, i32) -> f32;

/// The height at a place, in f64.
fn height_at(height: Height, [x, y]: [f64; 2]) -> f64 {
    let (col, row) = (x.floor() as i32, y.floor() as i32);
    let (u, v) = (x - x.floor(), y - y.floor());
    let at = |east, north| f64::from(height(col + east, row + north));
    let south = at(0, 0) * (1.0 - u) + at(1, 0) * u;
    let north = at(0, 1) * (1.0 - u) + at(1, 1) * u;
    south * (1.0 - v) + north * v
}

/// A HIP `above` cells over a height function.
fn hip_over(height: Height, [x, y]: [f64; 2], above: f64) -> GridPoint {
    let (cell, z) = (
        [x.floor() as i32, y.floor() as i32],
        height_at(height, [x, y]) + above,
    );
    let frac = [x - x.floor(), y - y.floor(), z - z.floor()];
    let [u, v, w] = frac.map(|f| f as f32);
    GridPoint::new([cell[0], cell[1], z.floor() as i32], Vec3::new(u, v, w))
}

/// Returns the results along a path, after contact onset at its first place.
fn forces_along<const D: usize>(
    field: &Field<'_, D>,
    height: Height,
    friction: Friction,
    path: impl IntoIterator<Item = [f64; 2]>,
) -> Vec<ShadedTick> {
    let settings = ContactSettings {
        friction,
        ..ContactSettings::AT_1_KHZ
    };
    let mut contact = Contact::new(settings);
    let mut shader = Shader::of(Shading::Smooth).expect("shaded");
    let mut path = path.into_iter().peekable();
    let first = *path.peek().expect("a place");
    contact.step(&field.window, &hip_over(height, first, 1.0));
    path.map(|at| {
        let output = *contact.step(&field.window, &hip_over(height, at, -DEPTH));
        assert_eq!(output.state, ContactState::Touching, "at {at:?}");
        ShadedTick {
            proxy: output.proxy,
            plain: output.displacement,
            shaded: shader.shade(&field.window, &contact),
            missing: shader.missing(),
        }
    })
    .collect()
}

fn degrees(a: Vec3, b: Vec3) -> f32 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Maximum change of direction from one HIP to the next, degrees: without and with shading.
fn max_turns(rendered: &[ShadedTick]) -> (f32, f32) {
    rendered
        .windows(2)
        .fold((0.0, 0.0), |(plain, shaded), pair| {
            let turned = |of: fn(&ShadedTick) -> Vec3| degrees(of(&pair[0]), of(&pair[1]));
            (
                f32::max(plain, turned(|record| record.plain)),
                f32::max(shaded, turned(|record| record.shaded)),
            )
        })
}

/// A straight path with a HIP every [`STEP`].
fn straight(from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    let steps = (x.hypot(y) / STEP) as u32;
    (0..=steps).map(move |i| {
        let share = f64::from(i) / f64::from(steps);
        [from[0] + share * x, from[1] + share * y]
    })
}

/// Rough ground: bends of up to some 50°.
fn rough(x: i32, y: i32) -> f32 {
    let hash = (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)) as u32;
    let noise = (hash.wrapping_mul(2_654_435_761) >> 22) as f32 / 1024.0;
    0.25 * noise + 0.4 * x as f32 - 0.2 * y as f32
}

fn plane(x: i32, y: i32) -> f32 {
    0.5 * x as f32 - 0.25 * y as f32
}

/// A valley along column 12 and a ridge along column 20, of 53° each.
fn folds(x: i32, _: i32) -> f32 {
    0.5 * (x.min(20) - 12).abs() as f32 - 0.5 * (x - 20).max(0) as f32
}

/// A cliff of 8 cells between columns 10 and 11.
fn cliff(x: i32, _: i32) -> f32 {
    if x > 10 { 8.0 } else { 0.0 }
}

#[test]
fn shading_changes_nothing_on_a_plane() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), plane);
    let path = straight([3.3, 4.1], [35.2, 36.7]).step_by(cases(1, 100) as usize);
    for rendered in forces_along(&field, plane, Friction::NONE, path) {
        let off = (rendered.shaded - rendered.plain).length();
        assert!(off < 2e-6 * rendered.plain.length(), "{off}");
        assert_eq!(rendered.missing, None);
    }
}

#[test]
fn force_turns_evenly_over_valley_and_ridge() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), folds);
    for (from, to) in [(8.0, 16.0), (16.0, 24.0)] {
        let path = straight([from, 9.3], [to, 10.1]);
        let rendered = forces_along(&field, folds, Friction::NONE, path);
        let (plain, shaded) = max_turns(&rendered);
        assert!(
            plain > 20.0 && shaded < 0.1 * plain,
            "{plain}° and {shaded}°"
        );
        for rendered in &rendered {
            let sizes = (rendered.shaded.length(), rendered.plain.length());
            assert!((sizes.0 - sizes.1).abs() < 1e-6 * sizes.1, "{sizes:?}");
        }
    }
}

#[test]
fn shaded_normal_at_each_sample_averages_its_adjacent_edges() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(60, 60), rough);
    for i in 0..cases(400, 20) as i32 {
        // Including samples on tiles' borders.
        let (x, y) = (
            1 + (7 * i) % 58,
            if i % 3 == 0 { 32 } else { 1 + (5 * i) % 58 },
        );
        let mean = |before: f32, at: f32, after: f32| {
            let unit = |rise: f32| {
                let rise = f64::from(rise);
                [1.0 / rise.hypot(1.0), rise / rise.hypot(1.0)]
            };
            let (one, other) = (unit(at - before), unit(after - at));
            (one[1] + other[1]) / (one[0] + other[0])
        };
        let at = rough(x, y);
        let east = mean(rough(x - 1, y), at, rough(x + 1, y));
        let north = mean(rough(x, y - 1), at, rough(x, y + 1));
        let expected = Vec3::new(-east as f32, -north as f32, 1.0);
        let floor = at.floor();
        let proxy = GridPoint::new([x, y, floor as i32], Vec3::new(0.0, 0.0, at - floor));
        let slopes = SlopesAt::point(&field.window, &proxy).expect("a patch");
        let off = degrees(normal(slopes.smoothed), expected);
        assert!(off < 1e-3, "at {x}, {y}: {off}°");
    }
}

#[test]
fn shading_cuts_max_force_turn_tenfold_on_rough_terrain() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(60, 60), rough);
    let (mut plain, mut shaded) = (0.0_f32, 0.0_f32);
    for i in 0..cases(40, 1) {
        let y = 2.0 + f64::from(i);
        let path = straight([2.1, y], [57.9, y + 13.0 * f64::from(i % 2)]);
        let rendered = forces_along(&field, rough, Friction::NONE, path);
        let (a, b) = max_turns(&rendered);
        (plain, shaded) = (plain.max(a), shaded.max(b));
    }
    assert!(
        plain > 20.0 && shaded < 0.1 * plain,
        "{plain}° and {shaded}°"
    );
}

#[test]
fn cliff_is_not_smoothed() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), cliff);
    let rendered = forces_along(
        &field,
        cliff,
        Friction::NONE,
        straight([6.5, 9.5], [9.99, 9.5]),
    );
    for rendered in rendered {
        let to_foot = 10.0 - (rendered.proxy.cell()[0] as f32 + rendered.proxy.frac().x);
        let off = degrees(rendered.shaded, Vec3::Z);
        assert!(
            off < 0.01 || to_foot < MAX_NARROW_CELLS,
            "{to_foot} before it: {off}°"
        );
    }
    // On the cliff's face most of the force is rendered unchanged.
    for u in [0.21_f32, 0.5, 0.79] {
        let proxy = GridPoint::new([10, 9, 0], Vec3::new(u, 0.4, 8.0 * u));
        let slopes = SlopesAt::point(&field.window, &proxy).expect("a patch");
        assert!((slopes.smoothed[0] - 8.0).abs() < 1e-4, "{slopes:?}");
    }
}

/// Maximum distance from a cliff within which its bend is rendered, cells.
const MAX_NARROW_CELLS: f32 = 0.2;

#[test]
fn border_of_a_tile_is_rendered_as_its_inside() {
    // The same ground twice, the second time moved so that it contains a tile's corner.
    fn moved(x: i32, y: i32) -> f32 {
        rough(x - 22, y - 22)
    }
    let mut tiles = (buffers::<2>(), buffers::<2>());
    let inside = Field::<2>::filled(&mut tiles.0, FieldSize::new(60, 60), rough);
    let across = Field::<2>::filled(&mut tiles.1, FieldSize::new(60, 60), moved);
    let path = || straight([6.3, 7.9], [14.2, 12.1]);
    let shifted = path().map(|[x, y]| [x + 22.0, y + 22.0]);
    let one = forces_along(&inside, rough, Friction::NONE, path());
    let other = forces_along(&across, moved, Friction::NONE, shifted);
    for (one, other) in one.iter().zip(&other) {
        let off = degrees(one.shaded, other.shaded);
        assert!(off < 0.05, "{:?}: {off}°", one.proxy);
        assert_eq!(other.missing, None);
    }
}

#[test]
fn missing_tile_is_reported_and_ends_the_surface() {
    let mut tiles = buffers::<2>();
    let mut field = Field::<2>::empty(&mut tiles, FieldSize::new(100, 100), folds);
    field.install(TileKey::containing(0, Cell::new(5, 5)));
    let rendered = forces_along(&field, folds, Friction::NONE, [[30.5, 5.5], [31.5, 5.5]]);
    let missing: Vec<_> = rendered.iter().map(|record| record.missing).collect();
    assert_eq!(missing, [None, Some(TileIndex::new(1, 0))]);
    assert!(degrees(rendered[1].shaded, rendered[1].plain) < 1e-3);
}

#[test]
fn shading_smooths_beside_no_data_and_keeps_pull_back_force() {
    fn holed(x: i32, y: i32) -> f32 {
        match (x, y) {
            (15..=16, 10..=11) => f32::NAN,
            _ => rough(x, y),
        }
    }
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), holed);
    // Along the southern border of no-data, half a cell and a tenth of a cell away.
    for y in [8.5, 8.9] {
        let rendered = forces_along(
            &field,
            holed,
            Friction::NONE,
            straight([11.1, y], [20.3, y]),
        );
        let (plain, shaded) = max_turns(&rendered);
        assert!(
            plain > 10.0 && shaded < 0.1 * plain,
            "{plain}° and {shaded}°"
        );
    }
    // Over no-data the border pulls the HIP back as without shading.
    fn level(x: i32, y: i32) -> f32 {
        if x > 15 && y < 30 { f32::NAN } else { 3.0 }
    }
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), level);
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut shader = Shader::of(Shading::Smooth).expect("shaded");
    let mut faded = 0;
    for (x, z) in [(14.5, 3.5), (14.9, 2.9)]
        .into_iter()
        .chain((0..200).map(|i| (15.0 + 0.01 * i as f32, 2.9)))
    {
        let hip = GridPoint::new([0, 5, 0], Vec3::new(x, 0.5, z));
        let output = *contact.step(&field.window, &hip);
        assert_eq!(shader.shade(&field.window, &contact), output.displacement);
        faded += i32::from(output.state == ContactState::Touching && x > 15.0);
    }
    assert!(faded > 10);
}

#[test]
fn slopes_are_independent_of_the_tile_base_height() {
    let size = FieldSize::new(60, 60);
    let mut tiles = (buffers::<2>(), buffers::<2>());
    let even = Field::<2>::filled(&mut tiles.0, size, rough);
    let mut slots = tiles.1.iter_mut();
    let mut next = || slots.next().expect("a buffer for every slot");
    let mut window = Window::new([[next(), next()], [next(), next()]]);
    window.reset(0, size, 100);
    for (tile, base) in size.tiles().zip([0, 40, -7, 1_000]) {
        let buffer = next();
        let key = TileKey {
            level: 0,
            index: tile,
        };
        let filled = buffer.fill_from(key, base, size, |x, y| rough(x, y) - base as f32);
        assert_eq!(filled, Ok(()));
        let _ = window.install(buffer);
    }
    for at in straight([31.2, 20.4], [31.9, 40.3]) {
        let proxy = hip_over(rough, at, 0.0);
        let slopes = |window| SlopesAt::point(window, &proxy).expect("a patch").smoothed;
        let off = degrees(normal(slopes(&window)), normal(slopes(&even.window)));
        assert!(off < 0.02, "{at:?}: {off}°");
    }
}

#[test]
fn shading_turns_friction_together_with_normal_force() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), folds);
    for (from, to) in [(11.0, 13.0), (13.0, 11.0)] {
        // Into the valley and out of it.
        let rendered = forces_along(
            &field,
            folds,
            Friction::coulomb(0.5),
            straight([from, 9.3], [to, 9.3]),
        );
        let (plain, shaded) = max_turns(&rendered);
        assert!(
            plain > 50.0 && shaded < 1.0,
            "{from}: {plain}° and {shaded}°"
        );
        for rendered in &rendered {
            let sizes = (rendered.shaded.length(), rendered.plain.length());
            assert!((sizes.0 - sizes.1).abs() < 1e-6 * sizes.1, "{sizes:?}");
            assert!(rendered.shaded.z > 0.0);
        }
    }
}
