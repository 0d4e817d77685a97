//! The calibration in flash: two areas at its end. The memory map excludes them from the image, and
//! no code runs from their bank, so code continues to run while they are written. They are erased
//! at start-up only, before the tick, the watchdog and the link: on an H743 that takes a second or
//! two.

use core::cell::RefCell;

use embassy_stm32::flash::{Blocking, Error, Flash};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::request::Refusal;
use hapterra_firmware::store::{CalibrationStore, StoreError, Stored};

use crate::chip::{CALIBRATIONS, CALIBRATIONS_SIZE, write_back};
use crate::flash::read;

/// First address of flash, on every chip.
const FLASH_BASE: usize = 0x0800_0000;

/// The flash, read without the data cache, which does not detect an erase, and with tolerance of
/// unreadable words.
struct Uncached(Flash<'static, Blocking>);

impl ErrorType for Uncached {
    type Error = Error;
}

impl ReadNorFlash for Uncached {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        if offset as usize + bytes.len() > self.capacity() {
            return Err(Error::Size);
        }
        let address = FLASH_BASE + offset as usize;
        write_back(address, bytes.len());
        match read(address, bytes) {
            true => Ok(()),
            false => Err(Error::Prog),
        }
    }

    fn capacity(&self) -> usize {
        ReadNorFlash::capacity(&self.0)
    }
}

impl NorFlash for Uncached {
    const WRITE_SIZE: usize = <Flash<'static, Blocking> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Flash<'static, Blocking> as NorFlash>::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        self.0.blocking_erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.0.blocking_write(offset, bytes)
    }
}

/// The board's memory for calibrations; `None` if the board has no such memory.
pub(crate) struct CalibrationMemory(RefCell<Option<CalibrationStore<Uncached>>>);

impl CalibrationMemory {
    /// Opens the memory and returns the stored calibration. Erases an area for the next record now,
    /// because an erase takes long and nothing waits yet. Without a flash, nothing is stored.
    pub(crate) fn open(flash: Option<Flash<'static, Blocking>>) -> (Self, Stored) {
        let Some(flash) = flash else {
            defmt::warn!(
                "no memory for calibrations: the option bytes configure the flash as one bank"
            );
            return (Self(RefCell::new(None)), Stored::Missing);
        };
        let mut store = CalibrationStore::new(Uncached(flash), CALIBRATIONS, CALIBRATIONS_SIZE);
        let stored = store.load();
        if store.prepare().is_err() {
            defmt::warn!("the memory for calibrations cannot be erased");
        }
        (Self(RefCell::new(Some(store))), stored)
    }

    /// Stores a record.
    pub(crate) fn save(&self, calibration: &Calibration) -> Result<(), Refusal> {
        let mut store = self.0.borrow_mut();
        let saved = store.as_mut().ok_or(Refusal::NoMemory)?.save(calibration);
        saved.map_err(|why| match why {
            StoreError::Full => Refusal::MemoryFull,
            StoreError::Erase | StoreError::Write => Refusal::MemoryFailed,
        })
    }
}
