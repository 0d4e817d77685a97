//! The tick as a whole: arm to currents, and replay through a moving window.

use std::vec::Vec;

use super::*;
use crate::cases::cases;
use crate::contact::ContactState;
use crate::force::{Controller, Damping, SurfaceParams};
use crate::grid::{Cell, MAX_CELL};
use crate::guard::{Blockers, Fault, Mode};
use crate::phantom::Calibration;
use crate::rate::TickRate;
use crate::scene::HipCommand;
use crate::terrain::testing::buffers;
use crate::terrain::{
    CoarseTile, Fallback, FieldSize, RequestHint, TILE_SAMPLES, Tile, TileKey, TileRequester,
};

#[path = "tick_tests/in_contact.rs"]
mod in_contact;
#[path = "tick_tests/materials.rs"]
mod materials;
#[path = "tick_tests/pressed_arm.rs"]
mod pressed_arm;
#[path = "tick_tests/textured.rs"]
mod textured;
#[path = "tick_tests/views.rs"]
mod views;

const SIZE: i32 = 640;

/// The spring alone: these arms jump from place to place, which the controller would not expect of
/// a hand.
const SPRING: SurfaceParams = SurfaceParams {
    damping: Damping {
        controller: Controller::Off,
        ..Damping::NONE
    },
    ..SurfaceParams::PREMIUM
};

fn scene(source: Source) -> Scene {
    Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(SIZE, SIZE),
        top: 1 << 20,
        fallback: None,
        cell_mm: 1.0,
        home: GridPoint::new([320, 320, 5], Vec3::ZERO),
        params: SPRING,
        source,
        hold_clock: false,
        materials: None,
    }
}

/// A device in memory: the loop, its tile requests, and a host that always answers.
struct Device<'t, const D: usize> {
    haptics: Haptics<'t, D>,
    requester: TileRequester<D>,
    spare: Vec<&'t mut Tile>,
    height: fn(i32, i32) -> f32,
    /// The material of a sample, in a scene with materials; `None` for tiles without.
    material: fn(TileKey, [i32; 2]) -> Option<u8>,
    size: FieldSize,
    hint: RequestHint,
    served: usize,
    dead_man: bool,
    /// The fallback whose tiles are served, and the level of its scene.
    fallback: Option<(Fallback, u8)>,
    /// Height of the fallback over the ground.
    fallback_rise: f32,
    /// True if the tiles of the field itself are late.
    is_slow: bool,
}

