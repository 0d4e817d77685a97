//! The calibration record in flash. After a loss of power at any moment, either the old or the new
//! record is valid.
//!
//! Two areas of one or more erase blocks each contain a row of places for records. A record is
//! written into the next blank place, never over another; an area is erased only while the other
//! area contains the newest record.
//!
//! ```text
//! place:   number (u32)   its complement (u32)   record (`Calibration::encode`)   0xFF …   mark
//! ```
//!
//! The newest record is the valid one with the highest number. The mark is written last. A place
//! with an invalid checksum, or one that cannot be read, is damaged if it has the mark. Without the
//! mark its write was cut off, and the record is ignored.
//!
//! Erasing is slow (a sector of a large chip: seconds), so only [`CalibrationStore::prepare`] does
//! it, at start-up, before there is a tick or a watchdog. Saving only writes, which takes some
//! milliseconds; it fails if no place is left.

use embedded_storage::nor_flash::NorFlash;
use hapterra_core::phantom::{Calibration, CalibrationError, RECORD_BYTES, RecordError};

/// Number and complement.
const HEAD: usize = 8;
/// The mark, written separately on every chip.
const MARK: [u8; 32] = [0; 32];
/// Offset of the mark in a place: a multiple of 32, the largest write size of the chips.
const MARK_AT: usize = HEAD + RECORD_BYTES + 24;
/// Bytes of a place.
pub const PLACE: usize = MARK_AT + MARK.len();
/// Maximum number of places of an area that are used. Saving a record reads all of them, which must
/// take only a fraction of the watchdog's time.
const MAX_PLACES: u32 = 8;

/// Content of the memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
// Read once, at start-up.
#[allow(clippy::large_enum_variant)]
pub enum Stored {
    /// No record was ever stored, or there is no memory.
    #[default]
    Missing,
    /// A record.
    Found(Calibration),
    /// A whole record that this firmware does not accept, because one of its numbers is impossible
    /// or above the maximum of the model or the board. No older record is used instead: the user
    /// has stored this one.
    Refused(CalibrationError),
    /// Data without a readable record.
    Damaged,
}

/// Reason why a record was not stored. The previous record is still valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// The flash does not erase.
    #[error("the flash cannot be erased")]
    Erase,
    /// Every place is used: [`CalibrationStore::prepare`] makes room.
    #[error("there is no room before the next start")]
    Full,
    /// No place could be written.
    #[error("the flash cannot be written")]
    Write,
}

/// Content of a place.
enum Place {
    Blank,
    /// A record and its number, or the reason why it is not accepted.
    Record(u32, Result<Calibration, CalibrationError>),
    /// A record whose write was cut off by a loss of power.
    CutOff,
    /// A record that was valid once.
    Damaged,
}

/// Content of the two areas.
#[derive(Default)]
struct Contents {
    /// The newest record and its number.
    newest: Option<(u32, Result<Calibration, CalibrationError>)>,
    /// The area with the newest record.
    area: usize,
    has_damage: bool,
}

/// Keeps calibration records in two areas of a flash.
pub struct CalibrationStore<F> {
    flash: F,
    /// First byte of each area.
    areas: [u32; 2],
    /// Bytes of an area.
    size: u32,
}

impl<F: NorFlash> CalibrationStore<F> {
    /// Creates a store over two areas of `size` bytes that begin at `areas`: whole erase blocks of
    /// this flash, used for nothing else.
    pub const fn new(flash: F, areas: [u32; 2], size: u32) -> Self {
        assert!(PLACE.is_multiple_of(F::WRITE_SIZE) && size as usize >= PLACE);
        assert!((size as usize).is_multiple_of(F::ERASE_SIZE));
        Self { flash, areas, size }
    }

    /// Reads the newest record.
    pub fn load(&mut self) -> Stored {
        let found = self.scan();
        match found.newest {
            Some((_, Ok(calibration))) => Stored::Found(calibration),
            Some((_, Err(bad))) => Stored::Refused(bad),
            None if found.has_damage => Stored::Damaged,
            None => Stored::Missing,
        }
    }

    /// Erases the area without the newest record, unless it is blank. Called at start-up.
    ///
    /// # Errors
    /// [`StoreError::Erase`].
    pub fn prepare(&mut self) -> Result<(), StoreError> {
        let found = self.scan();
        let spare = usize::from(found.newest.is_some()) ^ found.area;
        if self.next_blank(spare, 0) != Some(0) {
            self.erase(spare)?;
        }
        Ok(())
    }

