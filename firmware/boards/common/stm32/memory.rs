//! The calibration in flash: two areas at its end, which the memory map keeps
//! from the image, in the bank that no code runs from. So code runs on while
//! they are written. They are erased at start-up only, before the tick, the
//! watchdog and the link: on an H743 that takes a second or two.

use core::cell::RefCell;

use embassy_stm32::flash::{Blocking, Error, Flash};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::status::Refusal;
use hapterra_firmware::store::{CalibrationStore, StoreError, Stored};

use crate::flash::read;
use crate::{FLASH_BASE, write_back};

/// The flash, read past the data cache, which knows nothing of erasing, and
/// read where it may not be readable.
pub(crate) struct Uncached(pub(crate) Flash<'static, Blocking>);

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

/// The board's memory for calibrations.
pub(crate) struct Memory(RefCell<CalibrationStore<Uncached>>);

impl Memory {
    /// Over two areas of `size` bytes from `areas` on, counted from the
    /// beginning of flash. Gives what is stored, and sees to it that there is
    /// room for the next: erasing takes long, and now nobody waits.
    pub(crate) fn open(
        flash: Flash<'static, Blocking>,
        areas: [u32; 2],
        size: u32,
    ) -> (Self, Stored) {
        let mut store = CalibrationStore::new(Uncached(flash), areas, size);
        let stored = store.load();
        if store.prepare().is_err() {
            defmt::warn!("the memory for calibrations cannot be erased");
        }
        (Self(RefCell::new(store)), stored)
    }

    /// Stores a record.
    pub(crate) fn save(&self, calibration: &Calibration) -> Result<(), Refusal> {
        let saved = self.0.borrow_mut().save(calibration);
        saved.map_err(|why| match why {
            StoreError::Full => Refusal::MemoryFull,
            StoreError::Erase | StoreError::Write => Refusal::MemoryFailed,
        })
    }
}