impl<'t, const D: usize> Device<'t, D> {
    fn new(tiles: &'t mut [Tile], source: Source, height: fn(i32, i32) -> f32) -> Self {
        let mut spare: Vec<_> = tiles.iter_mut().collect();
        let mut next = || spare.pop().expect("a tile for every slot");
        let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
        let mut haptics = Haptics::new(slots, TickRate::DEFAULT, None);
        let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5);
        haptics.configure(mechanism.expect("valid"));
        let scene = scene(source);
        assert!(matches!(haptics.accept(Command::Scene(scene)), Ok(None)));
        let mut requester = TileRequester::new();
        requester.reset(scene.level, scene.size);
        Self {
            haptics,
            requester,
            spare,
            height,
            material: |_, _| None,
            size: scene.size,
            hint: RequestHint::default(),
            served: 0,
            dead_man: false,
            fallback: None,
            fallback_rise: 0.0,
            is_slow: false,
        }
    }

    /// The same device, armed in the arm's zero pose.
    fn armed(tiles: &'t mut [Tile], height: fn(i32, i32) -> f32) -> Self {
        let mut device = Self::new(tiles, Source::Encoders, height);
        device.arm([0; 3]);
        device
    }

    fn send(&mut self, command: Command<'t>) {
        assert!(matches!(self.haptics.accept(command), Ok(None)));
    }

    /// Zeroes the arm in its home pose and arms it there.
    fn arm(&mut self, counts: [i32; 3]) {
        self.send(Command::Zero([0; 3]));
        self.send(Command::Arm);
        self.dead_man = false;
        let _ = self.tick(counts);
        self.dead_man = true;
        for _ in 0..2_200 {
            let _ = self.tick(counts);
        }
        assert_eq!(self.haptics.report().mode, Mode::Armed);
    }

    /// Runs a tick, then delivers every requested tile.
    fn tick(&mut self, counts: [i32; 3]) -> Outcome {
        let sense = GuardInputs {
            counts,
            dead_man: self.dead_man,
            ..GuardInputs::default()
        };
        let outcome = self.haptics.tick(&sense, true);
        self.hint = RequestHint {
            missing_tile: outcome.sample.missing_tile,
            proxy: outcome.sample.proxy.column(),
            hip: outcome.sample.hip.column(),
            velocity: [0.0; 2],
        };
        while let Some(key) = self.next_request(outcome.sample.tick) {
            self.serve(key);
        }
        outcome
    }

    /// Returns the next tile to request; only those of the fallback while a placement waits.
    fn next_request(&mut self, now: u32) -> Option<TileKey> {
        let pending = self.haptics.pending.as_ref();
        match self.is_slow || pending.is_some_and(|change| !change.keeps_tiles) {
            true => self.requester.next_of_fallback(now, &self.hint),
            false => self.requester.next_request(now, &self.hint),
        }
    }

    fn serve(&mut self, key: TileKey) {
        if self.spare.is_empty() {
            self.spare.extend(self.haptics.take_spare());
        }
        let tile = self.spare.pop().expect("as many spares as requests");
        match self.coarse(key) {
            Some(CoarseTile { first, shift }) => {
                let at = |of: i32, n: usize| of + ((n as i32) << shift);
                let height = |col, row| {
                    self.fallback_rise + (self.height)(at(first.x, col), at(first.y, row))
                };
                tile.fill(key, 0, height).unwrap();
            }
            None => tile.fill_from(key, 0, self.size, self.height).unwrap(),
        }
        let first = key.index.first_cell();
        let materials = (0..TILE_SAMPLES * TILE_SAMPLES).map(|i| {
            let (col, row) = ((i % TILE_SAMPLES) as i32, (i / TILE_SAMPLES) as i32);
            (self.material)(key, [first.x + col, first.y + row])
        });
        if let Some(materials) = materials.collect::<Option<Vec<_>>>() {
            tile.set_materials(4, materials).expect("of the table");
        }
        self.requester.received(key);
        let spent = self.haptics.accept(Command::Tile(tile)).expect("taken");
        let mut free = spent;
        while let Some(spent) = free {
            assert_ne!(
                spent.key(),
                Some(key),
                "the window refused what it had requested"
            );
            self.spare.push(spent);
            free = self.haptics.take_spare();
        }
        self.served += 1;
    }

    /// Returns the fallback's tile with this key, if any.
    fn coarse(&self, key: TileKey) -> Option<CoarseTile> {
        let (fallback, level) = self.fallback?;
        let mut parts = [Some(fallback.wide), fallback.near].into_iter().flatten();
        parts.find(|part| part.key(level) == key)
    }

    /// Renders one point, in as many ticks as needed.
    fn step(&mut self, seq: u32, hip: GridPoint) -> TickRecord {
        assert!(
            self.haptics
                .accept(Command::Hip(HipCommand { seq, hip }))
                .is_ok_and(|spare| spare.is_none())
        );
        for _ in 0..20_000 {
            let outcome = self.tick([0; 3]);
            assert_eq!(
                outcome.drive,
                GuardOutputs::default(),
                "replay drives no motor"
            );
            if outcome.answered_seq == Some(seq) {
                return outcome.sample;
            }
        }
        panic!("point {seq} at {hip:?} is never answered");
    }
}

fn plane(_: i32, _: i32) -> f32 {
    5.5
}

