//! The device's own application in this program's memory.

use std::collections::VecDeque;
use std::io;
use std::time::{Duration, Instant};

use hapterra_core::phantom::Calibration;
use hapterra_firmware::board::TickClock;
use hapterra_firmware::channels::{Channels, Tiles};
use hapterra_firmware::native::{Device, StoppedClock};

use super::Transport;
use crate::phantom::Rig;

/// Tiles along the side of the window, as on the emulated board.
const WINDOW: usize = 16;
/// Seconds between two ticks.
const TICK_S: f64 = 1e-3;
/// Ticks run while waiting for the device to say something, at most.
const TICKS_A_CALL: u32 = 1000;

/// Host time as the device's clock: ticks are never late, and cost what they
/// cost here.
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

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        false
    }
}

/// A device in memory, in lock-step: its time passes while the host waits for
/// it to say something, and only as long as it waits for nothing itself.
///
/// Without a rig the arm rests in its home pose.
pub struct Native<C: TickClock = StoppedClock> {
    device: Device<C, WINDOW>,
    rig: Option<Box<Rig>>,
    counts: [i32; 3],
    /// What the device said while it was told something.
    pending: VecDeque<u8>,
}

impl Native<StoppedClock> {
    /// A device to replay trajectories on: no tick takes any time.
    #[must_use]
    pub fn for_replay() -> Self {
        Self::new(StoppedClock, None)
    }
}

impl<C: TickClock> Native<C> {
    /// A device whose arm is `rig`.
    #[must_use]
    pub fn new(clock: C, rig: Option<Box<Rig>>) -> Self {
        // The two halves of the application hand tile buffers to each other by
        // reference, for as long as the program runs.
        let tiles = Box::leak(Box::new(Tiles::new()));
        let channels = Box::leak(Box::new(Channels::new()));
        Self {
            device: Device::new(tiles, channels, clock, Calibration::PREMIUM_1_5),
            counts: rig.as_ref().map_or([0; 3], |rig| rig.counts()),
            rig,
            pending: VecDeque::new(),
        }
    }

    /// Lets time pass while nobody listens, as a board does whose host is gone.
    pub fn pass(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    fn tick(&mut self) {
        let drive = self.device.tick(self.counts);
        if !self.device.feels_arm() {
            return;
        }
        if let Some(rig) = &mut self.rig {
            let currents_a = drive.currents_a.to_array().map(f64::from);
            self.counts = rig.step(currents_a, TICK_S);
        }
    }

    /// Lets the device do what it has to do before it can take more.
    fn make_room(&mut self) {
        let mut chunk = [0; 512];
        let said = self.device.transmit(&mut chunk);
        self.pending.extend(chunk.iter().take(said));
        if said == 0 {
            self.tick();
        }
    }
}

impl<C: TickClock> Transport for Native<C> {
    fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            let taken = self.device.receive(bytes);
            bytes = bytes.get(taken..).unwrap_or(&[]);
            if taken == 0 {
                self.make_room();
            }
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _wait: Duration) -> io::Result<usize> {
        if !self.pending.is_empty() {
            return io::Read::read(&mut self.pending, into);
        }
        for _ in 0..TICKS_A_CALL {
            let said = self.device.transmit(into);
            if said > 0 || self.device.may_stand_still() {
                return Ok(said);
            }
            self.tick();
        }
        Ok(0)
    }
}
