//! Injected faults, and their expected outcomes.

use hapterra_core::guard::Fault;

/// Kind of an injected fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One encoder is off by some hundred counts from one tick on.
    EncoderJump,
    /// One encoder reads far off for a single tick.
    EncoderGlitch,
    /// Encoders are off by up to two counts, with a new error in each tick.
    EncoderNoise,
    /// One encoder's reading freezes for a while, then is right again.
    EncoderStuck,
    /// One encoder's reading keeps changing, as if its joint ran away.
    EncoderRunaway,
    /// One encoder creeps beyond its joint's limits.
    EncoderBeyondLimits,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The dead-man switch is released.
    DeadManReleased,
    /// The dead-man switch opens for one tick.
    DeadManBounce,
    /// The encoder or amplifier hardware reports a failure.
    HardwareFailed,
    /// A converter's settings differ from those written when they are read back.
    OutputsNotAsSet,
    /// An amplifier loses its supply: it is not ready, and its motor has no current.
    AmplifierNotReady,
    /// A motor's measured current differs from its command.
    CurrentMismatch,
    /// The wire of a motor breaks.
    MotorOpen,
    /// Bytes are lost in both directions.
    LinkLoss,
    /// Bytes are late in both directions.
    LinkDelay,
    /// Bytes are duplicated in both directions.
    LinkDuplicates,
    /// Bits are flipped in both directions.
    LinkCorruption,
    /// The link is unplugged or silent for seconds, then the host returns.
    LinkSilence,
    /// The host restarts with another scene.
    HostRestarted,
    /// The host closes the session.
    Goodbye,
    /// Valid messages at the wrong time: another calibration, another zero pose, points of a
    /// replay, tiles without a request.
    Misplaced,
    /// A tick is not done when the next is due.
    TickOverrun,
    /// Ticks begin late.
    LateTicks,
    /// The link's task hangs.
    TaskStalled,
    /// Requested tiles do not arrive for seconds.
    TilesMissing,
    /// Tiles arrive with heights that are infinite, NaN or absurd.
    TilesPoisoned,
    /// The hand presses as hard as it can until the motors are hot.
    HotMotors,
    /// The hand is yanked away.
    Yank,
    /// The supply fails under load and returns; the RAM may be damaged.
    BrownOut,
    /// The chip is reset under load.
    ResetUnderLoad,
    /// The core halts with its command on, until the watchdog resets it.
    HaltedCore,
    /// The core halts with its command on and resumes before the watchdog resets it.
    CoreHaltedBriefly,
    /// The host replays points while the arm is moved, then runs a terrain.
    ReplayThenRun,
    /// The host sends calibrations above an absolute limit or with garbage, or requests to store
    /// one without consent.
    HostileCalibration,
    /// USB endpoints are halted and cleared during a transfer.
    EndpointHalt,
    /// The clutch input is held and released. This is not a failure.
    Clutch,
}

/// Permitted outcomes. All others are violations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expectation {
    /// True if the arm may stay armed.
    pub may_ride: bool,
    /// True if the arm may be disarmed without a fault: the force fades, no more.
    pub may_disarm: bool,
    /// Faults that the device may latch.
    pub may_latch: &'static [Fault],
    /// If a fault must be latched: ticks after the first one in which the amplifiers may still be
    /// on.
    pub within: Option<u32>,
}

/// Shortest and longest duration, ticks.
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
    /// All kinds.
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
            // Without a command no current is missing.
            Self::MotorOpen => Expectation {
                may_latch: &[Fault::CurrentMismatch],
                ..RIDE
            },
            // The late tick is found only after it has driven the motors.
            Self::TickOverrun => latch(&[Fault::TickOverrun], 1),
            Self::TaskStalled => latch(&[Fault::TaskStalled], STALL_TICKS),
            Self::EncoderRunaway => {
                latch(&[Fault::TooFast, Fault::JointLimit, Fault::Linkage], 400)
            }
            Self::EncoderBeyondLimits => latch(&[Fault::JointLimit, Fault::Linkage], 3_000),
            // Without motion or force the fault is invisible and harmless; the missed motion
            // returns as a jump.
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
            // At the latest when the watchdog resets the chip.
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

    /// Returns its shortest and longest duration, ticks.
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
            // The clutch opens completely.
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

/// Ticks within which a wrong current must be detected.
pub const MISMATCH_TICKS: u32 = 25;

/// Ticks within which a hanging task must be detected.
pub const STALL_TICKS: u32 = 41;
/// Ticks within which the watchdog resets a halted chip.
pub const WATCHDOG_TICKS: u32 = 60;
/// Ticks that the hand presses before the supply fails.
pub const LOADED_TICKS: u32 = 1_500;
