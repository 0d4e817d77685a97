//! The clutch, and changes of the placement while it is open.

use super::pressed_arm::{DEEP, PressedArm};
use super::*;
use crate::clutch::ClutchMode::{InPlace, Released, WithHand};
use crate::guard::MAX_SLEW_N_PER_S;
use crate::scene::SceneChange;

/// Maximum change of the force in a tick, N.
const SLEW_N: f32 = MAX_SLEW_N_PER_S / 1000.0;
/// Maximum change of the force in a tick while the clutch moves and the arm stands still: 8.5 N in
/// 0.1 s, plus rounding.
const GENTLE_N: f32 = 0.0851;
fn pressed(tiles: &mut [Tile], height: fn(i32, i32) -> f32) -> PressedArm<'_> {
    PressedArm::new(tiles, height, GENTLE_N)
}

/// Returns the depth, cells of 1 mm.
fn depth_mm(sample: &TickRecord) -> f32 {
    sample.hip.to(&sample.proxy).length()
}

fn gentle(x: i32, y: i32) -> f32 {
    5.5 + 0.3 * hills(x, y)
}

/// Every second sample of the same ground, in cells of that size.
fn coarse(x: i32, y: i32) -> f32 {
    0.5 * gentle(2 * x, 2 * y)
}

fn view(number: u8, level: u8, hip: GridPoint) -> SceneChange {
    let size = (SIZE >> level, SIZE >> level);
    SceneChange {
        number,
        scene: Scene {
            epoch: 100 + u32::from(number),
            level,
            size: FieldSize::new(size.0, size.1),
            ..scene(Source::Encoders)
        },
        hip,
        keeps_tiles: false,
        in_contact: None,
    }
}

/// The same place in cells of half the size.
fn halved(point: GridPoint) -> GridPoint {
    let [x, y, z] = point.cell();
    let odd = Vec3::new((x & 1) as f32, (y & 1) as f32, (z & 1) as f32);
    GridPoint::new([x >> 1, y >> 1, z >> 1], 0.5 * (odd + point.frac()))
}

#[test]
fn held_clutch_has_no_force_and_shifts_the_terrain() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let rendered = arm.tick();
    assert!(rendered.force_n.z > 2.0, "{}", rendered.force_n);
    arm.device.send(Command::Clutch(WithHand));
    let opening = arm.ticks(99);
    assert!(opening.limits.contains(Limits::CLUTCH_MOVES));
    assert!(opening.force_n.z > 0.0);
    let open = arm.ticks(2);
    assert!(open.limits.contains(Limits::CLUTCH_OPEN));
    assert_eq!(open.force_n, Vec3::ZERO);
    // The hand moves, and the terrain follows it.
    for n in 0..200 {
        arm.counts = [n, DEEP[1] + 2 * n, -n];
        assert!(arm.tick().hip.is_same(&open.hip));
    }
    let home = |arm: &PressedArm<'_>| arm.device.haptics.scene.expect("a scene").home;
    let before = home(&arm);
    arm.device.send(Command::Clutch(Released));
    let back = arm.ticks(510);
    assert_eq!(back.limits, Limits::empty());
    assert!(open.hip.to(&back.hip).length() < 1e-4, "{:?}", back.hip);
    assert!((back.force_n - rendered.force_n).length() < 1e-3);
    let moved = before.to(&home(&arm));
    assert!(moved.length() > 5.0 && moved.z < -5.0, "{moved}");
    // From here on the hand stands still again.
    arm.counts = [199, DEEP[1] + 398 + 60, -199];
    arm.max_n = SLEW_N;
    assert!(arm.tick().hip.to(&open.hip).z < -1.0);
}

/// Safety: 15.
#[test]
fn terrain_stays_while_held_for_another_placement() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let rendered = arm.tick();
    arm.device.send(Command::Clutch(InPlace));
    let open = arm.ticks(105);
    // The hand yields by some 2 mm, and then moves 3 mm to the side.
    arm.move_to([60, DEEP[1] - 70, 0], 100);
    assert!(arm.last.sample.hip.is_same(&open.hip));
    // The same ground, twice as large.
    let mut change = view(1, 0, open.hip);
    change.scene.cell_mm = 2.0;
    change.keeps_tiles = true;
    arm.change(change, plane);
    arm.ticks(20);
    arm.device.send(Command::Clutch(Released));
    let deeper = arm.ticks(510);
    assert_eq!(deeper.limits, Limits::empty());
    assert!(
        deeper.force_n.z > rendered.force_n.z + 0.5,
        "{}",
        deeper.force_n
    );
    // The arm is pushed back to its earlier place.
    let back = arm.move_to(DEEP, 300);
    let change = back.force_n - rendered.force_n;
    assert!(
        change.length() < 2e-3,
        "{} and {}",
        rendered.force_n,
        back.force_n
    );
}

