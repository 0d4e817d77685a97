//! The device's application in this program's memory.

use std::collections::VecDeque;
use std::io;
use std::time::{Duration, Instant};

use hapterra_core::guard::{GuardInputs, GuardOutputs};
use hapterra_core::phantom::Calibration;
use hapterra_core::rate::TickRate;
use hapterra_core::wire::status::{BootReport, UsbClock};
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::board::TickClock;
use hapterra_firmware::native::{Device, StoppedClock};
use hapterra_firmware::store::Stored;

use super::transport::Transport;
use crate::phantom::HeldPhantom;

/// Tiles along the side of the window, as on the emulated board.
const WINDOW: usize = 16;
/// Max ticks run while the host waits for a message.
const MAX_TICKS_PER_CALL: u32 = 1000;

/// Max lead of a device in real time over the clock before it waits, and the lag above which it
/// restarts its schedule.
const MAX_LEAD: Duration = Duration::from_millis(4);
const MAX_LAG: Duration = Duration::from_millis(100);
/// Ticks between two returns of such a device to its host.
const REAL_TIME_TICKS_PER_CALL: u32 = 16;

/// Host time as the device's clock: ticks are never late, and their cost is measured on this
/// machine.
#[derive(Clone, Copy, Debug)]
pub struct HostClock(Instant);

impl Default for HostClock {
    fn default() -> Self {
        Self(Instant::now())
    }
}

impl TickClock for HostClock {
    const HZ: u32 = 1_000_000_000;
    const PERIOD: u32 = 1_000_000;

    fn now(&self) -> u32 {
        self.0.elapsed().as_nanos() as u32 // wraps around, as clocks do
    }

    fn since_due(&self) -> u32 {
        0
    }

    /// Returns the period: the virtual arm stops with this program, so no force lasts while it is
    /// stopped.
    fn since_last_tick(&mut self) -> u32 {
        Self::PERIOD
    }

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        false
    }
}

/// A device in memory, in lock-step: its time passes only while the host waits for a message, and
/// stops when the device waits for the host.
///
/// Without an arm of its own, the device's arm rests in its home pose, and the dead-man switch is
/// not pressed.
pub struct Native<C: TickClock = StoppedClock> {
    device: Device<C, WINDOW>,
    arm: Option<Box<HeldPhantom>>,
    inputs: GuardInputs,
    outputs: GuardOutputs,
    fault_injector: Option<FaultInjector>,
    free_running: bool,
    /// Max ticks run while the host waits for a message.
    ticks_per_call: u32,
    ticks: u64,
    /// Bytes from the device that arrived during a send.
    pending: VecDeque<u8>,
}

/// Injector between arm and device: it receives the number of the next tick and the amplifiers'
/// last commands, and may change the readings of encoders and switches. Tests use it to inject
/// faults and observe the result.
pub type FaultInjector = Box<dyn FnMut(u64, &mut GuardInputs, &GuardOutputs)>;

impl Native<StoppedClock> {
    /// Creates a device for replays: ticks take no time.
    #[must_use]
    pub fn for_replay() -> Self {
        Self::new(StoppedClock, None)
    }

    /// Creates the same device at any tick rate.
    #[must_use]
    pub fn for_replay_at(rate: TickRate) -> Box<dyn Transport> {
        fn at<const KHZ: u32>() -> Box<dyn Transport> {
            Box::new(Native::new(StoppedClock::<KHZ>, None))
        }
        // The tick rate is part of the application's type, as on a board.
        match rate.hz() / 1_000 {
            10 => at::<10>(),
            9 => at::<9>(),
            8 => at::<8>(),
            7 => at::<7>(),
            6 => at::<6>(),
            5 => at::<5>(),
            4 => at::<4>(),
            3 => at::<3>(),
            2 => at::<2>(),
            _ => at::<1>(),
        }
    }
}

impl<C: TickClock> Native<C> {
    /// Creates a device with an arm, a Premium 1.5, and that arm's calibration in its memory.
    #[must_use]
    pub fn new(clock: C, arm: Option<Box<HeldPhantom>>) -> Self {
        let stored = Stored::Found(Calibration::PREMIUM_1_5);
        Self::started(clock, arm, stored, BootReport::default())
    }

