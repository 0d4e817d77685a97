//! The device of a segment, and its flash and RAM after a reset.

use hapterra_core::phantom::Calibration;
use hapterra_core::wire::status::{BootReport, ResetCause};
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::motor_memory::Copies;
use hapterra_firmware::native::Device;
use hapterra_firmware::store::Stored;

use super::clock::SetClock;
use crate::random::Random;

/// Tiles along the side of the window, as on the smallest board.
const WINDOW: usize = 4;

/// The device.
pub type Board = Device<SetClock, WINDOW>;

/// Stored calibration of every board of the campaign.
pub const STORED: Stored = Stored::Found(Calibration::PREMIUM_1_5);

/// Allocates the tile buffers that the two halves of the application exchange by reference.
fn memory() -> (
    &'static mut TileBuffers<WINDOW>,
    &'static mut WorkingMemory<'static>,
) {
    let tiles = Box::leak(Box::new(TileBuffers::VACANT));
    (tiles, Box::leak(Box::new(WorkingMemory::new())))
}

/// Creates a device with cold motors.
#[must_use]
pub fn new(clock: SetClock) -> Board {
    let (tiles, memory) = memory();
    Device::new(tiles, memory, clock, STORED, BootReport::default())
}

/// Returns the device after a reset: it keeps the flash and RAM of `before`, with random damage to
/// the RAM if the supply was low.
#[must_use]
pub fn reset(before: &Board, clock: SetClock, cause: ResetCause, random: &mut Random) -> Board {
    let mut ram = *before.retained();
    if cause == ResetCause::BrownOut {
        damage(&mut ram, random);
    }
    let (tiles, memory) = memory();
    let boot = BootReport {
        cause,
        ..BootReport::default()
    };
    Device::restarted(tiles, memory, clock, *before.memory(), boot, &ram)
}

/// Flips a bit of neither copy, of one, or of both.
fn damage(ram: &mut Copies, random: &mut Random) {
    for copy in ram {
        if random.below(2) == 0 {
            let at = random.below(copy.len());
            copy[at] ^= 1 << random.below(32);
        }
    }
}
