//! Changes of the placement under a pressing hand.

#[path = "in_contact_cancelled.rs"]
mod cancelled;

use core::cmp::Ordering;

use super::pressed_arm::{DEEP, PressedArm};
use super::*;
use crate::clutch::ClutchMode;
use crate::contact::Friction;
use crate::contact::surface::patch::Patch;
use crate::scene::{ContactMap, SceneChange};

/// Slopes of all directions, up to 20 degrees, with detail of 3 cells.
fn ground(x: i32, y: i32) -> f32 {
    let (x, y) = (f64::from(x), f64::from(y));
    let detail = 0.3 * (x * 2.1).sin() * (y * 1.9).cos();
    (5.5 + 3.0 * (x * 0.09).sin() * (y * 0.08).cos() + detail) as f32
}

/// The same ground in cells of twice and of half the size.
fn coarser(x: i32, y: i32) -> f32 {
    0.5 * ground(2 * x, 2 * y)
}

fn finer(x: i32, y: i32) -> f32 {
    let (x, y) = (f64::from(x) * 0.5, f64::from(y) * 0.5);
    let detail = 0.3 * (x * 2.1).sin() * (y * 1.9).cos();
    2.0 * (5.5 + 3.0 * (x * 0.09).sin() * (y * 0.08).cos() + detail) as f32
}

/// A fallback under the whole field, and a near part around its middle.
fn fallback(size: i32) -> Fallback {
    let part = |first, shift| CoarseTile {
        first: Cell::new(first, first),
        shift,
    };
    Fallback {
        wide: part(0, 5 + u8::from(size > 1024)),
        near: Some(part(size / 2 - 64, 2)),
    }
}

/// An arm of a hand with a tremor.
fn pressed(tiles: &mut [Tile], height: fn(i32, i32) -> f32) -> PressedArm<'_> {
    PressedArm {
        tremor: 1,
        ..PressedArm::new(tiles, height, GENTLE_N)
    }
}

impl PressedArm<'_> {
    /// Returns the change to a field with cells of 2^-`finer` of the present ones, of the same size
    /// in the hand: a zoom by 2^`finer`.
    fn zoom(&self, number: u8, level: u8, finer: i32) -> SceneChange {
        let before = self.device.haptics.scene.expect("a scene");
        let scale = (finer as f32).exp2();
        let size = (SIZE as f32 * scale) as i32;
        let proxy = self.last.sample.proxy;
        let to = GridPoint::new([0; 3], proxy.relative_to([0; 3]) * scale);
        SceneChange {
            number,
            scene: Scene {
                epoch: 100 + u32::from(number),
                level,
                size: FieldSize::new(size, size),
                fallback: Some(fallback(size)),
                ..before
            },
            hip: to,
            keeps_tiles: false,
            in_contact: Some(ContactMap {
                from: proxy,
                to,
                scale: Vec3::splat(scale),
            }),
        }
    }
}

/// Maximum change of the force in a tick of a still hand, N: a fifth of the guard's slew. The force
/// and a flat surface change it by 0.025 N each; facets that tilt while they blend add to that.
const GENTLE_N: f32 = 0.2;

#[test]
fn zoom_under_a_pressing_hand_keeps_the_force() {
    for (zoom, height) in [(-1, coarser as fn(i32, i32) -> f32), (1, finer)] {
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, ground);
        let before = arm.last.sample;
        let force_n = before.force_n.length();
        assert!(
            force_n > 1.0 && before.state == ContactState::Touching,
            "{before:?}"
        );
        let level = if zoom < 0 { 1 } else { 0 };
        let change = arm.zoom(1, level, zoom);
        arm.change(change, height);
        let mut min = force_n;
        for tick in 0..600 {
            let sample = arm.tick();
            min = min.min(sample.force_n.length());
            assert_eq!(sample.view, u8::from(tick > 0), "tick {tick}");
            assert!(
                !sample
                    .limits
                    .intersects(Limits::CLUTCH_OPEN | Limits::TERRAIN_MISSING)
            );
        }
        assert!(min > 0.5 * force_n, "zoom {zoom}: {min} of {force_n} N");
        let after = arm.last.sample;
        assert_eq!(after.limits, Limits::empty(), "on the new tiles");
        let place = change.in_contact.expect("a map").place(&before.proxy);
        let moved = place.to(&after.proxy).truncate().length();
        assert!(moved < 8.0, "zoom {zoom}: {moved} cells");
        assert!(arm.device.haptics.clutch.is_closed());
    }
}

