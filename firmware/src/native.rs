//! The application as a value, for a host program: no interrupts, no tasks.
//!
//! The caller moves bytes and calls [`Device::tick`]. In lock-step it does so
//! only while [`Device::may_stand_still`] is false, as the emulated board's
//! clock does; in real time it calls it a thousand times a second regardless.

use hapterra_core::guard::Drive;
use hapterra_core::tick::Haptics;
use hapterra_core::wire::status::BootReport;
use hapterra_tick::FastTick;

use crate::board::{Amplifiers, EnabledAmplifiers, Encoders, Sense, TickClock};
use crate::channels::{Application, Channels, Hardware, Tiles, assemble};
use crate::haptic_loop::HapticLoop;
use crate::link::Link;
use crate::store::Stored;
use crate::supervisor::{NoWatchdog, Supervisor};
use crate::vitals::Part;

/// Encoders and switches that read what they were last given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Given(pub Sense);

impl Encoders for Given {
    fn sense(&mut self) -> Sense {
        self.0
    }
}

/// Amplifiers whose currents the caller of the tick takes from its result.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReportedOff;

/// As [`ReportedOff`], on.
#[derive(Clone, Copy, Debug)]
pub struct ReportedOn;

impl Amplifiers for ReportedOff {
    type Enabled = ReportedOn;

    fn enable(self) -> ReportedOn {
        ReportedOn
    }
}

impl EnabledAmplifiers for ReportedOn {
    type Disabled = ReportedOff;

    fn write(&mut self, _currents_a: [f32; 3]) {}

    fn disable(self) -> ReportedOff {
        ReportedOff
    }
}

/// A clock for lock-step: no tick takes any time. So many ticks are a millisecond.
#[derive(Clone, Copy, Debug, Default)]
pub struct StoppedClock<const TICKS_A_MS: u32 = 1>;

impl<const TICKS_A_MS: u32> TickClock for StoppedClock<TICKS_A_MS> {
    const HZ: u32 = 1_000_000 * TICKS_A_MS;
    const PERIOD: u32 = 1_000;

    fn now(&self) -> u32 {
        0
    }

    fn since_due(&self) -> u32 {
        0
    }

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        false
    }
}

/// A device in the host's memory, with a window of `D × D` tiles and a clock
/// `C`.
pub struct Device<C, const D: usize> {
    haptic_loop: HapticLoop<'static, Given, ReportedOff, C, D>,
    link: Link<'static, D>,
    supervisor: Supervisor<'static, NoWatchdog>,
    /// What the device remembers without power.
    memory: Stored,
}

impl<C: TickClock, const D: usize> Device<C, D>
where
    Haptics<'static, D>: FastTick,
{
    /// Builds the device in memory that lives as long as the program, such as
    /// a leaked box: tile buffers travel between its halves by reference.
    pub fn new(
        tiles: &'static mut Tiles<D>,
        channels: &'static mut Channels<'static>,
        clock: C,
        calibration: Stored,
        boot: BootReport,
    ) -> Self {
        let hardware = Hardware {
            encoders: Given::default(),
            amplifiers: ReportedOff,
            clock,
            calibration,
            boot,
        };
        let Application {
            haptic_loop,
            link,
            vitals,
        } = assemble(tiles, channels, hardware, "native");
        Self {
            haptic_loop,
            link,
            supervisor: Supervisor::new(vitals, NoWatchdog, &[Part::Tick, Part::Link]),
            memory: calibration,
        }
    }

    /// What the device would find in its memory if it were restarted now.
    #[must_use]
    pub const fn memory(&self) -> &Stored {
        &self.memory
    }

    /// Takes bytes from the host; see [`Link::receive`].
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let taken = self.link.receive(bytes);
        self.turn();
        taken
    }

    fn turn(&mut self) {
        if let Some(calibration) = self.link.to_store() {
            self.memory = Stored::Found(calibration);
            self.link.stored(Ok(()));
        }
        self.link.turn();
    }

    /// Moves bytes for the host into `into`; see [`Link::transmit`].
    pub fn transmit(&mut self, into: &mut [u8]) -> usize {
        self.link.transmit(into)
    }

    /// One tick with these encoders and switches; returns what the amplifiers
    /// got.
    pub fn tick(&mut self, sense: Sense) -> Drive {
        let drive = self.tick_alone(sense);
        self.turn();
        self.supervisor.check();
        drive
    }

    /// As [`Device::tick`], with the task of the link hanging.
    pub fn tick_alone(&mut self, sense: Sense) -> Drive {
        self.haptic_loop.encoders_mut().0 = sense;
        self.haptic_loop.tick()
    }

    /// Whether nothing can happen before the host has spoken; see
    /// [`Link::may_stand_still`].
    #[must_use]
    pub fn may_stand_still(&self) -> bool {
        self.link.may_stand_still()
    }

    /// Whether the arm is in use; see [`Link::drives_arm`].
    #[must_use]
    pub fn drives_arm(&self) -> bool {
        self.link.drives_arm()
    }

    /// Whether the host has said goodbye and everything is sent.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.link.has_ended()
    }

    /// The transport was interrupted; see [`Link::interrupted`].
    pub fn interrupted(&mut self) {
        self.link.interrupted();
    }
}
