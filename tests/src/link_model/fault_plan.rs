//! Plan of the faults of a run.

use super::lossy_line::{Direction, Harm};
use crate::random::Random;

/// Interruption of one of the two ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interruption {
    /// The host's program is killed and started again.
    HostKilled,
    /// The device is reset.
    DeviceReset,
    /// For so many ticks nothing gets through one way.
    Cut(Direction, u64),
    /// All frames of one direction so far arrive again: of this session, and of those before.
    Echo(Direction),
    /// A host of another version says hello on the same line.
    OtherHost,
    /// Another host of this version opens a session on the same line, and ends it.
    Takeover,
    /// From now on the device says that it is of another version.
    OtherDevice,
    /// The host's program is killed, and no other is started.
    HostGone,
}

/// Everything that goes wrong in a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plan {
    /// Harm to single frames, by their number in their direction.
    pub harms: Vec<(Direction, usize, Harm)>,
    /// Interruptions by tick.
    pub interruptions: Vec<(u64, Interruption)>,
    /// The host leaves while the arm is armed, without a request to disarm before.
    pub abrupt: bool,
    /// The host asks for the status without a pause while it feels and disarms.
    pub curious: bool,
    /// The host puts another view in while it feels, and asks for more than that when the arm
    /// is disarmed.
    pub errands: bool,
    /// Harm at random: the seed, and the share of frames in a thousand.
    pub random: Option<(u64, usize)>,
}

impl Plan {
    /// A plan drawn from a seed.
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