    /// Creates a device with the given stored calibration and reset cause.
    #[must_use]
    pub fn started(
        clock: C,
        arm: Option<Box<HeldPhantom>>,
        stored: Stored,
        boot: BootReport,
    ) -> Self {
        // The two halves of the application exchange tile buffers by reference, until the program
        // ends.
        let tiles = Box::leak(Box::new(TileBuffers::VACANT));
        let memory = Box::leak(Box::new(WorkingMemory::new()));
        let mut native = Self {
            device: Device::new(tiles, memory, clock, stored, boot),
            arm,
            inputs: GuardInputs::default(),
            outputs: GuardOutputs::default(),
            fault_injector: None,
            free_running: false,
            ticks_per_call: MAX_TICKS_PER_CALL,
            ticks: 0,
            pending: VecDeque::new(),
        };
        native.read_sensors();
        native
    }

    /// Adds a fault injector between the device and its arm.
    #[must_use]
    pub fn with_fault_injector(mut self, fault_injector: FaultInjector) -> Self {
        self.fault_injector = Some(fault_injector);
        self.read_sensors();
        self
    }

    /// Lets time pass whenever the line is read, as on a board: also while the device waits only
    /// for the host.
    #[must_use]
    pub fn free_running(mut self) -> Self {
        self.free_running = true;
        self
    }

    /// Sets the reported state of the device's USB oscillator.
    #[must_use]
    pub fn with_usb_clock(self, clock: UsbClock) -> Self {
        self.device.monitor().measure_usb_clock(clock);
        self
    }

    /// Sets the ticks that the device runs before it returns to its host.
    #[must_use]
    pub fn with_ticks_per_call(mut self, ticks: u32) -> Self {
        self.ticks_per_call = ticks;
        self
    }

    /// Limits the device's time to this machine's clock, for a host that shows the session. A
    /// longer lag than a moment is not made up for.
    #[must_use]
    pub fn in_real_time(self) -> Self {
        let tick = Duration::from_secs(1) * C::PERIOD / C::HZ;
        let mut due = Instant::now();
        let pace: FaultInjector = Box::new(move |_, _, _| {
            due += tick;
            let now = Instant::now();
            let early = due.saturating_duration_since(now);
            if early > MAX_LEAD {
                std::thread::sleep(early);
            }
            if now.saturating_duration_since(due) > MAX_LAG {
                due = now;
            }
        });
        self.with_fault_injector(pace)
            .with_ticks_per_call(REAL_TIME_TICKS_PER_CALL)
    }

    /// Returns the virtual arm, if the device has one.
    #[must_use]
    pub fn arm(&self) -> Option<&HeldPhantom> {
        self.arm.as_deref()
    }

    /// Returns the commands to the amplifiers in the last tick.
    #[must_use]
    pub const fn outputs(&self) -> GuardOutputs {
        self.outputs
    }

    /// Returns the memory that the device would find after a restart.
    #[must_use]
    pub const fn memory(&self) -> &Stored {
        self.device.memory()
    }

    /// Lets time pass while the line is not read, as on a board whose host is gone.
    pub fn run_ticks(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    fn tick(&mut self) {
        self.outputs = self.device.tick(self.inputs);
        self.ticks += 1;
        if let Some(arm) = self
            .arm
            .as_mut()
            .filter(|_| self.device.link.is_arm_in_use())
        {
            let currents_a = self.outputs.currents_a.to_array().map(f64::from);
            arm.step(currents_a, f64::from(C::PERIOD) / f64::from(C::HZ));
        }
        self.read_sensors();
    }

    /// Reads encoders and switches, and applies the fault injector.
    fn read_sensors(&mut self) {
        if let Some(arm) = &self.arm {
            self.inputs = arm.guard_inputs();
        }
        if let Some(fault_injector) = &mut self.fault_injector {
            fault_injector(self.ticks, &mut self.inputs, &self.outputs);
        }
    }

    /// Runs the device until it can accept more bytes.
    fn make_room(&mut self) {
        let mut chunk = [0; 512];
        let sent = self.device.link.transmit(&mut chunk);
        self.pending.extend(chunk.iter().take(sent));
        if sent == 0 {
            self.tick();
        }
    }
}

impl<C: TickClock> Transport for Native<C> {
    fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            let accepted = self.device.receive(bytes);
            bytes = bytes.get(accepted..).unwrap_or(&[]);
            if accepted == 0 {
                self.make_room();
            }
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _wait: Duration) -> io::Result<usize> {
        if !self.pending.is_empty() {
            return io::Read::read(&mut self.pending, into);
        }
        for _ in 0..self.ticks_per_call {
            let sent = self.device.link.transmit(into);
            if sent > 0 || (self.device.link.may_stop_clock() && !self.free_running) {
                return Ok(sent);
            }
            self.tick();
        }
        Ok(0)
    }
}