/// Safety: 15.
#[test]
fn far_hand_motion_shifts_terrain_in_place_mode() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let home = |arm: &PressedArm<'_>| arm.device.haptics.scene.expect("a scene").home;
    let before = home(&arm);
    let hip = arm.tick().hip;
    arm.device.send(Command::Clutch(InPlace));
    arm.ticks(105);
    arm.move_to([0, DEEP[1] + 1_000, 0], 500);
    arm.device.send(Command::Clutch(Released));
    let back = arm.ticks(510);
    // Cells are millimetres here.
    let moved = hip.to(&back.hip).length();
    assert!((moved - 10.0).abs() < 0.01, "{moved} mm");
    let along = before.to(&home(&arm)).length();
    assert!(along > 15.0, "{along} mm");
}

#[test]
fn with_hand_mode_shifts_terrain_until_clutch_closes() {
    let mut tiles = buffers::<4>();
    for holds in [[InPlace, WithHand, InPlace], [WithHand, InPlace, InPlace]] {
        let mut arm = pressed(&mut tiles, plane);
        let hip = arm.tick().hip;
        for hold in holds {
            arm.device.send(Command::Clutch(hold));
            arm.ticks(60);
        }
        arm.move_to([0, DEEP[1] + 100, 0], 50);
        arm.device.send(Command::Clutch(Released));
        let back = arm.ticks(510).hip;
        assert!(hip.to(&back).length() < 1e-3, "{holds:?}: {back:?}");
        // The next time starts from zero.
        arm.device.send(Command::Clutch(InPlace));
        arm.ticks(110);
        arm.move_to([0, DEEP[1] + 60, 0], 50);
        arm.device.send(Command::Clutch(Released));
        let moved = hip.to(&arm.ticks(510).hip).length();
        assert!(moved > 1.0, "{moved} mm");
    }
}

#[test]
fn clutch_stays_open_until_board_input_and_host_release_it() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    let rendered = arm.tick();
    arm.device.send(Command::ClutchInput(true));
    let open = arm.ticks(105);
    let limits = Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT;
    assert_eq!((open.limits, open.force_n), (limits, Vec3::ZERO));
    // The terrain follows the hand, even if the host requests otherwise.
    arm.device.send(Command::Clutch(InPlace));
    arm.move_to([0, DEEP[1] + 100, 0], 50);
    arm.device.send(Command::Clutch(Released));
    assert_eq!(arm.ticks(50).limits, limits);
    arm.device.send(Command::Clutch(InPlace));
    arm.device.send(Command::ClutchInput(false));
    assert_eq!(
        arm.ticks(50).limits,
        Limits::CLUTCH_OPEN,
        "the host holds it"
    );
    arm.device.send(Command::Clutch(Released));
    let back = arm.ticks(510);
    assert_eq!(back.limits, Limits::empty());
    assert!((back.force_n - rendered.force_n).length() < 1e-3);
}

#[test]
fn held_clutch_input_opens_next_scene_but_no_replay() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::armed(&mut tiles, plane);
    device.send(Command::ClutchInput(true));
    let mut points = scene(Source::Points);
    points.epoch = 7;
    device.requester.reset(0, points.size);
    device.send(Command::Scene(points));
    let at = |z| GridPoint::new([320, 320, 0], Vec3::new(0.5, 0.5, z));
    assert_eq!(device.step(0, at(9.0)).limits, Limits::empty());
    let again = scene(Source::Encoders);
    device.requester.reset(0, again.size);
    device.send(Command::Scene(again));
    let mut limits = Limits::empty();
    for _ in 0..110 {
        limits = device.tick([0; 3]).sample.limits;
    }
    assert_eq!(limits, Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT);
    device.send(Command::ClutchInput(false));
    for _ in 0..510 {
        limits = device.tick([0; 3]).sample.limits;
    }
    assert_eq!(limits, Limits::empty());
}