/// Runs ticks in which the placement does not change.
fn stays(arm: &mut PressedArm<'_>, view: u8, ticks: usize) {
    for _ in 0..ticks {
        assert_eq!(arm.tick().view, view);
    }
}

/// The coarsest level of [`hills_of_level`].
const COARSEST: u8 = 8;

/// Hills of every size from 20 cells, in cells of level `L`; level 8 is a field of [`SIZE`] cells.
fn hills_of_level<const L: u8>(x: i32, y: i32) -> f32 {
    // Cells of level 8, from the middle of the field.
    let cell = (f64::from(L) - f64::from(COARSEST)).exp2();
    let [x, y] = [x, y].map(|at| f64::from(at) * cell - 320.0);
    let wave = |k: u8| {
        let long = 20.0 * (f64::from(k) - f64::from(COARSEST)).exp2();
        0.02 * long * ((x / long).sin() + (y / long).sin())
    };
    ((5.5 + (0..=COARSEST).map(wave).sum::<f64>()) / cell) as f32
}

const HILLS: [fn(i32, i32) -> f32; COARSEST as usize + 1] = [
    hills_of_level::<0>,
    hills_of_level::<1>,
    hills_of_level::<2>,
    hills_of_level::<3>,
    hills_of_level::<4>,
    hills_of_level::<5>,
    hills_of_level::<6>,
    hills_of_level::<7>,
    hills_of_level::<8>,
];

/// Returns the change between two levels of [`HILLS`], to cells of `cell_mm`: the touched place
/// stays, and the heights scale with the ground.
fn rescaled(arm: &PressedArm<'_>, number: u8, [from, level]: [u8; 2], cell_mm: f32) -> SceneChange {
    let before = arm.device.haptics.scene.expect("a scene");
    let proxy = arm.last.sample.proxy;
    // Exact also at 80,000 cells from the origin.
    let (cell, frac) = (proxy.cell(), proxy.frac());
    let to = match level.cmp(&from) {
        Ordering::Less => GridPoint::new(cell.map(|at| 2 * at), 2.0 * frac),
        Ordering::Equal => proxy,
        Ordering::Greater => {
            let odd = Vec3::from_array(cell.map(|at| (at & 1) as f32));
            GridPoint::new(cell.map(|at| at >> 1), 0.5 * (frac + odd))
        }
    }
    .normalised();
    let size = SIZE << (COARSEST - level);
    let part = |cells: i32, shift| CoarseTile {
        first: Cell::new(to.cell()[0] - cells, to.cell()[1] - cells),
        shift,
    };
    SceneChange {
        number,
        scene: Scene {
            epoch: 100 + u32::from(number),
            level,
            size: FieldSize::new(size, size),
            fallback: Some(Fallback {
                wide: part(512, 5),
                near: Some(part(64, 2)),
            }),
            cell_mm,
            ..before
        },
        hip: to,
        keeps_tiles: false,
        in_contact: Some(ContactMap {
            from: proxy,
            to,
            scale: Vec3::splat((f32::from(from) - f32::from(level)).exp2()),
        }),
    }
}

/// Minimum force of a press of some 2.5 N during zooms, N.
const MIN_HELD_N: f32 = 1.0;

