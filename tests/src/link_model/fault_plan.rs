//! Plan of the faults of a run.

use super::lossy_line::{Direction, FrameFault};
use crate::random::Random;

/// Interruption of one of the two ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interruption {
    /// The host's program is killed and started again.
    HostKilled,
    /// The device is reset.
    DeviceReset,
    /// Frames of one direction are lost for this many ticks.
    Cut(Direction, u64),
    /// All earlier frames of one direction arrive again, from this session and those before.
    Echo(Direction),
    /// A host of another version opens a session on the same line.
    OtherHost,
    /// Another host of this version opens a session on the same line, and closes it.
    Takeover,
    /// From now on the device reports another version.
    OtherDevice,
    /// The host's program is killed, and no other is started.
    HostGone,
}

/// All faults of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Faults of single frames, by their number in their direction.
    pub frame_faults: Vec<(Direction, usize, FrameFault)>,
    /// Interruptions by tick.
    pub interruptions: Vec<(u64, Interruption)>,
    /// The host leaves while the arm is armed, without a request to disarm.
    pub abrupt: bool,
    /// The host queries the status without a pause while it renders and disarms.
    pub queries_status: bool,
    /// The host changes the placement while it renders, and makes more requests when the arm is
    /// disarmed.
    pub requests: bool,
    /// Random faults: the seed, and the share of frames in a thousand.
    pub random: Option<(u64, usize)>,
}

impl Plan {
    /// Draws a plan from a seed.
    #[must_use]
    pub fn random(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let share = [5, 20, 80, 200][random.below(4)];
        let interruptions = (0..random.below(4)).map(|_| {
            let at = random.below(3_000) as u64;
            let long = 50 + random.below(6_000) as u64;
            let what = match random.below(4) {
                0 => Interruption::HostKilled,
                1 => Interruption::DeviceReset,
                2 => Interruption::Cut(Direction::ToDevice, long),
                _ => Interruption::Cut(Direction::ToHost, long),
            };
            (at, what)
        });
        Self {
            interruptions: interruptions.collect(),
            random: Some((random.bits(), share)),
            ..Self::default()
        }
    }
}