fn hills(x: i32, y: i32) -> f32 {
    let (x, y) = (f64::from(x), f64::from(y));
    (8.0 * (x * 0.11).sin() * (y * 0.07).cos() + (x * 1.3).sin()) as f32
}

/// Moves above the plane and back into it. Home is half a millimetre below the plane; 64 counts of
/// the second axis are 1.8 mm.
fn dip() -> impl Iterator<Item = [i32; 3]> {
    let rise = (0..=64).map(|n| [0, n, 0]);
    rise.chain((0..=64).map(|n| [0, 64 - n, 0]))
}

#[test]
fn motors_push_back_when_pressed_on_a_plane() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::armed(&mut tiles, plane);
    let outcomes: Vec<_> = dip().map(|c| device.tick(c)).collect();
    assert_eq!(outcomes[64].sample.state, ContactState::Free);
    // τ2 = G2·cos q2; I = τ/(11.2 · 0.0234 Nm/A): the weight alone.
    let weight_a = -0.0163 / (11.2 * 0.0234);
    assert!((outcomes[64].drive.currents_a - Vec3::Y * weight_a).length() < 1e-4);
    let last = outcomes.last().unwrap();
    assert_eq!(last.sample.state, ContactState::Touching);
    assert!((last.sample.force_n - Vec3::new(0.0, 0.0, 0.25)).length() < 1e-4);
    // τ2 = l1·F = 209.55 mm · 0.25 N
    let pushed_a = 0.209_55 * 0.25 / (11.2 * 0.0234);
    let currents = last.drive.currents_a;
    assert!((currents - Vec3::Y * (pushed_a + weight_a)).length() < 1e-3);
    assert!(last.drive.enabled);
}

/// A device whose proxy is on the plane, in the tile (10, 10).
fn dipped(tiles: &mut [Tile]) -> Device<'_, 3> {
    let mut device = Device::<3>::armed(tiles, plane);
    for counts in dip() {
        let _ = device.tick(counts);
    }
    device
}

#[test]
fn late_tile_does_not_evict_tile_beside_proxy() {
    let mut tiles = buffers::<3>();
    let mut device = dipped(&mut tiles);
    let size = device.size;
    let fill = |tile: &mut Tile, key| {
        tile.fill_from(key, 0, size, plane).expect("in range");
    };
    // The tile to the west of the proxy's is also stored.
    let beside = TileKey::new(0, 9, 10);
    assert_eq!(device.haptics.window.occupant(beside), Some(beside));
    let late = TileKey::new(0, 12, 10);
    assert_eq!(device.haptics.window.occupant(late), Some(beside));
    let tile = device.spare.pop().expect("a spare one");
    fill(tile, late);
    let back = device.haptics.accept(Command::Tile(tile));
    let back = back.expect("taken").expect("refused");
    assert_eq!(back.key(), Some(late));
    device.spare.push(back);
    // The same tile is accepted again, and so is one that replaces a distant one.
    for key in [beside, TileKey::new(0, 11, 10)] {
        let tile = device.spare.pop().expect("a spare one");
        fill(tile, key);
        let back = device
            .haptics
            .accept(Command::Tile(tile))
            .expect("taken")
            .expect("a buffer");
        assert_ne!(back.key(), Some(key));
        assert_eq!(device.haptics.window.occupant(key), Some(key));
        device.spare.push(back);
    }
}