/// Zooms by eight steps in, and by eight out. By factors of 2, the cells under the hand are as
/// large as before, and each is replaced by four; by factors of 1.5, also the size of a cell in the
/// hand changes, by 1.5 or 0.75.
#[test]
fn zooms_by_eight_steps_in_and_out_keep_the_force() {
    for factor in [2.0, 1.5] {
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, HILLS[usize::from(COARSEST)]);
        arm.tremor = 2;
        let first_n = arm.last.sample.force_n.length();
        // Cells of at least 0.75 mm, as fine as possible.
        let zoomed = |(level, cell_mm): (u8, f32)| match cell_mm * factor >= 1.5 {
            true => (level.saturating_sub(1), 0.5 * factor * cell_mm),
            false => (level, factor * cell_mm),
        };
        let zooms = core::iter::successors(Some((COARSEST, 1.0)), |last| Some(zoomed(*last)));
        let steps: Vec<_> = zooms.take(9).collect();
        assert_eq!(steps[8].0, if factor == 2.0 { 0 } else { 3 });
        let (mut least, mut most, mut from) = (f32::MAX, 0.0_f32, COARSEST);
        let in_and_out = steps[1..].iter().chain(steps[..8].iter().rev());
        for (n, (level, cell_mm)) in in_and_out.copied().enumerate() {
            let number = n as u8 + 1;
            let change = rescaled(&arm, number, [from, level], cell_mm);
            from = level;
            arm.change(change, HILLS[usize::from(level)]);
            for tick in 0..400 {
                let before_n = arm.last.sample.force_n;
                let sample = arm.tick();
                let step = std::format!("zooms by {factor}: step {number}, tick {tick}");
                let force_n = sample.force_n.length();
                assert!(force_n > MIN_HELD_N, "{step}: {force_n} N");
                let slew_n = (sample.force_n - before_n).length();
                assert!(slew_n <= MAX_SLEW_N, "{step}: {slew_n} N");
                let never = Limits::CLUTCH_OPEN | Limits::SLEW_LIMITED | Limits::TERRAIN_MISSING;
                assert!(!sample.limits.intersects(never), "{step}: {sample:?}");
                (least, most) = (least.min(force_n), most.max(slew_n));
            }
            let after = arm.last.sample;
            assert_eq!((after.view, after.limits), (number, Limits::empty()));
            let share = after.force_n.length() / first_n;
            assert!(
                (share - 1.0).abs() < 0.05,
                "step {number}: {share} of the press"
            );
            let scene = arm.device.haptics.scene.expect("a scene");
            assert_eq!((scene.level, scene.cell_mm), (level, cell_mm));
        }
        std::println!("zooms by {factor}: at least {least} N, at most {most} N in a tick");
    }
}

/// Maximum change of the force in a tick that the guard allows, N: 1,000 N/s.
const MAX_SLEW_N: f32 = 1.0;

/// Documented speed at which the surface blends to tiles that arrive, mm/s
/// (`docs/how-to/place-and-scale.md`). Not the product's constant, which this value checks.
const DOCUMENTED_BLEND_MM_S: f32 = 50.0;

/// The height of the rendered surface at a place, mm.
fn surface_mm(arm: &PressedArm<'_>, at: &GridPoint) -> f32 {
    let corners = arm.device.haptics.window.corners(at.column());
    let corners = corners.expect("rendered");
    let height = Patch::new(corners.heights).height(at.frac().x, at.frac().y);
    (corners.base as f32 + height) * arm.device.haptics.scene.expect("a scene").cell_mm
}

/// Heights of a field, cells, by column and row.
type Heights = fn(i32, i32) -> f32;

