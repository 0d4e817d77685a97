//! Faults of the link, and their durations.

use super::cable::LineFaults;
use crate::random::Random;

/// Kind of a link fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Bits flip, in one byte of a million to one of a hundred.
    Flips,
    /// Transfers lose a run of bytes.
    Drops,
    /// Transfers are duplicated.
    Duplicates,
    /// Transfers are delayed.
    Delays,
    /// Both directions stop, then everything arrives at once.
    Stall,
    /// Nothing reaches the host.
    DeafHost,
    /// Nothing reaches the device.
    DeafDevice,
    /// Nothing arrives at either end.
    Cut,
    /// The host is killed and another one starts.
    HostKilled,
    /// The host is killed, and no other starts for a long time.
    HostVanishes,
    /// The device restarts.
    DeviceRestarted,
    /// Another program sends to the device: noise, floods, invalid messages.
    HostileHost,
    /// A program that is not a device answers the host.
    HostileDevice,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 13] = [
        Self::Flips,
        Self::Drops,
        Self::Duplicates,
        Self::Delays,
        Self::Stall,
        Self::DeafHost,
        Self::DeafDevice,
        Self::Cut,
        Self::HostKilled,
        Self::HostVanishes,
        Self::DeviceRestarted,
        Self::HostileHost,
        Self::HostileDevice,
    ];

    /// Returns its shortest and longest duration, ms.
    #[must_use]
    pub const fn duration(self) -> (usize, usize) {
        match self {
            Self::Flips | Self::Drops | Self::Duplicates | Self::Delays => (200, 6_000),
            Self::Stall | Self::DeafHost | Self::DeafDevice | Self::Cut => (20, 6_000),
            Self::HostileHost => (50, 2_000),
            Self::HostKilled | Self::HostVanishes | Self::DeviceRestarted | Self::HostileDevice => {
                (1, 1)
            }
        }
    }
}

/// A fault with its duration.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// Its kind.
    pub kind: Kind,
    /// The time at which it ends, ms.
    pub end: u64,
    share: f64,
    /// Directions that a fault of the bytes affects: to the device, to the host.
    directions: [bool; 2],
}

impl Fault {
    /// Draws a fault of a kind that begins at `now`, ms.
    #[must_use]
    pub fn of(kind: Kind, now: u64, random: &mut Random) -> Self {
        let (shortest, longest) = kind.duration();
        // Squared, so that short faults are more frequent.
        let segment = random.between(0.0, 1.0);
        let length = (longest - shortest) as f64 * segment * segment;
        Self {
            kind,
            end: now + shortest as u64 + length as u64,
            share: random.between(0.0, 1.0),
            directions: [[true, true], [true, false], [false, true]][random.below(3)],
        }
    }

    /// Returns its faults for the directions to the device and to the host.
    #[must_use]
    pub fn line_faults(&self) -> [LineFaults; 2] {
        let faults = match self.kind {
            Kind::Flips => LineFaults {
                flipped: libm::pow(10.0, -6.0 + 4.0 * self.share),
                ..LineFaults::NONE
            },
            Kind::Drops => LineFaults {
                dropped: 0.001 + 0.4 * self.share * self.share,
                ..LineFaults::NONE
            },
            Kind::Duplicates => LineFaults {
                twice: 0.02 + 0.98 * self.share,
                ..LineFaults::NONE
            },
            Kind::Delays => LineFaults {
                late: 5 + (400.0 * self.share) as u32,
                ..LineFaults::NONE
            },
            Kind::Stall => LineFaults {
                stalled: true,
                ..LineFaults::NONE
            },
            Kind::DeafHost | Kind::DeafDevice | Kind::Cut => LineFaults {
                cut: true,
                ..LineFaults::NONE
            },
            _ => LineFaults::NONE,
        };
        let directions = match self.kind {
            Kind::DeafHost => [false, true],
            Kind::DeafDevice => [true, false],
            Kind::Stall | Kind::Cut => [true, true],
            _ => self.directions,
        };
        directions.map(|is_faulty| if is_faulty { faults } else { LineFaults::NONE })
    }
}