#[test]
fn late_fallback_is_accepted_and_evicts_no_tile_beside_proxy() {
    let mut tiles = buffers::<3>();
    let mut device = dipped(&mut tiles);
    let of = |shift| CoarseTile {
        first: Cell::new(256, 256),
        shift,
    };
    let fallback = Fallback {
        wide: of(4),
        near: Some(of(2)),
    };
    // The indices of the fallback's tiles match the slot of this tile, beside the proxy's.
    let beside = TileKey::new(0, 9, 9);
    assert_eq!(
        device.haptics.window.occupant(TileKey::new(0, 0, 0)),
        Some(beside)
    );
    device.haptics.window.set_fallback(Some(fallback));
    for key in fallback.keys(0).into_iter().flatten() {
        let tile = device.spare.pop().expect("a spare one");
        tile.fill(key, 0, |_, _| 0.0).expect("in range");
        assert!(matches!(
            device.haptics.accept(Command::Tile(tile)),
            Ok(None)
        ));
    }
    assert_eq!(
        device.haptics.window.occupant(TileKey::new(0, 0, 0)),
        Some(beside)
    );
    assert!(device.haptics.window.is_blended(Cell::new(290, 290)));
}

#[test]
fn disarmed_arm_has_no_force() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::new(&mut tiles, Source::Encoders, plane);
    let last = dip().map(|c| device.tick(c)).last().unwrap();
    assert_eq!(
        last.sample.state,
        ContactState::Touching,
        "the contact is there"
    );
    assert_eq!(last.sample.force_n, Vec3::ZERO);
    assert_eq!(last.drive, GuardOutputs::default());
}

#[test]
fn gravity_currents_follow_signs_of_the_calibration() {
    for (encoder_sign, motor_sign) in [(Vec3::ONE, Vec3::ONE), (-Vec3::ONE, -Vec3::Z + Vec3::Y)] {
        let record = Calibration {
            encoder_sign,
            motor_sign: Vec3::new(1.0, motor_sign.y, motor_sign.z),
            ..Calibration::PREMIUM_1_5
        };
        let mechanism = Kinematics::new(&record).expect("valid");
        let pose = Pose::from_angles(&record, Vec3::new(0.1, 0.4, 0.3));
        let currents = mechanism.currents_a(mechanism.gravity_nm(&pose));
        let per_ampere = 11.2 * 0.0234;
        let expected = Vec3::new(
            0.0,
            record.motor_sign.y * -0.0163 * 0.4f32.cos() / per_ampere,
            record.motor_sign.z * -0.0738 * 0.3f32.sin() / per_ampere,
        );
        assert!((currents - expected).length() < 1e-5);
    }
}

#[test]
fn start_inside_the_terrain_gives_no_force() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::armed(&mut tiles, plane);
    for _ in 0..50 {
        let outcome = device.tick([0; 3]);
        assert_eq!(outcome.sample.state, ContactState::Unseeded);
        assert_eq!(outcome.sample.force_n, Vec3::ZERO);
    }
}

#[test]
fn fault_latches_until_cleared_and_encoder_jump_needs_new_zero() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::armed(&mut tiles, plane);
    assert!(device.tick([0; 3]).drive.enabled);
    let outcome = device.tick([5000, 0, 0]);
    assert_eq!(outcome.drive, GuardOutputs::default());
    assert_eq!(outcome.sample.fault, Some(Fault::EncoderJump));
    for _ in 0..3 {
        assert_eq!(device.tick([5000, 0, 0]).drive, GuardOutputs::default());
    }
    // Clears only the fault that was seen.
    device.send(Command::ClearFault(Some(Fault::Hardware)));
    assert_eq!(
        device.tick([5000, 0, 0]).sample.fault,
        Some(Fault::EncoderJump)
    );
    device.send(Command::ClearFault(Some(Fault::EncoderJump)));
    let outcome = device.tick([0; 3]);
    assert_eq!((outcome.sample.fault, outcome.drive.enabled), (None, false));
    let blockers = device.haptics.report().blockers;
    assert!(blockers.contains(Blockers::NOT_ZEROED), "{blockers:?}");
    device.arm([0; 3]);
    assert!(device.tick([0; 3]).drive.enabled);
}

/// Pressed into the plane, with force, armed.
fn pressed(tiles: &mut [Tile]) -> (Device<'_, 4>, Vec3) {
    let mut device = Device::<4>::armed(tiles, plane);
    let last = dip().map(|c| device.tick(c)).last().unwrap();
    (device, last.sample.force_n)
}