/// A zoom to a fallback that is 2 mm too high, or 1 mm too low: the surface under the hand moves by
/// that distance as its tiles arrive.
#[test]
fn surface_under_the_hand_blends_at_the_documented_speed() {
    let max_mm = DOCUMENTED_BLEND_MM_S / 1_000.0;
    // Cells of the new placement: of the same ground, finer and of 1 mm, or the same and larger.
    let zooms: [(i32, f32, Heights); 4] = [
        (1, 1.0, finer),
        (-1, 1.0, coarser),
        (0, 2.0, ground),
        (0, 0.5, ground),
    ];
    for ((zoom, cell_mm, height), rise_mm) in zooms
        .into_iter()
        .flat_map(|zoom| [2.0, -1.0].map(|rise_mm| (zoom, rise_mm)))
    {
        let what = std::format!("2^{zoom} cells of {cell_mm} mm, {rise_mm} mm high");
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, ground);
        arm.device.fallback_rise = rise_mm / cell_mm;
        let mut change = arm.zoom(1, u8::from(zoom < 0), zoom);
        change.scene.cell_mm = cell_mm;
        arm.change(change, height);
        while arm.tick().view == 0 {}
        let (at, force_n) = (arm.last.sample.proxy, arm.last.sample.force_n.length());
        let first = surface_mm(&arm, &at);
        let (mut before, mut fastest) = (first, 0.0_f32);
        for tick in 0..400 {
            let sample = arm.tick();
            assert!(!sample.limits.contains(Limits::CLUTCH_OPEN), "{what}");
            assert!(
                sample.force_n.length() > 0.5 * force_n,
                "{what}: {sample:?}"
            );
            let now = surface_mm(&arm, &at);
            let moved = (now - before).abs();
            // Heights are rounded in `f32`.
            assert!(moved <= 1.001 * max_mm, "{what}, tick {tick}: {moved} mm");
            (before, fastest) = (now, fastest.max(moved));
        }
        assert_eq!(arm.last.sample.limits, Limits::empty(), "{what}");
        let all_mm = first - before;
        std::println!("{what}: {all_mm} mm, by up to {fastest} mm a tick");
        // It moves by the error of the fallback, at the full speed.
        assert!((all_mm - rise_mm).abs() < 0.6, "{what}: {all_mm} mm");
        assert!(fastest > 0.99 * max_mm, "{what}: {fastest} mm");
    }
}

#[test]
fn change_waits_for_its_terrain_and_the_press() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, ground);
    let change = arm.zoom(1, 0, 1);
    // Its tiles do not come: the requester does not know of them.
    arm.device.send(Command::SceneChange(change));
    stays(&mut arm, 0, 50);
    assert!(!arm.device.haptics.clutch.is_closed());
    assert_eq!(arm.device.haptics.epoch(), Some(101));
    // A tile of the new field is refused while the window has those of the old one.
    let tile = arm.device.spare.pop().expect("a spare one");
    let key = TileKey::new(0, 3, 3);
    tile.fill(key, 0, |_, _| 0.0).expect("in range");
    let back = arm
        .device
        .haptics
        .accept(Command::Tile(tile))
        .expect("taken");
    arm.device.spare.push(back.expect("refused"));
    // The hand lifts, and the terrain arrives.
    assert_eq!(arm.move_to([0, 420, 0], 590).state, ContactState::Free);
    arm.change(change, finer);
    // Nothing presses.
    stays(&mut arm, 0, 20);
    // The clutch opens, and the change is made as always.
    arm.device.send(Command::Clutch(ClutchMode::InPlace));
    let open = arm.ticks(150);
    assert_eq!(open.view, 1);
    assert!(open.limits.contains(Limits::CLUTCH_OPEN));
    arm.device.send(Command::Clutch(ClutchMode::Released));
    assert_eq!(arm.ticks(520).limits, Limits::empty());
}

#[test]
fn change_without_heights_under_the_hand_is_not_made() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, ground);
    let change = arm.zoom(1, 0, 1);
    arm.change(change, |_, _| f32::NAN);
    stays(&mut arm, 0, 100);
    let n = arm.last.sample.force_n;
    assert!(n.length() > 1.0, "{n}");
}

