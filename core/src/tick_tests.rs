//! The tick as a whole: arm to currents, and replay through a pulled window.

use std::boxed::Box;
use std::vec::Vec;

use super::*;
use crate::contact::{Rule, State};
use crate::force::ForceLaw;
use crate::terrain::{Focus, Puller, TILE_CELLS};

const SIZE: i32 = 640;

fn scene(source: Source) -> Scene {
    Scene {
        epoch: 1,
        level: 0,
        size: [SIZE, SIZE],
        top: 1 << 20,
        cell_mm: 1.0,
        home: GridPoint::new([320, 320, 5], Vec3::ZERO),
        law: ForceLaw::PREMIUM,
        rule: Rule::Swept,
        source,
        hold_clock: false,
    }
}

/// A device in memory: the loop, its puller, and a host that always answers.
struct Device<const D: usize> {
    haptics: Haptics<'static, D>,
    puller: Puller<D>,
    spare: Vec<&'static mut Tile>,
    height: fn(i32, i32) -> f32,
    focus: Focus,
    served: usize,
}

impl<const D: usize> Device<D> {
    fn new(source: Source, height: fn(i32, i32) -> f32) -> Self {
        let tile = || -> &'static mut Tile { Box::leak(Box::new(Tile::VACANT)) };
        let tiles = core::array::from_fn(|_| core::array::from_fn(|_| tile()));
        let mut haptics = Haptics::new(tiles, Calibration::PREMIUM_1_5);
        let scene = scene(source);
        assert!(haptics.accept(Command::Scene(scene)).is_none());
        let mut puller = Puller::new();
        puller.reset(scene.level, scene.size);
        Self {
            haptics,
            puller,
            spare: (0..4).map(|_| tile()).collect(),
            height,
            focus: Focus::default(),
            served: 0,
        }
    }

    /// One tick, then every tile that is wanted.
    fn tick(&mut self, counts: [i32; 3]) -> Outcome {
        let outcome = self.haptics.tick(counts);
        self.focus = Focus {
            held_up_by: outcome.sample.held_up_by,
            proxy: outcome.sample.proxy.column(),
            hip: outcome.sample.hip.column(),
            velocity: [0.0; 2],
        };
        while let Some(key) = self.puller.next_request(outcome.sample.tick, &self.focus) {
            self.serve(key);
        }
        outcome
    }

    fn serve(&mut self, key: TileKey) {
        let tile = self.spare.pop().expect("as many spares as requests");
        let (west, south) = (key.col * TILE_CELLS as i32, key.row * TILE_CELLS as i32);
        let height = self.height;
        tile.fill(key, 0, |col, row| {
            height(west + col as i32, south + row as i32)
        })
        .unwrap();
        self.puller.received(key);
        let spent = self.haptics.accept(Command::Tile(tile)).unwrap();
        assert_ne!(
            spent.key(),
            Some(key),
            "the window refused what it had asked for"
        );
        self.spare.push(spent);
        self.served += 1;
    }

    /// Feels one point, however many ticks that takes.
    fn feel(&mut self, seq: u32, hip: GridPoint) -> Sample {
        assert!(
            self.haptics
                .accept(Command::Point(Point { seq, hip }))
                .is_none()
        );
        for _ in 0..20_000 {
            let outcome = self.tick([0; 3]);
            assert_eq!(outcome.drive, Drive::default(), "replay drives no motor");
            if outcome.answers == Some(seq) {
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

#[test]
fn pressed_on_a_plane_the_motors_push_back() {
    let mut device = Device::<4>::new(Source::Encoders, plane);
    // Rise above the plane first: 64 counts of the second axis are 1.8 mm.
    let rise = (0..=64).map(|n| [0, n, 0]);
    let fall = (0..=64).map(|n| [0, 64 - n, 0]);
    let outcomes: Vec<_> = rise.chain(fall).map(|c| device.tick(c)).collect();
    assert_eq!(outcomes[64].sample.state, State::Free);
    assert_eq!(outcomes[64].drive.currents_a, Vec3::ZERO);
    let last = outcomes.last().unwrap();
    assert_eq!(last.sample.state, State::Touching);
    // Home is half a cell, so half a millimetre, below the plane.
    assert!((last.sample.force_n - Vec3::new(0.0, 0.0, 0.25)).length() < 1e-4);
    // τ2 = l1·F = 209.55 mm · 0.25 N; I = τ/(11.2 · 0.0234 Nm/A)
    assert!(
        (last.drive.currents_a.y - 0.199_9).abs() < 1e-3,
        "{:?}",
        last.drive
    );
    assert!(last.drive.enabled);
}

#[test]
fn begun_inside_the_terrain_there_is_no_force() {
    let mut device = Device::<4>::new(Source::Encoders, plane);
    for _ in 0..50 {
        let outcome = device.tick([0; 3]);
        assert_eq!(outcome.sample.state, State::Waiting);
        assert_eq!(outcome.drive.currents_a, Vec3::ZERO);
    }
}

#[test]
fn a_fault_is_latched_until_cleared() {
    let mut device = Device::<4>::new(Source::Encoders, plane);
    let _ = device.tick([0; 3]);
    let outcome = device.tick([5000, 0, 0]);
    assert_eq!(outcome.sample.fault, Some(Fault::EncoderJump));
    for _ in 0..3 {
        assert_eq!(device.tick([5000, 0, 0]).drive, Drive::default());
    }
    assert!(device.haptics.accept(Command::ClearFault).is_none());
    assert!(device.tick([5000, 0, 0]).drive.enabled);
}

#[test]
fn a_scene_that_makes_no_sense_is_not_taken() {
    let mut device = Device::<4>::new(Source::Encoders, plane);
    let good = scene(Source::Encoders);
    let bad = [
        Scene {
            size: [0, 5],
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
        assert!(device.haptics.accept(Command::Scene(scene)).is_none());
    }
    assert!(
        device.tick([0; 3]).drive.enabled,
        "the old scene is still in force"
    );
}

/// The window's size, the order in which tiles arrive, and how often the work
/// of a tick ran out must not show in what is felt.
#[test]
fn a_small_window_feels_what_a_whole_one_feels() {
    let mut small = Device::<4>::new(Source::Points, hills);
    let mut large = Device::<32>::new(Source::Points, hills);
    let mut dice = 12345_u32;
    let mut random = |range: u32| {
        dice ^= dice << 13;
        dice ^= dice >> 17;
        dice ^= dice << 5;
        dice % range
    };
    let mut touched = 0;
    for seq in 0..400 {
        let jump = if seq % 4 == 0 { 600 } else { 20 };
        let cell = [
            20 + random(jump) as i32,
            20 + random(jump) as i32,
            random(24) as i32 - 12,
        ];
        let hip = GridPoint::new(cell, Vec3::splat(random(1000) as f32 / 1000.0));
        let (a, b) = (small.feel(seq, hip), large.feel(seq, hip));
        let same = Sample {
            tick: a.tick,
            work: a.work,
            ..b
        };
        assert_eq!(a, same, "point {seq} at {hip:?}");
        touched += u32::from(a.state == State::Touching);
    }
    assert!(touched > 50, "{touched}");
    assert!(
        small.served > large.served,
        "the small window had to fetch again"
    );
}
