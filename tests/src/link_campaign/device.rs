//! The device: the boards' application compiled for this machine, with a virtual arm in a
//! hand, tick by tick.

use hapterra::phantom::PhantomModel;
use hapterra::terrain::Terrain;
use hapterra_core::guard::{GuardInputs, GuardOutputs};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::native::{Device, StoppedClock};
use hapterra_firmware::store::Stored;

use super::cable::BYTES_PER_TICK;
use crate::campaign::arm::{Arm, HandMotion};
use crate::campaign::tick_invariants::{TickChecks, Truth};
use crate::random::Random;

/// Tiles along the side of the window, as on the smallest board.
const WINDOW: usize = 4;

/// The device and its arm.
pub struct Board<'t> {
    device: Device<StoppedClock, WINDOW>,
    arm: Arm<'t>,
    /// Checks every tick against its bounds.
    pub tick_checks: TickChecks,
    /// True if the hand holds the dead-man switch.
    pub dead_man: bool,
    /// Behaviour of the hand.
    pub hand_motion: HandMotion,
    /// Commands to the amplifiers in the last tick.
    pub drive: GuardOutputs,
    /// True if the device's time stops while it waits for the host.
    pub lock_step: bool,
    /// Ticks up to now, and those with the amplifiers on.
    pub ticks: [u64; 2],
}

impl<'t> Board<'t> {
    /// Creates a board after power-up, with its arm over the middle of a terrain.
    pub fn new(terrain: &'t Terrain<'t>, random: &mut Random) -> Self {
        let record = Calibration::PREMIUM_1_5;
        Self {
            device: start(),
            arm: Arm::new(terrain, random),
            tick_checks: TickChecks::new(record, PhantomModel::premium_1_5()),
            dead_man: false,
            hand_motion: HandMotion::Lifted,
            drive: GuardOutputs::default(),
            lock_step: false,
            ticks: [0; 2],
        }
    }

    /// Returns the terrain point at the home pose, mm.
    #[must_use]
    pub fn home_mm(&self) -> [f64; 3] {
        self.arm.home_mm()
    }

    /// Restarts the device; the arm keeps its position.
    pub fn restart(&mut self) {
        self.device = start();
        self.drive = GuardOutputs::default();
        self.tick_checks.reset();
    }

    /// Reports an interruption of the transport.
    pub fn interrupt(&mut self) {
        self.device.link.interrupted();
    }

    /// Receives bytes from the host. Returns the number of bytes accepted.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        self.device.receive(bytes)
    }

    /// Returns the bytes that the device sends, up to `room`.
    pub fn transmit<'b>(&mut self, into: &'b mut [u8; BYTES_PER_TICK], room: usize) -> &'b [u8] {
        let room = room.min(BYTES_PER_TICK);
        let sent = self.device.link.transmit(&mut into[..room]);
        &into[..sent]
    }

    /// Runs one tick of device and arm.
    ///
    /// # Errors
    /// The broken invariant.
    pub fn tick(&mut self) -> Result<(), String> {
        if self.lock_step && self.device.link.may_stop_clock() {
            // The link's task runs nevertheless.
            self.device.receive(&[]);
            return Ok(());
        }
        let sense = GuardInputs {
            counts: self.arm.counts(),
            dead_man: self.dead_man,
            emergency_stop: false,
            ..GuardInputs::default()
        };
        self.drive = self.device.tick(sense);
        let plant = self.arm.plant();
        let truth = Truth {
            q_rad: plant.q_rad(),
            counts: plant.counts(),
            winding_c: plant.winding_c(),
        };
        self.tick_checks
            .check_outputs(&self.drive, &sense, [0; 3], &truth)?;
        let currents = self.drive.currents_a.to_array().map(f64::from);
        self.arm.step(currents, self.hand_motion);
        self.ticks[0] += 1;
        self.ticks[1] += u64::from(self.drive.enabled);
        Ok(())
    }
}

fn start() -> Device<StoppedClock, WINDOW> {
    // The two halves of the application exchange tile buffers by reference, as long as the program
    // runs.
    let tiles = Box::leak(Box::new(TileBuffers::VACANT));
    let memory = Box::leak(Box::new(WorkingMemory::new()));
    let stored = Stored::Found(Calibration::PREMIUM_1_5);
    Device::new(tiles, memory, StoppedClock, stored, BootReport::default())
}