#[test]
fn buffers_return_after_changes() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, ground);
    let spare = arm.device.spare.len();
    for number in 1..=20 {
        arm.change(arm.zoom(number, 0, 0), ground);
        stays(&mut arm, number - 1, 1);
        stays(&mut arm, number, 120);
        arm.device.spare.extend(arm.device.haptics.take_spare());
        arm.device.spare.extend(arm.device.haptics.take_spare());
        assert_eq!(arm.device.spare.len(), spare - 2, "two for the fallback");
    }
    // A change that is replaced before its terrain has arrived, and one that is cancelled.
    let change = arm.zoom(21, 1, -1);
    arm.device.send(Command::SceneChange(change));
    let wide = change.scene.fallback.expect("one").wide.key(1);
    let tile = arm.device.spare.pop().expect("a spare one");
    tile.fill(wide, 0, |_, _| 0.0).expect("in range");
    arm.device.send(Command::Tile(tile));
    arm.change(arm.zoom(22, 0, 0), ground);
    stays(&mut arm, 20, 1);
    stays(&mut arm, 22, 120);
    arm.device.spare.extend(arm.device.haptics.take_spare());
    arm.device.spare.extend(arm.device.haptics.take_spare());
    assert_eq!(arm.device.spare.len(), spare - 2);
    let mut again = scene(Source::Encoders);
    again.epoch = 900;
    arm.device.requester.reset(0, again.size);
    let mut free = arm
        .device
        .haptics
        .accept(Command::Scene(again))
        .expect("valid");
    while let Some(tile) = free {
        arm.device.spare.push(tile);
        free = arm.device.haptics.take_spare();
    }
    assert_eq!(arm.device.spare.len(), spare);
}

#[test]
fn stiffness_changes_the_force_gradually_and_not_the_depth() {
    for times in [2.0, 0.5] {
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, plane);
        let before = arm.last.sample;
        let mut change = arm.zoom(1, 0, 0);
        change.scene.params.stiffness_n_per_mm *= times;
        change.scene.fallback = None;
        change.keeps_tiles = true;
        arm.device.send(Command::SceneChange(change));
        stays(&mut arm, 1, 400);
        let halfway = arm.last.sample.limits;
        assert_eq!(halfway, Limits::CLUTCH_MOVES, "half a second, as a clutch");
        stays(&mut arm, 1, 200);
        let after = arm.last.sample;
        assert_eq!(after.limits, Limits::empty());
        let near = |a: f32, b: f32| (a - b).abs() < 0.01 * b;
        let [was_n, is_n] = [before, after].map(|sample| sample.force_n.length());
        assert!(near(is_n, times * was_n), "{times}: {is_n} of {was_n} N");
        let [was, is] = [before, after].map(|sample| sample.hip.to(&sample.proxy).length());
        assert!(near(is, was), "{times}: {is} of {was} cells");
    }
}

fn rough(x: i32, y: i32) -> f32 {
    let (x, y) = (f64::from(x), f64::from(y));
    (5.5 + 0.2 * (x * 0.8).sin() * (y * 0.9).cos()) as f32
}

#[test]
fn late_tiles_after_a_change_keep_the_force() {
    for (late_ticks, rise) in [(50, 3.0), (1_000, 3.0), (300, 0.3), (300, -0.3)] {
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, rough);
        arm.tremor = 2;
        arm.device.fallback_rise = rise;
        for number in 1..=6 {
            let before = arm.last.sample.force_n.length();
            arm.device.is_slow = true;
            arm.change(arm.zoom(number, 0, 0), |x, y| rough(x + 1, y + 2));
            for tick in 0..late_ticks + 700 {
                arm.device.is_slow = tick < late_ticks;
                let force_n = arm.tick().force_n.length();
                assert!(
                    (force_n / before - 1.0).abs() < 0.1,
                    "{rise}, {number}, {tick}: {force_n} of {before} N"
                );
            }
            assert_eq!(arm.last.sample.view, number);
            assert_eq!(arm.last.sample.limits, Limits::empty());
        }
    }
}

