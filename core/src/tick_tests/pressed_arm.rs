//! An armed arm whose hand presses into the ground, with checks of every tick.

use super::*;
use crate::scene::SceneChange;

/// Counts of the axes for a tip some 5 mm deep in the ground.
pub(super) const DEEP: [i32; 3] = [0, -170, 0];

/// An armed arm that presses into the ground.
pub(super) struct PressedArm<'t> {
    pub(super) device: Device<'t, 4>,
    pub(super) last: Outcome,
    pub(super) counts: [i32; 3],
    /// Tremor of the hand: its power of two, in counts. An arm without any motion for some seconds
    /// is a fault.
    pub(super) tremor: u32,
    /// Maximum change of the force in a tick, N.
    pub(super) max_n: f32,
}

impl<'t> PressedArm<'t> {
    /// Arms an arm, and presses it into the ground.
    pub(super) fn new(tiles: &'t mut [Tile], height: fn(i32, i32) -> f32, max_n: f32) -> Self {
        let mut device = Device::<4>::armed(tiles, height);
        let path = (0..=420).chain((DEEP[1]..420).rev());
        let last = path.map(|n| device.tick([0, n, 0])).last();
        Self {
            device,
            last: last.expect("ticks"),
            counts: DEEP,
            tremor: 0,
            max_n,
        }
    }

    /// Runs a tick: the arm stays armed, and the force makes no step.
    pub(super) fn tick(&mut self) -> TickRecord {
        let random = self.last.sample.tick.wrapping_mul(0x9E37_79B9);
        let tremor = ((u64::from(random) << self.tremor) >> 32) as i32;
        let counts = self.counts.map(|count| count >> self.tremor << self.tremor);
        self.counts = counts.map(|count| count | tremor);
        let now = self.device.tick(self.counts);
        let sample = now.sample;
        assert_eq!((sample.mode, sample.fault), (Mode::Armed, None));
        assert!(now.drive.enabled, "the arm stays armed");
        let change = (sample.force_n - self.last.sample.force_n).length();
        assert!(change <= self.max_n, "{change} N in a tick: {sample:?}");
        self.last = now;
        sample
    }

    pub(super) fn ticks(&mut self, count: usize) -> TickRecord {
        (0..count).fold(self.last.sample, |_, _| self.tick())
    }

    /// Moves the arm to `counts`.
    pub(super) fn move_to(&mut self, counts: [i32; 3], ticks: i32) -> TickRecord {
        let from = self.counts;
        for n in 1..=ticks {
            self.counts =
                [0, 1, 2].map(|axis| from[axis] + (counts[axis] - from[axis]) * n / ticks);
            self.tick();
        }
        self.last.sample
    }

    /// Sends a change of placement, whose tiles will be served from these heights.
    pub(super) fn change(&mut self, change: SceneChange, height: fn(i32, i32) -> f32) {
        let scene = change.scene;
        self.device.size = scene.size;
        self.device.height = height;
        self.device.fallback = scene.fallback.map(|fallback| (fallback, scene.level));
        if !change.keeps_tiles {
            self.device.requester.reset(scene.level, scene.size);
        }
        self.device.requester.set_fallback(scene.fallback);
        self.device.requester.clear_pending();
        self.send(Command::SceneChange(change));
    }

    /// Sends a command, and takes the buffers that have become free.
    pub(super) fn send(&mut self, command: Command<'t>) {
        let free = self.device.haptics.accept(command).expect("valid");
        self.device.spare.extend(free);
    }
}