    /// Stores a record. Never erases.
    ///
    /// # Errors
    /// [`StoreError`]; the previous record is still valid.
    pub fn save(&mut self, calibration: &Calibration) -> Result<(), StoreError> {
        let found = self.scan();
        let number = found.newest.map_or(0, |(number, _)| number.wrapping_add(1));
        let place = encoded(number, calibration);
        let mut had_room = false;
        for area in [found.area, 1 - found.area] {
            had_room |= self.next_blank(area, 0).is_some();
            if self.write_into(area, &place) {
                return Ok(());
            }
        }
        Err(match had_room {
            true => StoreError::Write,
            false => StoreError::Full,
        })
    }

    /// Writes into the first blank place of an area that then reads back as written. Returns true
    /// if there is one.
    fn write_into(&mut self, area: usize, bytes: &[u8; PLACE]) -> bool {
        let mut from = 0;
        while let Some(place) = self.next_blank(area, from) {
            let at = self.at(area, place);
            let mut back = [0; PLACE];
            let written = self.flash.write(at, bytes).is_ok()
                && self.flash.read(at, &mut back).is_ok()
                && back == *bytes;
            if written {
                return true;
            }
            from = place + 1;
        }
        false
    }

    fn places(&self) -> u32 {
        (self.size / PLACE as u32).min(MAX_PLACES)
    }

    fn at(&self, area: usize, place: u32) -> u32 {
        let [first, second] = self.areas;
        let start = if area == 0 { first } else { second };
        start + place * PLACE as u32
    }

    fn next_blank(&mut self, area: usize, from: u32) -> Option<u32> {
        (from..self.places()).find(|place| matches!(self.read(area, *place), Place::Blank))
    }

    fn erase(&mut self, area: usize) -> Result<(), StoreError> {
        let from = self.at(area, 0);
        let erased = self.flash.erase(from, from + self.size);
        erased.map_err(|_| StoreError::Erase)
    }

    fn scan(&mut self) -> Contents {
        let mut found = Contents::default();
        for area in 0..2 {
            for place in 0..self.places() {
                match self.read(area, place) {
                    Place::Blank | Place::CutOff => {}
                    Place::Record(number, calibration) => {
                        let newer = |(known, _)| number.wrapping_sub(known) < u32::MAX / 2;
                        if found.newest.is_none_or(newer) {
                            found.newest = Some((number, calibration));
                            found.area = area;
                        }
                    }
                    Place::Damaged => found.has_damage = true,
                }
            }
        }
        found
    }

    fn read(&mut self, area: usize, place: u32) -> Place {
        let mut bytes = [0; PLACE];
        let at = self.at(area, place);
        let (written, mark) = bytes.split_at_mut(MARK_AT);
        // A word that was being written at a loss of power may be unreadable; the words before and
        // after it are readable.
        let is_whole = self.flash.read(at, written).is_ok();
        let is_read = self.flash.read(at + MARK_AT as u32, mark).is_ok();
        let is_blank = |bytes: &[u8]| bytes.iter().all(|byte| *byte == 0xFF);
        let is_unmarked = is_read && is_blank(mark);
        match decoded(written) {
            _ if !is_whole && is_unmarked => Place::CutOff,
            _ if !is_whole => Place::Damaged,
            Some((number, calibration)) => Place::Record(number, calibration),
            None if is_unmarked && is_blank(written) => Place::Blank,
            None if is_unmarked => Place::CutOff,
            None => Place::Damaged,
        }
    }
}

/// Decodes a place's record and number; `None` unless both are valid.
fn decoded(written: &[u8]) -> Option<(u32, Result<Calibration, CalibrationError>)> {
    let (number, rest) = written.split_first_chunk()?;
    let (check, record) = rest.split_first_chunk()?;
    let [number, check] = [number, check].map(|word| u32::from_le_bytes(*word));
    let calibration = match Calibration::decode(record) {
        Ok(calibration) => Ok(calibration),
        Err(RecordError::Invalid(bad)) => Err(bad),
        Err(_) => return None,
    };
    (check == !number).then_some((number, calibration))
}

/// Encodes a record and its number as a place's bytes.
fn encoded(number: u32, calibration: &Calibration) -> [u8; PLACE] {
    let mut place = [0xFF; PLACE];
    let mut buffer = [0; RECORD_BYTES];
    let record = calibration.encode(&mut buffer);
    let head = number
        .to_le_bytes()
        .into_iter()
        .chain((!number).to_le_bytes());
    for (to, from) in place.iter_mut().zip(head.chain(record.iter().copied())) {
        *to = from;
    }
    for (to, from) in place.iter_mut().skip(MARK_AT).zip(MARK) {
        *to = from;
    }
    place
}

#[cfg(test)]
mod tests;
