//! Injected faults, and their expected outcomes.

use hapterra_core::guard::Fault;

/// Something that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One encoder reads some hundred counts more from one tick on.
    EncoderJump,
    /// One encoder reads far off for a single tick.
    EncoderGlitch,
    /// Encoders read up to two counts off, another error in each tick.
    EncoderNoise,
    /// One encoder stands still for a while, then reads right again.
    EncoderStuck,
    /// One encoder reads its joint on and on, as if it ran away.
    EncoderRunaway,
    /// One encoder creeps beyond its joint's limits.
    EncoderBeyondLimits,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The dead-man switch is let go.
    DeadManReleased,
    /// The dead-man switch opens for one tick.
    DeadManBounce,
    /// The encoder or amplifier hardware says that it cannot work.
    HardwareFailed,
    /// A converter's settings do not read back as they were written.
    OutputsNotAsSet,
    /// An amplifier loses its supply: it is not ready, and its motor has no current.
    AmplifierNotReady,
    /// A motor's measured current is another than the one that was commanded.
    CurrentMismatch,
    /// The wire of a motor breaks.
    MotorOpen,
    /// Bytes are lost, both ways.
    LinkLoss,
    /// Bytes come late, both ways.
    LinkDelay,
    /// Bytes come twice, both ways.
    LinkDuplicates,
    /// Bits are flipped, both ways.
    LinkCorruption,
    /// The link is unplugged or silent for seconds, then the host returns.
    LinkSilence,
    /// The host is restarted and brings another scene.
    HostRestarted,
    /// The host says goodbye.
    Goodbye,
    /// Well-formed messages that make no sense now: another calibration,
    /// another zero pose, points of a replay, tiles without a request.
    Misplaced,
    /// A tick is not done when the next is due.
    TickOverrun,
    /// Ticks begin late.
    LateTicks,
    /// The link's task hangs.
    TaskStalled,
    /// Tiles that are asked for do not come for seconds.
    TilesMissing,
    /// Tiles come whose heights are infinite, not numbers or absurd.
    TilesPoisoned,
    /// The hand presses as hard as it can until the motors are hot.
    HotMotors,
    /// The hand is yanked away.
    Yank,
    /// The supply breaks down under load and returns; the RAM may be damaged.
    BrownOut,
    /// The chip is reset under load.
    ResetUnderLoad,
    /// The core stands still with its command on, until the watchdog resets it.
    HaltedCore,
    /// The core stands still with its command on and runs again before the watchdog resets it.
    CoreHaltedBriefly,
    /// The host replays points while the arm is moved, and then runs a terrain.
    ReplayThenRun,
    /// The host sends calibrations above every ceiling, or of garbage, or wants one
    /// stored without consent.
    HostileCalibration,
    /// Endpoints of the USB are halted and cleared in the middle of what is sent.
    EndpointHalt,
    /// The clutch input is held, and let go again. Nothing goes wrong.
    Clutch,
}

/// Permitted outcomes. All others are violations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expectation {
    /// It may be ridden through: the arm stays armed.
    pub may_ride: bool,
    /// It may disarm the arm without a fault: force goes out, no more.
    pub may_disarm: bool,
    /// Faults that it may latch.
    pub may_latch: &'static [Fault],
    /// Ticks after its first one in which the amplifiers may still be on, where
    /// it has to be latched.
    pub within: Option<u32>,
}

/// For how many ticks it lasts, shortest and longest.
pub type Duration = (u32, u32);

const RIDE: Expectation = Expectation {
    may_ride: true,
    may_disarm: false,
    may_latch: &[],
    within: None,
};