/// A slope of 60 degrees under a fallback that is too high.
#[test]
fn change_on_a_slope_keeps_the_force() {
    fn slope(x: i32, _: i32) -> f32 {
        5.5 + 1.732 * (x - 320) as f32
    }
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, slope);
    arm.device.fallback_rise = 3.0;
    let before = arm.last.sample.force_n.length();
    arm.change(arm.zoom(1, 0, 0), slope);
    for tick in 0..500 {
        let force_n = arm.tick().force_n.length();
        assert!(
            (force_n / before - 1.0).abs() < 0.05,
            "{tick}: {force_n} of {before} N"
        );
    }
    assert_eq!(arm.last.sample.view, 1);
}

/// A pan from a slope of 60 degrees to the opposite one: the force before would pull the hand off
/// the new surface.
#[test]
fn change_to_an_opposite_slope_is_not_made() {
    fn slope(x: i32, _: i32) -> f32 {
        5.5 + 1.732 * (x - 320) as f32
    }
    fn opposite(x: i32, _: i32) -> f32 {
        5.5 - 1.732 * (x - 320) as f32
    }
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, slope);
    let mut change = arm.zoom(1, 0, 0);
    let map = change.in_contact.as_mut().expect("a map");
    let at = map.to.relative_to([0; 3]);
    let height = 5.5 - 1.732 * (at.x - 320.0);
    map.to = GridPoint::new([0; 3], at.with_z(height)).normalised();
    arm.change(change, opposite);
    stays(&mut arm, 0, 200);
}

/// On a surface of a ninth of the stiffness, the force turns as fast as a clutch closes.
#[test]
fn force_turns_on_a_soft_surface_in_half_a_second() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let mut change = arm.zoom(1, 0, 0);
    change.scene.params.stiffness_n_per_mm *= 0.11;
    arm.change(change, plane);
    stays(&mut arm, 0, 1);
    stays(&mut arm, 1, 300);
    assert!(!arm.device.haptics.clutch.is_closed());
    stays(&mut arm, 1, 260);
    assert!(arm.device.haptics.clutch.is_closed());
}

/// A still hand on flat ground presses, reduces its force after a change, and clutches.
#[test]
fn old_force_does_not_return() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    arm.change(arm.zoom(1, 0, 0), plane);
    stays(&mut arm, 0, 1);
    stays(&mut arm, 1, 60);
    while arm.last.sample.force_n.length() > 0.3 {
        arm.counts[1] += 2;
        arm.tick();
    }
    arm.send(Command::Clutch(ClutchMode::InPlace));
    for _ in 0..150 {
        let sample = arm.tick();
        assert!(sample.force_n.length() < 0.4, "{sample:?}");
    }
}

/// The force at its limit, under a fallback that is too high, would not follow the surface; and on
/// a fallback the hand is not where the new placement was computed.
#[test]
fn change_at_the_limit_or_on_the_fallback_is_not_made() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let mut change = arm.zoom(1, 0, 0);
    change.scene.params.max_force_n = 4.0;
    arm.device.fallback_rise = 4.0;
    arm.change(change, plane);
    stays(&mut arm, 0, 100);

    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    arm.change(arm.zoom(1, 0, 0), plane);
    stays(&mut arm, 0, 1);
    stays(&mut arm, 1, 60);
    arm.device.is_slow = true;
    for _ in 0..800 {
        arm.counts[0] += 4;
        arm.tick();
    }
    assert_eq!(arm.last.sample.limits, Limits::TERRAIN_COARSE);
    arm.change(arm.zoom(2, 0, 0), plane);
    stays(&mut arm, 1, 60);
}

