//! Effects of injected faults on a tick.

use hapterra::phantom::AmplifierFault;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::GuardInputs;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::HipCommand;
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::ResetCause;

use super::arm::HandMotion;
use super::clock::Reading;
use super::fault_kind::{Kind, LOADED_TICKS};
use super::faulty_pipe::LinkDisturbance;
use super::host::Tiles;
use crate::random::Random;

/// State of the device's core in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// It runs.
    Runs,
    /// It is halted, and its outputs keep their values.
    Halted,
    /// It has no supply.
    Down,
    /// It starts after a reset.
    Resets(ResetCause),
}

/// An injected fault in progress.
#[derive(Clone, Debug)]
pub struct InjectedFault {
    /// Its kind.
    pub kind: Kind,
    /// Its ticks.
    pub ticks: std::ops::Range<u64>,
    axis: usize,
    sign: i32,
    size: f64,
    by_mm: [f64; 3],
    /// Reading of a stuck encoder, or the last reading of a runaway encoder.
    held: Option<i32>,
}

impl InjectedFault {
    /// Draws a fault of a kind that begins at `now`.
    #[must_use]
    pub fn of(kind: Kind, now: u64, random: &mut Random) -> Self {
        let (min_ticks, max_ticks) = kind.duration();
        let ticks = min_ticks + random.below((max_ticks - min_ticks) as usize + 1) as u32;
        let side = |random: &mut Random| random.between(-120.0, 120.0);
        Self {
            kind,
            ticks: now..now + u64::from(ticks),
            axis: random.below(3),
            sign: if random.below(2) == 0 { 1 } else { -1 },
            size: random.between(0.0, 1.0),
            by_mm: [side(random), side(random), random.between(0.0, 80.0)],
            held: None,
        }
    }

    /// Changes the readings of encoders and switches. `lost` are the encoders' permanent errors,
    /// counts.
    pub fn apply_to_inputs(
        &mut self,
        inputs: &mut GuardInputs,
        lost: &mut [i32; 3],
        now: u64,
        random: &mut Random,
    ) {
        let jump = self.sign * (130 + (5_000.0 * self.size) as i32);
        let elapsed_ticks = (now - self.ticks.start + 1) as i32;
        let counts = &mut inputs.counts;
        match self.kind {
            Kind::EncoderJump => {
                lost[self.axis] += jump;
                counts[self.axis] += jump;
            }
            Kind::EncoderGlitch => counts[self.axis] += jump,
            Kind::EncoderNoise => {
                for count in counts {
                    *count += random.below(5) as i32 - 2;
                }
            }
            Kind::EncoderStuck => {
                counts[self.axis] = *self.held.get_or_insert(counts[self.axis]);
            }
            // Below the limit for a tick, whatever the hand adds, but above a real tip's speed.
            Kind::EncoderRunaway => {
                let count = &mut counts[self.axis];
                let runaway = *count + self.sign * 110 * elapsed_ticks;
                *count = match self.held {
                    Some(last) => last + (runaway - last).clamp(-127, 127),
                    None => *count + self.sign * 60,
                };
                self.held = Some(*count);
            }
            Kind::EncoderBeyondLimits => counts[self.axis] += self.sign * 12 * elapsed_ticks,
            Kind::EmergencyStop => inputs.emergency_stop = true,
            Kind::Clutch => inputs.clutch = true,
            Kind::DeadManReleased | Kind::DeadManBounce => inputs.dead_man = false,
            Kind::HardwareFailed => inputs.hardware_failed = true,
            Kind::OutputsNotAsSet => inputs.outputs_not_as_set = true,
            Kind::CurrentMismatch => {
                let more_ma = self.sign as i16 * (1_500 + (4_000.0 * self.size) as i16);
                if let Some(of_axis) = inputs.measured_ma.as_mut().map(|all| &mut all[self.axis]) {
                    *of_axis = of_axis.saturating_add(more_ma);
                }
            }
            _ => {}
        }
    }

    /// Returns the amplifier's fault and its index.
    #[must_use]
    pub fn amplifier(&self) -> Option<(usize, AmplifierFault)> {
        let fault = match self.kind {
            Kind::AmplifierNotReady => AmplifierFault::Missing,
            Kind::MotorOpen => AmplifierFault::MotorOpen,
            _ => return None,
        };
        Some((self.axis, fault))
    }