#[test]
fn clutch_released_early_opens_fully_then_closes() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, plane);
    arm.device.send(Command::Clutch(WithHand));
    arm.ticks(20);
    arm.device.send(Command::Clutch(Released));
    let mut min = f32::MAX;
    for _ in 0..620 {
        min = min.min(arm.tick().force_n.z);
    }
    assert_eq!(min, 0.0);
    let limits = arm.tick().limits;
    assert_eq!(limits, Limits::empty(), "and closes again");
    assert!(arm.last.sample.force_n.z > 2.0);
}

/// Safety: 15.
#[test]
fn placement_keeps_the_depth_and_the_arm_stays_armed() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, gentle);
    arm.device.send(Command::Clutch(WithHand));
    arm.ticks(110);
    let depth = depth_mm(&arm.last.sample);
    assert!(depth > 3.0, "{depth}");
    let ticks_before = arm.last.sample.tick;
    // Half of the samples, at the same size in the hand: zoomed out by two. The height is wrong
    // intentionally: the device computes its own.
    let hip = halved(arm.last.sample.hip);
    let [x, y, z] = hip.cell();
    let wrong = GridPoint::new([x, y, z + 9], hip.frac());
    arm.change(view(1, 1, wrong), coarse);
    arm.ticks(40);
    let sample = arm.last.sample;
    assert_eq!((sample.view, sample.state), (1, ContactState::Touching));
    assert_eq!(sample.force_n, Vec3::ZERO, "not before it is let go");
    assert!(sample.tick > ticks_before, "ticks go on");
    arm.device.send(Command::Clutch(Released));
    arm.ticks(510);
    let now = depth_mm(&arm.last.sample);
    assert!(now <= depth + 1e-3 && now > 0.5 * depth, "{now} of {depth}");
    assert_eq!(arm.last.sample.limits, Limits::empty());
    assert!(arm.last.sample.force_n.length() > 1.0);
}

#[test]
fn placement_sets_the_position_of_a_free_hip() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, gentle);
    arm.move_to([0, 420, 0], 600);
    assert_eq!(arm.tick().state, ContactState::Free);
    arm.device.send(Command::Clutch(InPlace));
    arm.ticks(110);
    let [x, y, z] = arm.last.sample.hip.cell();
    let there = GridPoint::new([x + 20, y - 9, z + 3], Vec3::splat(0.25));
    arm.change(view(1, 0, there), gentle);
    assert!(arm.ticks(40).hip.is_same(&there));
    arm.device.send(Command::Clutch(Released));
    let closed = arm.ticks(510);
    assert!(closed.hip.to(&there).length() < 1e-3, "{:?}", closed.hip);
    assert_eq!(
        (closed.limits, closed.force_n),
        (Limits::empty(), Vec3::ZERO)
    );
}

#[test]
fn eight_placements_in_a_row_make_no_force_step() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, gentle);
    for number in 1..=8 {
        arm.device.send(Command::Clutch(WithHand));
        arm.ticks(101);
        let hip = arm.last.sample.hip;
        let mut change = view(number, 0, hip);
        // Twice as large in the hand: the same tiles, in cells.
        change.scene.cell_mm = f32::from(1u16 << number);
        change.keeps_tiles = true;
        let served = arm.device.served;
        arm.change(change, gentle);
        arm.device.send(Command::Clutch(Released));
        arm.ticks(550);
        assert!(arm.device.served - served < 5, "its tiles stay");
        assert_eq!(arm.last.sample.view, number);
        assert!(arm.last.sample.force_n.length() > 0.5);
    }
}

/// Safety: 15.
#[test]
fn clutch_stays_open_until_a_placement_has_its_tiles() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, gentle);
    arm.device.send(Command::Clutch(WithHand));
    arm.ticks(110);
    let change = view(1, 1, halved(arm.last.sample.hip));
    arm.device.send(Command::SceneChange(change));
    arm.device.send(Command::Clutch(Released));
    let outcome = |arm: &mut PressedArm<'_>| {
        let sense = GuardInputs {
            counts: DEEP,
            dead_man: true,
            ..GuardInputs::default()
        };
        arm.device.haptics.tick(&sense, true)
    };
    for _ in 0..700 {
        let now = outcome(&mut arm);
        assert_eq!(now.sample.force_n, Vec3::ZERO);
        assert_eq!(now.sample.mode, Mode::Armed);
        assert!(now.sample.missing_tile.is_some());
        assert!(now.sample.limits.contains(Limits::CLUTCH_OPEN));
    }
    arm.device.requester.reset(1, change.scene.size);
    (arm.device.height, arm.device.size) = (coarse, change.scene.size);
    arm.last = outcome(&mut arm);
    arm.ticks(560);
    assert!(arm.last.sample.force_n.length() > 1.0);
}