/// The hand slides while the terrain of a pan is late, and the new ground has another slope.
#[test]
fn slide_before_a_pan_keeps_the_force() {
    fn slope(x: i32, _: i32) -> f32 {
        5.5 + (x - 320) as f32
    }
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let change = arm.zoom(1, 0, 0);
    arm.device.send(Command::SceneChange(change));
    let began = arm.last.sample.proxy;
    for _ in 0..250 {
        arm.counts[0] += 2;
        arm.tick();
    }
    let slid = began.to(&arm.last.sample.proxy);
    assert!(slid.x > 10.0 && arm.last.sample.view == 0, "{slid}");
    let before = arm.last.sample.force_n.length();
    arm.change(change, slope);
    for tick in 0..300 {
        let force_n = arm.tick().force_n.length();
        // The proxy slides down the slope, until the force is along its normal.
        let ratio = force_n / before;
        assert!(
            (0.65..1.05).contains(&ratio),
            "{tick}: {force_n} of {before} N"
        );
    }
    assert_eq!(arm.last.sample.view, 1);
}

/// Friction is set to zero together with a zoom, and the tiles are late: the force of the friction
/// ends all the same.
#[test]
fn late_tile_holds_no_force_sideways() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    dragged(&mut arm);
    arm.device.is_slow = true;
    let mut change = arm.zoom(2, 0, 1);
    change.scene.params.friction = Friction::NONE;
    arm.change(change, |x, y| 2.0 * plane(x, y));
    stays(&mut arm, 1, 1);
    stays(&mut arm, 2, 600);
    let after = arm.last.sample.force_n;
    assert!(after.truncate().length() < 0.01 && after.z > 2.0, "{after}");
}

/// Nothing of an old force remains in an arm that is not driven.
#[test]
fn disarming_ends_the_turn_of_the_force() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    arm.device.fallback_rise = 2.0;
    arm.device.is_slow = true;
    arm.change(arm.zoom(1, 0, 0), plane);
    stays(&mut arm, 0, 1);
    stays(&mut arm, 1, 100);
    assert!(!arm.device.haptics.clutch.is_closed());
    arm.send(Command::Disarm);
    for _ in 0..300 {
        arm.last = arm.device.tick(arm.counts);
    }
    assert!(arm.device.haptics.clutch.is_closed());
}

/// Drags the hand over rubber, by 9 mm, with placement number 1.
fn dragged(arm: &mut PressedArm<'_>) {
    let mut rubber = arm.zoom(1, 0, 0);
    rubber.scene.params.friction = Friction::coulomb(2.0);
    rubber.scene.fallback = None;
    rubber.keeps_tiles = true;
    arm.device.send(Command::SceneChange(rubber));
    stays(arm, 1, 700);
    for _ in 0..150 {
        arm.counts[0] += 2;
        arm.tick();
    }
    stays(arm, 1, 100);
}

#[test]
fn friction_keeps_its_force_in_a_change() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    dragged(&mut arm);
    let before = arm.last.sample.force_n;
    assert!(before.truncate().length() > before.z, "{before}");
    arm.change(arm.zoom(2, 0, 1), |x, y| 2.0 * plane(x, y));
    stays(&mut arm, 1, 1);
    stays(&mut arm, 2, 900);
    let after = arm.last.sample.force_n;
    assert!(
        (after - before).length() < 0.05 * before.length(),
        "{before} then {after}"
    );
}

#[test]
fn change_that_would_drop_or_raise_the_force_is_not_made() {
    for times in [0.05, 2.0] {
        let mut tiles = buffers::<4>();
        let mut arm = pressed(&mut tiles, plane);
        let mut change = arm.zoom(1, 0, 0);
        change.scene.params.stiffness_n_per_mm *= times;
        arm.change(change, plane);
        stays(&mut arm, 0, 200);
    }
}