/// Safety: 25.
#[test]
fn force_ramps_down_without_step_on_scene_change_or_disarm() {
    let other = Scene {
        epoch: 2,
        ..scene(Source::Encoders)
    };
    for command in [Command::DropScene, Command::Scene(other), Command::Disarm] {
        let mut tiles = buffers::<4>();
        let (mut device, mut last) = pressed(&mut tiles);
        assert!(last.z > 0.2);
        device.send(command);
        let mut ticks = 0;
        loop {
            let outcome = device.tick([0; 3]);
            let step = (outcome.sample.force_n - last).length();
            assert!(step < 0.01, "{step} N");
            last = outcome.sample.force_n;
            if !outcome.drive.enabled {
                break;
            }
            ticks += 1;
        }
        assert!((90..=101).contains(&ticks), "{ticks}");
        assert_eq!((last, device.haptics.report().fault), (Vec3::ZERO, None));
    }
}

#[test]
fn settings_zero_or_replay_switch_off_at_once() {
    let points = Scene {
        epoch: 2,
        ..scene(Source::Points)
    };
    for command in [Command::Zero([7, 7, 7]), Command::Scene(points)] {
        let mut tiles = buffers::<4>();
        let (mut device, _) = pressed(&mut tiles);
        device.send(command);
        assert_eq!(device.tick([0; 3]).drive, GuardOutputs::default());
    }
    let mut tiles = buffers::<4>();
    let (mut device, _) = pressed(&mut tiles);
    let mechanism = Kinematics::new(&Calibration::PREMIUM_1_0).expect("valid");
    device.haptics.configure(mechanism);
    assert_eq!(device.tick([0; 3]).drive, GuardOutputs::default());
    let model = device.haptics.calibration().map(|c| c.model);
    assert_eq!(model, Some(crate::phantom::Model::Premium10));
}

/// A device in a replay, with an arm at `counts` that was zeroed before.
fn replaying(tiles: &mut [Tile]) -> Device<'_, 4> {
    let mut device = Device::<4>::armed(tiles, plane);
    let points = Scene {
        epoch: 2,
        ..scene(Source::Points)
    };
    device.send(Command::Scene(points));
    device
}

/// Moves the arm by 100 counts a tick, with an active point in every other tick.
fn wave(device: &mut Device<'_, 4>, ticks: i32) -> [i32; 3] {
    let mut counts = [0; 3];
    for n in 0..ticks {
        counts = [100 * n, -100 * n, 0];
        if n % 2 == 0 {
            let hip = GridPoint::new([100, 100, 2], Vec3::splat(0.5));
            let seq = n.unsigned_abs();
            device.send(Command::Hip(HipCommand { seq, hip }));
            assert_eq!(device.tick(counts).drive, GuardOutputs::default());
        } else {
            let sense = GuardInputs {
                counts,
                dead_man: true,
                ..GuardInputs::default()
            };
            device.haptics.monitor(&sense, true);
        }
    }
    counts
}

/// Safety: 35, images.
#[test]
fn arm_moved_during_a_replay_keeps_its_zero() {
    let mut tiles = buffers::<4>();
    let mut device = replaying(&mut tiles);
    let counts = wave(&mut device, 60);
    device.send(Command::Scene(Scene {
        epoch: 3,
        ..scene(Source::Encoders)
    }));
    let _ = device.tick(counts);
    assert_eq!(device.haptics.report().fault, None);
    assert_eq!(device.haptics.zero, Some([0; 3]));
}

/// Safety: 35, images.
#[test]
fn encoder_jump_during_a_replay_is_detected() {
    let mut tiles = buffers::<4>();
    for with_a_point in [false, true] {
        let mut device = replaying(&mut tiles);
        let mut counts = wave(&mut device, 20);
        assert_eq!(device.haptics.report().fault, None);
        counts[2] += 129;
        if with_a_point {
            let _ = device.tick(counts);
        } else {
            device.haptics.monitor(
                &GuardInputs {
                    counts,
                    ..GuardInputs::default()
                },
                true,
            );
        }
        assert_eq!(device.haptics.report().fault, Some(Fault::EncoderJump));
        assert_eq!(device.haptics.zero, None);
    }
}