#[test]
fn placement_during_contact_disarms_as_another_scene_does() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, gentle);
    let before = arm.last.sample.force_n;
    let change = view(1, 0, arm.last.sample.hip);
    arm.device.send(Command::SceneChange(change));
    let now = arm.device.tick(DEEP);
    assert_eq!(now.sample.mode, Mode::Fading);
    assert!((now.sample.force_n - before).length() < 0.1);
}

/// Safety: 15.
#[test]
fn force_rise_rate_stays_bounded_under_random_commands() {
    let mut tiles = buffers::<4>();
    let mut arm = pressed(&mut tiles, gentle);
    let mut rng = 12_345_u32;
    let mut rise_n = 0.0;
    for tick in 0..cases(20_000, 2_000) {
        rng = rng.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let dice = rng >> 24;
        match dice {
            0..32 => arm.device.send(Command::Clutch(WithHand)),
            32..64 => arm.device.send(Command::Clutch(InPlace)),
            64..150 => arm.device.send(Command::Clutch(Released)),
            150..155 => arm.device.send(Command::ClutchInput(true)),
            155..160 => arm.device.send(Command::ClutchInput(false)),
            160..200 if arm.last.sample.limits.contains(Limits::CLUTCH_OPEN) => {
                let mut change = view(tick as u8, 0, arm.last.sample.hip);
                change.scene.cell_mm = [0.5, 1.0, 2.0][dice as usize % 3];
                change.keeps_tiles = dice.is_multiple_of(2);
                arm.change(change, gentle);
            }
            _ => {}
        }
        let before = arm.last.sample.force_n.length();
        let after = arm.tick().force_n.length();
        rise_n += (after - before).max(0.0);
    }
    // The full force returns no faster than once in 0.5 s.
    let max = 7.65 * cases(20_000, 2_000) as f32 / 500.0;
    assert!(rise_n <= max, "{rise_n} N came in, {max} at most");
}

/// Safety: 15.
#[test]
fn held_clutch_does_not_allow_arming_inside_the_ground() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::new(&mut tiles, Source::Encoders, plane);
    device.send(Command::Zero([0; 3]));
    let deeper = (0..60).map(|n| [0, -n, 0]);
    let last = dip().chain(deeper).map(|c| device.tick(c)).last();
    assert_eq!(last.expect("ticks").sample.state, ContactState::Touching);
    device.send(Command::Clutch(WithHand));
    for _ in 0..110 {
        let _ = device.tick([0, -60, 0]);
    }
    device.send(Command::Arm);
    let open = device.tick([0, -60, 0]).sample.limits;
    assert!(open.contains(Limits::CLUTCH_OPEN));
    device.dead_man = true;
    for _ in 0..500 {
        let sample = device.tick([0, -60, 0]).sample;
        assert!(!sample.mode.is_driving());
    }
    let blockers = device.haptics.report().blockers;
    assert!(blockers.contains(Blockers::FORCE_TOO_LARGE));
}

/// A replay of a recording makes the same change.
#[test]
fn point_replay_continues_after_a_scene_change() {
    let mut tiles = buffers::<4>();
    let mut device = replaying_on(&mut tiles, gentle);
    let at = |z| GridPoint::new([320, 320, 0], Vec3::new(0.5, 0.5, z));
    assert_eq!(device.step(0, at(9.0)).state, ContactState::Free);
    let before = device.step(1, at(2.0));
    assert_eq!(before.state, ContactState::Touching);
    let change = SceneChange {
        scene: Scene {
            source: Source::Points,
            ..view(1, 1, at(0.0)).scene
        },
        ..view(1, 1, halved(at(2.0)))
    };
    device.requester.reset(1, change.scene.size);
    (device.height, device.size) = (coarse, change.scene.size);
    device.send(Command::SceneChange(change));
    let after = device.step(2, change.hip);
    assert_eq!((after.state, after.view), (ContactState::Touching, 1));
    // From the first tick, as in the recording of a hand that presses.
    assert!(after.force_n.length() > 0.5, "{}", after.force_n);
    let last = (3..40).map(|seq| device.step(seq, change.hip)).last();
    let change_n = (last.expect("points").force_n - after.force_n).length();
    assert!(change_n < 0.01, "{change_n} N");
}

fn replaying_on(tiles: &mut [Tile], height: fn(i32, i32) -> f32) -> Device<'_, 4> {
    Device::<4>::new(tiles, Source::Points, height)
}