#[test]
fn change_in_the_air_keeps_the_height_over_the_ground() {
    fn hill(x: i32, y: i32) -> f32 {
        (5.5 + 0.3 * f64::from(x - 320) + 0.1 * f64::from(y - 320)) as f32
    }
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, hill);
    let change = arm.zoom(1, 0, 1);
    arm.device.send(Command::SceneChange(change));
    // The hand lifts before the terrain has arrived, and moves away.
    arm.tremor = 0;
    arm.move_to([590, 420, 0], 590);
    let above_mm = |sample: &TickRecord, scale: f32| {
        let at = sample.hip.relative_to([0; 3]);
        let ground = 5.5 * scale + 0.3 * (at.x - 320.0 * scale) + 0.1 * (at.y - 320.0 * scale);
        at.z - ground
    };
    let before = above_mm(&arm.last.sample, 1.0);
    arm.device.send(Command::Clutch(ClutchMode::InPlace));
    assert_eq!(arm.ticks(150).view, 1);
    let after = above_mm(&arm.last.sample, 2.0);
    assert!(
        before > 5.0 && (after - before).abs() < 0.01,
        "{after} of {before} mm"
    );
}

/// A number from 0 to 1 by a simple generator, for tests.
fn random(state: &mut u32) -> f32 {
    *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    (*state >> 8) as f32 / (1 << 24) as f32
}

/// Random changes, also to places without terrain and beyond its borders, during a random motion of
/// a hand that presses, lifts and clutches.
#[test]
fn random_changes_make_no_step_and_lose_no_buffer() {
    let heights = [ground, coarser, finer, |x: i32, y: i32| {
        match (x ^ y) & 64 {
            0 => 5.0,
            _ => f32::NAN,
        }
    }];
    let mut tiles = std::vec![Tile::VACANT; 16 + 5];
    let mut arm = pressed(&mut tiles, ground);
    let (all, state) = (arm.device.spare.len(), &mut 7);
    let mut counts = [0, 0];
    for n in 0..cases(400, 40) {
        let zoom = (random(state) * 7.0) as i32 - 3;
        let size = (SIZE as f32 * (zoom as f32).exp2()) as i32;
        let mut change = arm.zoom((n as u8).wrapping_add(1), (random(state) * 3.0) as u8, zoom);
        let map = change.in_contact.as_mut().expect("a map");
        if random(state) < 0.5 {
            let at = |state: &mut u32| (random(state) * 1.2 * size as f32) as i32;
            map.to = GridPoint::new([at(state), at(state), 5], Vec3::splat(0.3));
        }
        change.scene.params.stiffness_n_per_mm = 0.1 + random(state);
        // As the link, which refuses another change before this one is made.
        let is_made = arm.last.sample.view == n as u8;
        change.keeps_tiles = is_made && random(state) < 0.2;
        if change.keeps_tiles {
            let before = arm.device.haptics.scene.expect("a scene");
            (change.scene.level, change.scene.size) = (before.level, before.size);
        }
        let height = match change.keeps_tiles {
            true => arm.device.height,
            false => heights[(random(state) * 4.0) as usize],
        };
        arm.change(change, height);
        let clutch = random(state);
        for tick in 0..200 {
            let to = 60.0 * (0.02 * (n * 200 + tick) as f32).sin() + DEEP[1] as f32 * random(state);
            arm.counts[1] += (to as i32 - arm.counts[1]).clamp(-2, 2);
            let sample = arm.tick();
            // The guard would hide a step of the force.
            let is_limited = sample.limits.contains(Limits::SLEW_LIMITED);
            assert!(!is_limited, "change {n}, tick {tick}: {sample:?}");
            if sample.state == ContactState::Free && tick > 20 {
                assert!(sample.force_n.length() < 1.0, "in the air: {sample:?}");
            }
            match tick {
                100 if clutch < 0.3 => arm.send(Command::Clutch(ClutchMode::InPlace)),
                150 => arm.send(Command::Clutch(ClutchMode::Released)),
                _ => {}
            }
        }
        counts[usize::from(arm.last.sample.view == change.number)] += 1;
        arm.device
            .spare
            .extend(core::iter::from_fn(|| arm.device.haptics.take_spare()));
        assert!(arm.device.spare.len() + 4 >= all, "change {n}");
    }
    assert!(counts[0] > 4 && counts[1] > 4, "both occur: {counts:?}");
}
