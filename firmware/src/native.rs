//! The application as a value, for a host program: no interrupts, no tasks.
//!
//! The caller moves bytes and calls [`Device::tick`]: in lock-step only while
//! [`Link::may_stop_clock`] is false, as the emulated board's clock does; in real time always a
//! thousand times a second.

use hapterra_core::guard::GuardOutputs;
use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::hello::SerialNumber;
use hapterra_core::wire::status::BootReport;

use crate::amplifier::CURRENT_LOOP_US;
use crate::app::{Application, Hardware, TileBuffers, WorkingMemory, assemble};
use crate::board::{Amplifiers, EnabledAmplifiers, Encoders, GuardInputs, TickClock};
use crate::haptic_loop::HapticLoop;
use crate::link::Link;
use crate::monitor::{Monitor, WatchedPart};
use crate::motor_memory::{self, Copies};
use crate::store::Stored;

/// Name of the device, as of a board without a chip.
pub const BOARD: &str = "native";
/// Current at the ends of the range of a device without real amplifiers, A: the same as on every
/// board.
pub const FULL_SCALE_A: f32 = 5.5;

/// Encoders and switches that return the caller's last values.
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualEncoders(pub GuardInputs);

impl Encoders for VirtualEncoders {
    fn sense(&mut self) -> GuardInputs {
        self.0
    }
}

/// Amplifiers whose currents are in the result of the tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct VirtualAmplifiersOff;

/// The same as [`VirtualAmplifiersOff`], on.
#[derive(Clone, Copy, Debug)]
pub struct VirtualAmplifiersOn;

impl Amplifiers for VirtualAmplifiersOff {
    type Enabled = VirtualAmplifiersOn;

    fn enable(self) -> VirtualAmplifiersOn {
        VirtualAmplifiersOn
    }

    fn set_held_outputs(&mut self, _held: [f32; 3]) {}
}

impl EnabledAmplifiers for VirtualAmplifiersOn {
    type Disabled = VirtualAmplifiersOff;

    fn write(&mut self, _currents_a: [f32; 3]) {}

    fn disable(self) -> VirtualAmplifiersOff {
        VirtualAmplifiersOff
    }
}

/// A clock for lock-step, in which a tick takes no time, at `TICKS_A_MS` ticks a millisecond.
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

    /// Returns a period: no time passes outside of ticks.
    fn since_last_tick(&mut self) -> u32 {
        Self::PERIOD
    }

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        false
    }
}

/// A device in the host's memory, with a window of `D × D` tiles and a clock `C`.
pub struct Device<C, const D: usize> {
    haptic_loop: HapticLoop<'static, VirtualEncoders, VirtualAmplifiersOff, C, D>,
    /// The device's end of the link. [`Device::receive`] passes bytes to it, and then also runs the
    /// link's task.
    pub link: Link<'static, D>,
    monitor: &'static Monitor,
    /// Stored calibration, which survives without power.
    stored: Stored,
    /// RAM that survives a reset.
    retained: Copies,
}

impl<C: TickClock, const D: usize> Device<C, D> {
    /// Returns the check-ins and counters of its parts.
    #[must_use]
    pub const fn monitor(&self) -> &'static Monitor {
        self.monitor
    }

    /// Builds the device in memory that is never freed, such as a leaked box, because its halves
    /// exchange tile buffers by reference.
    pub fn new(
        tiles: &'static mut TileBuffers<D>,
        memory: &'static mut WorkingMemory<'static>,
        clock: C,
        calibration: Stored,
        boot: BootReport,
    ) -> Self {
        let cold = (Temperatures::AIR, Copies::default());
        Self::with_motors(tiles, memory, clock, calibration, boot, cold)
    }

    /// Builds the device as [`Device::new`] does, with the RAM of an earlier device
    /// ([`Device::retained`]). Motors of unknown temperature are hot.
    pub fn restarted(
        tiles: &'static mut TileBuffers<D>,
        memory: &'static mut WorkingMemory<'static>,
        clock: C,
        calibration: Stored,
        boot: BootReport,
        retained: &Copies,
    ) -> Self {
        let motors = motor_memory::begin(boot.cause, retained);
        Self::with_motors(tiles, memory, clock, calibration, boot, motors)
    }

    fn with_motors(
        tiles: &'static mut TileBuffers<D>,
        memory: &'static mut WorkingMemory<'static>,
        clock: C,
        calibration: Stored,
        boot: BootReport,
        (motors, retained): (Temperatures, Copies),
    ) -> Self {
        let hardware = Hardware {
            encoders: VirtualEncoders::default(),
            amplifiers: VirtualAmplifiersOff,
            clock,
            full_scale_a: FULL_SCALE_A,
            latency_us: CURRENT_LOOP_US,
            calibration,
            motors,
            serial: SerialNumber::NONE,
            boot,
        };
        let Application {
            haptic_loop,
            link,
            monitor,
        } = assemble(tiles, memory, hardware, BOARD);
        Self {
            haptic_loop,
            link,
            monitor,
            stored: calibration,
            retained,
        }
    }

    /// Returns the memory that the device would find after a restart.
    #[must_use]
    pub const fn memory(&self) -> &Stored {
        &self.stored
    }

    /// Returns the RAM that survives a reset: the motors' temperatures, twice.
    #[must_use]
    pub const fn retained(&self) -> &Copies {
        &self.retained
    }

    /// Returns the current calibration.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.haptic_loop.calibration()
    }

    /// Returns the device's temperatures of its motors.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.haptic_loop.temperatures()
    }

    /// Passes bytes from the host to the link ([`Link::receive`]) and runs the link's task.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let consumed = self.link.receive(bytes);
        self.poll();
        consumed
    }

    fn poll(&mut self) {
        if let Some(calibration) = self.link.to_store() {
            self.stored = Stored::Found(calibration);
            self.link.stored(Ok(()));
        }
        self.link.poll();
    }

    /// Runs one tick with these encoders and switches, then the link's task. Returns the
    /// amplifiers' commands.
    pub fn tick(&mut self, sense: GuardInputs) -> GuardOutputs {
        let drive = self.tick_alone(sense);
        self.poll();
        // There is no watchdog here, but the tick expects one to be fed.
        let _ = self
            .monitor
            .may_feed_watchdog(&[WatchedPart::Tick, WatchedPart::Link]);
        drive
    }

    /// Runs one tick only, as if the link's task hung.
    pub fn tick_alone(&mut self, sense: GuardInputs) -> GuardOutputs {
        self.haptic_loop.encoders_mut().0 = sense;
        let drive = self.haptic_loop.tick();
        if let Some((copy, words)) = self.haptic_loop.due_motor_copy()
            && let Some(place) = self.retained.get_mut(copy)
        {
            *place = words;
        }
        drive
    }
}