const fn latch(may_latch: &'static [Fault], within: u32) -> Expectation {
    Expectation {
        may_ride: false,
        may_disarm: false,
        may_latch,
        within: Some(within),
    }
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 37] = [
        Self::EncoderJump,
        Self::EncoderGlitch,
        Self::EncoderNoise,
        Self::EncoderStuck,
        Self::EncoderRunaway,
        Self::EncoderBeyondLimits,
        Self::EmergencyStop,
        Self::DeadManReleased,
        Self::DeadManBounce,
        Self::HardwareFailed,
        Self::OutputsNotAsSet,
        Self::AmplifierNotReady,
        Self::CurrentMismatch,
        Self::MotorOpen,
        Self::LinkLoss,
        Self::LinkDelay,
        Self::LinkDuplicates,
        Self::LinkCorruption,
        Self::LinkSilence,
        Self::HostRestarted,
        Self::Goodbye,
        Self::Misplaced,
        Self::TickOverrun,
        Self::LateTicks,
        Self::TaskStalled,
        Self::TilesMissing,
        Self::TilesPoisoned,
        Self::HotMotors,
        Self::Yank,
        Self::BrownOut,
        Self::ResetUnderLoad,
        Self::HaltedCore,
        Self::CoreHaltedBriefly,
        Self::ReplayThenRun,
        Self::HostileCalibration,
        Self::EndpointHalt,
        Self::Clutch,
    ];

    /// Returns the expected outcome.
    #[must_use]
    pub const fn expectation(self) -> Expectation {
        match self {
            Self::EncoderJump | Self::EncoderGlitch => latch(&[Fault::EncoderJump], 0),
            Self::EmergencyStop => latch(&[Fault::EmergencyStop], 0),
            Self::DeadManReleased | Self::DeadManBounce => latch(&[Fault::DeadManReleased], 0),
            Self::HardwareFailed => latch(&[Fault::Hardware], 0),
            Self::OutputsNotAsSet => latch(&[Fault::OutputsNotAsSet], 0),
            // Two ticks may be a spike on the wire.
            Self::AmplifierNotReady => latch(&[Fault::AmplifierNotReady], 2),
            Self::CurrentMismatch => latch(&[Fault::CurrentMismatch], MISMATCH_TICKS),
            // Where nothing is commanded nothing is missing.
            Self::MotorOpen => Expectation {
                may_latch: &[Fault::CurrentMismatch],
                ..RIDE
            },
            // Found when the tick that ran over has driven already.
            Self::TickOverrun => latch(&[Fault::TickOverrun], 1),
            Self::TaskStalled => latch(&[Fault::TaskStalled], STALL_TICKS),
            Self::EncoderRunaway => {
                latch(&[Fault::TooFast, Fault::JointLimit, Fault::Linkage], 400)
            }
            Self::EncoderBeyondLimits => latch(&[Fault::JointLimit, Fault::Linkage], 3_000),
            // Where nothing moves or pushes it cannot be seen, and does no harm;
            // what it missed returns as a jump.
            Self::EncoderStuck => Expectation {
                may_latch: &[Fault::NoMotion, Fault::EncoderJump, Fault::TooFast],
                ..RIDE
            },
            Self::HotMotors => Expectation {
                may_latch: &[Fault::MotorTooHot],
                ..RIDE
            },
            Self::Yank => Expectation {
                may_latch: &[Fault::TooFast, Fault::EncoderJump],
                ..RIDE
            },
            // No later than the watchdog's reset.
            Self::HaltedCore => latch(&[Fault::WatchdogReset], WATCHDOG_TICKS),
            // The first tick after it has no force.
            Self::CoreHaltedBriefly => latch(&[Fault::TickGap], WATCHDOG_TICKS),
            Self::BrownOut => Expectation {
                may_ride: false,
                may_latch: &[Fault::SupplyLow],
                ..RIDE
            },
            Self::HostRestarted
            | Self::Goodbye
            | Self::ResetUnderLoad
            | Self::ReplayThenRun
            | Self::HostileCalibration => Expectation {
                may_ride: false,
                may_disarm: true,
                ..RIDE
            },
            Self::EncoderNoise
            | Self::LinkLoss
            | Self::LinkDelay
            | Self::LinkDuplicates
            | Self::LinkCorruption
            | Self::LinkSilence
            | Self::Misplaced
            | Self::LateTicks
            | Self::EndpointHalt
            | Self::Clutch
            | Self::TilesMissing
            | Self::TilesPoisoned => RIDE,
        }
    }

    /// Returns the time for which it lasts, ticks.
    #[must_use]
    pub const fn duration(self) -> Duration {
        match self {
            Self::EncoderGlitch | Self::DeadManBounce | Self::TickOverrun => (1, 1),
            Self::EncoderJump | Self::Goodbye | Self::HostRestarted => (1, 1),
            Self::EmergencyStop | Self::DeadManReleased | Self::HardwareFailed => (1, 150),
            Self::OutputsNotAsSet => (1, 150),
            Self::AmplifierNotReady => (3, 300),
            Self::CurrentMismatch => (MISMATCH_TICKS, 150),
            Self::MotorOpen => (100, 800),
            Self::EncoderStuck => (50, 1_500),
            Self::EncoderRunaway => (400, 400),
            Self::EncoderBeyondLimits => (3_000, 3_000),
            Self::LinkSilence => (200, 3_000),
            Self::TilesMissing | Self::TilesPoisoned => (300, 2_000),
            Self::HotMotors => (25_000, 60_000),
            Self::Yank => (40, 120),
            Self::TaskStalled => (STALL_TICKS + 20, STALL_TICKS + 200),
            Self::LateTicks => (1, 50),
            Self::BrownOut => (LOADED_TICKS + 50, LOADED_TICKS + 2_000),
            Self::ResetUnderLoad => (3_000, 12_000),
            Self::HaltedCore => (WATCHDOG_TICKS, WATCHDOG_TICKS),
            Self::CoreHaltedBriefly => (2, 40),
            Self::ReplayThenRun => (300, 3_000),
            Self::HostileCalibration => (500, 2_500),
            // It opens to the end.
            Self::Clutch => (250, 1_000),
            Self::EncoderNoise
            | Self::LinkLoss
            | Self::LinkDelay
            | Self::LinkDuplicates
            | Self::LinkCorruption
            | Self::EndpointHalt
            | Self::Misplaced => (50, 800),
        }
    }
}

/// Within this many ticks a current that was not commanded has to be noticed.
pub const MISMATCH_TICKS: u32 = 25;

/// Within this many ticks a task that hangs has to be noticed.
pub const STALL_TICKS: u32 = 41;
/// Within this many ticks the watchdog resets a chip whose core stands still.
pub const WATCHDOG_TICKS: u32 = 60;
/// For so many ticks the hand presses before the supply breaks down.
pub const LOADED_TICKS: u32 = 1_500;
