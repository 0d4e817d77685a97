//! What a kind of mishap does to a tick.

use hapterra_core::contact::Rule;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::Sense;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Point;
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice};

use super::arm::Mood;
use super::clock::Reading;
use super::host::Tiles;
use super::kind::Kind;
use super::pipe::Unkind;
use crate::chance::Chance;

/// The contact rule of all scenes.
pub const RULE: Rule = Rule::Swept;

/// One mishap under way.
#[derive(Clone, Debug)]
pub struct Mishap {
    /// What it is.
    pub kind: Kind,
    /// Its first tick, and the one past its last.
    pub ticks: std::ops::Range<u64>,
    axis: usize,
    sign: i32,
    size: f64,
    by_mm: [f64; 3],
    /// What a stuck encoder reads.
    held: Option<i32>,
}

impl Mishap {
    /// One of a kind that begins at `now`.
    #[must_use]
    pub fn of(kind: Kind, now: u64, chance: &mut Chance) -> Self {
        let (shortest, longest) = kind.duration();
        let ticks = shortest + chance.below((longest - shortest) as usize + 1) as u32;
        let side = |chance: &mut Chance| chance.between(-120.0, 120.0);
        Self {
            kind,
            ticks: now..now + u64::from(ticks),
            axis: chance.below(3),
            sign: if chance.below(2) == 0 { 1 } else { -1 },
            size: chance.between(0.0, 1.0),
            by_mm: [side(chance), side(chance), chance.between(0.0, 80.0)],
            held: None,
        }
    }

    /// Changes what encoders and switches say. `lost` are counts that the
    /// encoders are off by for good.
    pub fn meddle(
        &mut self,
        sense: &mut Sense,
        lost: &mut [i32; 3],
        now: u64,
        chance: &mut Chance,
    ) {
        let far = self.sign * (130 + (5_000.0 * self.size) as i32);
        let since = (now - self.ticks.start + 1) as i32;
        let counts = &mut sense.counts;
        match self.kind {
            Kind::EncoderJump => {
                lost[self.axis] += far;
                counts[self.axis] += far;
            }
            Kind::EncoderGlitch => counts[self.axis] += far,
            Kind::EncoderNoise => {
                for count in counts {
                    *count += chance.below(5) as i32 - 2;
                }
            }
            Kind::EncoderStuck => {
                counts[self.axis] = *self.held.get_or_insert(counts[self.axis]);
            }
            // Within what a tick may move, above what a tip may do.
            Kind::EncoderRunaway => counts[self.axis] += self.sign * 110 * since,
            Kind::EncoderBeyondLimits => counts[self.axis] += self.sign * 12 * since,
            Kind::EmergencyStop => sense.emergency_stop = true,
            Kind::DeadManReleased | Kind::DeadManBounce => sense.dead_man = false,
            Kind::HardwareFailed => sense.hardware_failed = true,
            _ => {}
        }
    }

    /// What it does to the link.
    #[must_use]
    pub fn unkind(&self) -> Unkind {
        let none = Unkind::default();
        let share = 0.02 + 0.4 * self.size;
        match self.kind {
            Kind::LinkLoss => Unkind {
                lost: share,
                ..none
            },
            Kind::LinkDelay => Unkind {
                late: 20 + (380.0 * self.size) as u32,
                ..none
            },
            Kind::LinkDuplicates => Unkind {
                twice: share,
                ..none
            },
            Kind::LinkCorruption => Unkind {
                flipped: share,
                ..none
            },
            Kind::LinkSilence => Unkind { cut: true, ..none },
            _ => none,
        }
    }

    /// What it does to tiles.
    #[must_use]
    pub fn tiles(&self) -> Tiles {
        match self.kind {
            Kind::TilesMissing => Tiles::Withheld,
            Kind::TilesPoisoned => Tiles::Poisoned,
            _ => Tiles::Sent,
        }
    }

    /// What it does to the clock.
    #[must_use]
    pub fn reading(&self) -> Reading {
        match self.kind {
            Kind::TickOverrun => Reading {
                since_due: 0,
                overrun: true,
            },
            Kind::LateTicks => Reading {
                since_due: 11 + (900.0 * self.size) as u32,
                overrun: false,
            },
            _ => Reading::default(),
        }
    }

    /// Whether the link's task hangs.
    #[must_use]
    pub fn stalls(&self) -> bool {
        self.kind == Kind::TaskStalled
    }

    /// Whether the device is told at `now` that its transport was interrupted, as
    /// USB tells it; a silent line tells nothing.
    #[must_use]
    pub fn unplugs(&self, now: u64) -> bool {
        self.kind == Kind::LinkSilence && self.sign > 0 && now == self.ticks.start
    }

    /// What it does to the hand.
    #[must_use]
    pub fn mood(&self) -> Mood {
        match self.kind {
            Kind::HotMotors => Mood::Presses,
            Kind::Yank => Mood::Yanked(self.by_mm),
            _ => Mood::Wanders,
        }
    }

    /// A message that the host had better not send.
    #[must_use]
    pub fn misplaced<'b>(&self, chance: &mut Chance, epoch: u32) -> Option<ToDevice<'b>> {
        if self.kind != Kind::Misplaced || chance.below(4) != 0 {
            return None;
        }
        let mut calibration = Calibration::PREMIUM_1_5;
        calibration.l1_mm *= 0.5;
        calibration.motor_sign = -calibration.motor_sign;
        Some(match chance.below(6) {
            0 => ToDevice::SetCalibration {
                calibration,
                store: chance.below(2) == 0,
            },
            1 => ToDevice::Zero {
                counts: [1_000, -2_000, 3_000],
            },
            2 => ToDevice::Point(Point {
                seq: 1,
                hip: GridPoint::default(),
            }),
            3 => ToDevice::Tile(TileMessage {
                epoch: epoch.wrapping_add(chance.below(2) as u32),
                key: hapterra_core::terrain::TileKey::new(
                    0,
                    chance.below(20) as i32,
                    chance.below(20) as i32,
                ),
                heights: Heights::Flat {
                    base: 1_000,
                    height: 0.0,
                },
            }),
            4 => ToDevice::GetCalibration,
            _ => ToDevice::Status,
        })
    }
}