/// Safety: 35.
#[test]
fn replay_drives_no_motor_and_refuses_arming_with_its_blocker() {
    let mut tiles = buffers::<4>();
    let mut device = replaying(&mut tiles);
    device.send(Command::Arm);
    device.dead_man = false;
    wave(&mut device, 60);
    device.dead_man = true;
    let hip = GridPoint::new([100, 100, 2], Vec3::splat(0.5));
    device.send(Command::Hip(HipCommand { seq: 100, hip }));
    for _ in 0..200 {
        assert_eq!(
            device.tick([5_900, -5_900, 0]).drive,
            GuardOutputs::default()
        );
    }
    let report = device.haptics.report();
    assert_eq!(report.mode, Mode::Disarmed);
    assert!(
        report.decision.refused.contains(Blockers::REPLAY),
        "{report:?}"
    );
}

#[test]
fn missing_calibration_prevents_rendering_and_arming() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::new(&mut tiles, Source::Encoders, plane);
    device.haptics.mechanism = None;
    device.send(Command::Zero([0; 3]));
    device.send(Command::Arm);
    for tick in 0..3_000 {
        device.dead_man = tick > 10;
        let outcome = device.tick([0; 3]);
        assert_eq!(
            (outcome.drive, outcome.sample.state),
            (GuardOutputs::default(), ContactState::Unseeded)
        );
    }
    let report = device.haptics.report();
    assert_eq!(report.decision.refused, Blockers::NO_CALIBRATION);
}

#[test]
fn invalid_scene_is_refused() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::armed(&mut tiles, plane);
    let good = scene(Source::Encoders);
    let bad = [
        Scene {
            size: FieldSize::new(0, 5),
            ..good
        },
        Scene {
            cell_mm: f32::NAN,
            ..good
        },
        Scene {
            cell_mm: 0.0,
            ..good
        },
        Scene {
            top: i32::MAX,
            ..good
        },
    ];
    for scene in bad {
        assert!(!scene.is_valid());
        let answer = device.haptics.accept(Command::Scene(scene));
        assert_eq!(answer.err(), Some(RefusedScene));
    }
    assert_eq!(device.haptics.report().mode, Mode::Fading);
}

/// The window's size, the order of the tiles' arrival, and ticks that run out of work must not
/// change the force.
#[test]
fn force_is_independent_of_window_size() {
    let mut tiles = buffers::<4>();
    let mut small = Device::<4>::new(&mut tiles, Source::Points, hills);
    let mut more_tiles = buffers::<32>();
    let mut large = Device::<32>::new(&mut more_tiles, Source::Points, hills);
    let mut dice = 12345_u32;
    let mut random = |range: u32| {
        dice ^= dice << 13;
        dice ^= dice >> 17;
        dice ^= dice << 5;
        dice % range
    };
    let (mut touched, mut at) = (0, [100, 100]);
    const POINTS: u32 = cases(400, 12);
    for seq in 0..POINTS {
        // Never farther than half of the small window.
        let jump = if seq % 4 == 0 { 64 } else { 20 };
        at = at.map(|x| (x + random(2 * jump) as i32 - jump as i32).clamp(20, 620));
        let cell = [at[0], at[1], random(24) as i32 - 12];
        let hip = GridPoint::new(cell, Vec3::splat(random(1000) as f32 / 1000.0));
        let (a, b) = (small.step(seq, hip), large.step(seq, hip));
        let same = TickRecord {
            tick: a.tick,
            work: a.work,
            ..b
        };
        assert_eq!(a, same, "point {seq} at {hip:?}");
        touched += u32::from(a.state == ContactState::Touching);
    }
    assert!(touched > POINTS / 8, "{touched}");
    assert!(
        small.served > large.served,
        "the small window had to fetch again"
    );
}