    /// Returns its effect on the link.
    #[must_use]
    pub fn disturbance(&self) -> LinkDisturbance {
        let none = LinkDisturbance::default();
        let share = 0.02 + 0.4 * self.size;
        match self.kind {
            Kind::LinkLoss => LinkDisturbance {
                lost: share,
                ..none
            },
            Kind::LinkDelay => LinkDisturbance {
                late: 20 + (380.0 * self.size) as u32,
                ..none
            },
            Kind::LinkDuplicates => LinkDisturbance {
                twice: share,
                ..none
            },
            Kind::LinkCorruption => LinkDisturbance {
                flipped: share,
                ..none
            },
            Kind::LinkSilence => LinkDisturbance { cut: true, ..none },
            _ => none,
        }
    }

    /// Returns its effect on tiles.
    #[must_use]
    pub fn tiles(&self) -> Tiles {
        match self.kind {
            Kind::TilesMissing => Tiles::Withheld,
            Kind::TilesPoisoned => Tiles::Poisoned,
            _ => Tiles::Sent,
        }
    }

    /// Returns the clock's reading at `now`.
    #[must_use]
    pub fn reading(&self, now: u64) -> Reading {
        match self.kind {
            Kind::TickOverrun => Reading {
                overrun: true,
                ..Reading::default()
            },
            Kind::LateTicks => Reading {
                since_due: 11 + (900.0 * self.size) as u32,
                ..Reading::default()
            },
            Kind::CoreHaltedBriefly => Reading {
                missing: (now - self.ticks.start) as u32,
                ..Reading::default()
            },
            _ => Reading::default(),
        }
    }

    /// Returns true if the link's task hangs.
    #[must_use]
    pub fn stalls(&self) -> bool {
        self.kind == Kind::TaskStalled
    }

    /// Returns true if the device's transport is interrupted at `now`, as USB reports it; a silent
    /// line reports nothing.
    #[must_use]
    pub fn unplugs(&self, now: u64) -> bool {
        self.kind == Kind::LinkSilence && self.sign > 0 && now == self.ticks.start
    }

    /// Returns true if an endpoint is halted and cleared at `now`, which loses its transfer.
    #[must_use]
    pub fn halts_endpoint(&self, random: &mut Random) -> bool {
        self.kind == Kind::EndpointHalt && random.below(20) == 0
    }

    /// Returns the core's state at `now`.
    #[must_use]
    pub fn core(&self, now: u64) -> Core {
        let is_last = now + 1 == self.ticks.end;
        match self.kind {
            Kind::HaltedCore if is_last => Core::Resets(ResetCause::Watchdog),
            Kind::HaltedCore => Core::Halted,
            Kind::CoreHaltedBriefly if !is_last => Core::Halted,
            Kind::BrownOut if is_last => Core::Resets(ResetCause::BrownOut),
            Kind::BrownOut if now >= self.ticks.start + u64::from(LOADED_TICKS) => Core::Down,
            Kind::ResetUnderLoad if is_last && self.sign > 0 => Core::Resets(ResetCause::Pin),
            Kind::ResetUnderLoad if is_last => Core::Resets(ResetCause::Software),
            _ => Core::Runs,
        }
    }

    /// Returns its effect on the hand.
    #[must_use]
    pub fn hand_motion(&self) -> HandMotion {
        match self.kind {
            Kind::HotMotors | Kind::ResetUnderLoad | Kind::BrownOut => HandMotion::Press,
            Kind::Yank => HandMotion::Yank(self.by_mm),
            _ => HandMotion::Wander,
        }
    }

    /// Returns a message that the host should not send.
    #[must_use]
    pub fn misplaced<'b>(&self, random: &mut Random, epoch: u32) -> Option<ToDevice<'b>> {
        if self.kind != Kind::Misplaced || random.below(4) != 0 {
            return None;
        }
        let mut calibration = Calibration::PREMIUM_1_5;
        calibration.l1_mm *= 0.5;
        calibration.motor_sign = -calibration.motor_sign;
        // Any number: new, or used before.
        let number = random.bits() as u8;
        let request = |request| ToDevice::Request { number, request };
        Some(match random.below(6) {
            0 => request(match random.below(2) {
                0 => Request::StoreCalibration,
                _ => Request::SetCalibration { calibration },
            }),
            1 => request(Request::Zero {
                counts: [1_000, -2_000, 3_000],
            }),
            2 => ToDevice::Hip(HipCommand {
                seq: 1,
                hip: GridPoint::default(),
            }),
            3 => ToDevice::Tile(TileMessage {
                epoch: epoch.wrapping_add(random.below(2) as u32),
                key: hapterra_core::terrain::TileKey::new(
                    0,
                    random.below(20) as i32,
                    random.below(20) as i32,
                ),
                heights: Heights::Flat {
                    base: 1_000,
                    height: 0.0,
                },
            }),
            4 => ToDevice::GetCalibration { number },
            _ => ToDevice::Status { number },
        })
    }
}