#[test]
fn force_fades_past_edge_of_data_and_reports_the_limit() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::armed(&mut tiles, edge);
    // Home is 20 cells from the edge; a count of the first axis is 24 µm.
    for counts in dip() {
        let _ = device.tick(counts);
    }
    let mut fading = Vec::new();
    let mut last = Vec3::ZERO;
    for n in 0..2_000 {
        let outcome = device.tick([n, 0, 0]);
        let sample = &outcome.sample;
        if sample.limits.contains(Limits::EDGE_FADING) {
            fading.push(sample.force_n.length());
        }
        assert!((sample.force_n - last).length() < 0.02 || n < 2);
        last = sample.force_n;
    }
    assert!(fading.len() > 10, "{}", fading.len());
    assert!(fading.first() > fading.last());
    assert_eq!(last, Vec3::ZERO);
}

/// A plane that ends 20 cells east of the middle.
fn edge(x: i32, _: i32) -> f32 {
    if x > 340 { f32::NAN } else { 5.5 }
}

/// The link checks sums, not meanings: a damaged host may send any bits.
#[test]
fn point_of_any_bits_is_normalised_before_the_contact() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::new(&mut tiles, Source::Points, plane);
    // Cell (i32::MIN, 100, 9) as zigzag varints, then three fractions.
    let mut bytes = std::vec![0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0xC8, 0x01, 0x12];
    for frac in [f32::NAN, -7.5, f32::INFINITY] {
        bytes.extend(frac.to_le_bytes());
    }
    let hip: GridPoint = postcard::from_bytes(&bytes).expect("nine numbers");
    assert!(!hip.frac().is_finite());
    let sample = device.step(1, hip);
    assert_eq!(sample.hip.cell(), [-MAX_CELL, 92, MAX_CELL]);
    assert_eq!(sample.hip.frac(), Vec3::new(0.0, 0.5, 0.0));
    assert_eq!(sample.force_n, Vec3::ZERO);
}

#[test]
fn held_outputs_reach_drive_only_with_amplifiers_off() {
    let mut tiles = buffers::<4>();
    let mut device = Device::<4>::new(&mut tiles, Source::Encoders, plane);
    let held = Vec3::new(0.5, -0.5, 0.1);
    device.send(Command::HoldOutputs(Some(held.to_array())));
    let expected = GuardOutputs {
        held,
        ..GuardOutputs::default()
    };
    assert_eq!(device.tick([0; 3]).drive, expected);
    device.arm([0; 3]);
    device.send(Command::HoldOutputs(Some(held.to_array())));
    let drive = device.tick([0; 3]).drive;
    assert!(drive.enabled);
    assert_eq!(drive.held, Vec3::ZERO);
}

/// Safety: 7.
#[test]
fn refused_scene_fades_the_force_out() {
    let mut tiles = buffers::<1>();
    let mut device = Device::<1>::armed(&mut tiles, |_, _| 0.0);
    let refused = Scene {
        cell_mm: 0.0,
        ..scene(Source::Encoders)
    };
    let answer = device.haptics.accept(Command::Scene(refused));
    assert_eq!(answer.err(), Some(RefusedScene));
    assert_eq!(device.haptics.source(), HipSource::None);
    assert_eq!(device.haptics.report().mode, Mode::Fading);
    for _ in 0..101 {
        let _ = device.tick([0; 3]);
    }
    assert_eq!(device.haptics.report().mode, Mode::Disarmed);
    device.send(Command::Arm);
    for _ in 0..100 {
        let _ = device.tick([0; 3]);
    }
    let refused = device.haptics.report().decision.refused;
    assert!(refused.contains(Blockers::NO_SCENE), "{refused:?}");
}
