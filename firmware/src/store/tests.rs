//! The store on a flash whose power fails.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use std::vec;
use std::vec::Vec;

use hapterra_core::phantom::CalibrationField;

use super::*;

/// A flash in memory: writing only clears bits, a word is written once, and the power fails after a
/// given number of words and blocks.
#[derive(Clone)]
struct Flash<const WRITE: usize, const ERASE: usize> {
    bytes: Vec<u8>,
    /// Steps (words written, blocks erased) until the power fails.
    left: usize,
    steps: usize,
    /// True if a word that was cut off cannot be read, as on chips with a checksum for each word.
    /// Otherwise it reads as its partial content.
    checks: bool,
    /// Words that cannot be read.
    unreadable: Vec<usize>,
}

#[derive(Debug)]
struct Failed;

impl NorFlashError for Failed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<const WRITE: usize, const ERASE: usize> Flash<WRITE, ERASE> {
    fn new(size: usize) -> Self {
        Self {
            bytes: vec![0xFF; size],
            left: usize::MAX,
            steps: 0,
            checks: false,
            unreadable: vec![],
        }
    }

    /// Returns an error if the power has failed before this step, else true if it fails during it.
    fn step(&mut self) -> Result<bool, Failed> {
        self.steps += 1;
        match self.left {
            0 => Err(Failed),
            left => {
                self.left = left - 1;
                Ok(left == 1)
            }
        }
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for Flash<WRITE, ERASE> {
    type Error = Failed;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for Flash<WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failed> {
        let range = offset as usize..offset as usize + bytes.len();
        let is_in = |word: &usize| *word < range.end && word + WRITE > range.start;
        if self.unreadable.iter().any(is_in) {
            return Err(Failed);
        }
        bytes.copy_from_slice(&self.bytes[range]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for Flash<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failed> {
        assert!((from | to).is_multiple_of(ERASE as u32));
        for block in (from as usize..to as usize).step_by(ERASE) {
            let cut = self.step()?;
            // After a cut, half of the block is unchanged.
            let half = if cut { ERASE / 2 } else { ERASE };
            self.bytes[block..block + half].fill(0xFF);
            self.unreadable
                .retain(|word| !(block..block + half).contains(word));
            if cut && self.checks {
                self.unreadable.push(block + half);
            }
            if cut {
                return Err(Failed);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failed> {
        assert!(offset.is_multiple_of(WRITE as u32) && bytes.len().is_multiple_of(WRITE));
        for (i, word) in bytes.chunks(WRITE).enumerate() {
            let cut = self.step()?;
            let at = offset as usize + i * WRITE;
            let place = &mut self.bytes[at..at + WRITE];
            if place.iter().any(|byte| *byte != 0xFF) {
                return Err(Failed); // programmed once already: its ECC is set
            }
            for (to, from) in place.iter_mut().zip(word) {
                // After a cut, some bits are not cleared yet.
                *to &= if cut { from | 0x5A } else { *from };
            }
            if cut && self.checks {
                self.unreadable.push(at);
            }
            if cut {
                return Err(Failed);
            }
        }
        Ok(())
    }
}

fn numbered(n: usize) -> Calibration {
    Calibration {
        l1_mm: 100.0 + 0.5 * n as f32,
        ..Calibration::PREMIUM_1_5
    }
}

/// Returns a store on a flash of this kind, as after a reset.
fn store<const W: usize, const E: usize>(
    flash: Flash<W, E>,
    size: usize,
) -> CalibrationStore<Flash<W, E>> {
    let flash = Flash {
        left: usize::MAX,
        ..flash
    };
    CalibrationStore::new(flash, [0, size as u32], size as u32)
}

/// An older firmware may have accepted it.
///
/// Safety: 18.
#[test]
fn record_above_a_limit_is_refused_without_falling_back() {
    let mut store = store(Flash::<8, 2048>::new(4096), 2048);
    let mut hostile = Calibration::PREMIUM_1_5;
    hostile.peak_current_a.y = 20.0;
    store.save(&numbered(1)).expect("stored");
    store.save(&hostile).expect("stored");
    let Stored::Refused(bad) = store.load() else {
        panic!("taken");
    };
    let peak = (CalibrationField::PeakCurrent, Some(2));
    assert_eq!((bad.field, bad.axis), peak);
    // A valid one after it is stored.
    store.save(&numbered(2)).expect("stored");
    assert_eq!(store.load(), Stored::Found(numbered(2)));
}

#[test]
fn load_returns_missing_then_always_the_latest_record() {
    let mut store = store(Flash::<8, 2048>::new(4096), 2048);
    assert_eq!(store.load(), Stored::Missing);
    for n in 0..40 {
        store.prepare().expect("prepared");
        store.save(&numbered(n)).expect("saved");
        assert_eq!(store.load(), Stored::Found(numbered(n)), "{n}");
    }
}

#[test]
fn save_never_erases_and_reports_a_full_store() {
    full::<8, 2048>(2048, 2048 / PLACE);
    // A large sector is not used up.
    full::<32, 8192>(8192, 8);
}

fn full<const W: usize, const E: usize>(size: usize, places: usize) {
    let mut store = store(Flash::<W, E>::new(2 * size), size);
    let places = 2 * places;
    for n in 0..places {
        store.flash.steps = 0;
        store.save(&numbered(n)).expect("saved");
        assert_eq!(store.flash.steps, PLACE / W, "{n}: erased");
    }
    for _ in 0..3 {
        store.flash.steps = 0;
        assert_eq!(store.save(&numbered(99)), Err(StoreError::Full));
        assert_eq!(store.flash.steps, 0);
        assert_eq!(store.load(), Stored::Found(numbered(places - 1)));
    }
    store.prepare().expect("prepared");
    store.save(&numbered(99)).expect("saved");
    assert_eq!(store.load(), Stored::Found(numbered(99)));
}

/// Cuts the power at each step of each of `savings` savings.
fn cut_everywhere<const W: usize, const E: usize>(size: usize, savings: usize, checks: bool) {
    let mut flash = Flash::<W, E>::new(2 * size);
    flash.checks = checks;
    let mut cuts = 0;
    for n in 0..savings {
        let mut whole = store(flash.clone(), size);
        whole.prepare().expect("prepared");
        flash = whole.flash.clone();
        whole.flash.steps = 0;
        whole.save(&numbered(n)).expect("saved");
        for left in 1..=whole.flash.steps {
            let mut failing = store(flash.clone(), size);
            failing.flash.left = left;
            // The last step may be cut after all bits were already correct.
            let _ = failing.save(&numbered(n));
            let mut after = store(failing.flash, size);
            let found = after.load();
            let old = match n {
                0 => found == Stored::Missing,
                n => found == Stored::Found(numbered(n - 1)),
            };
            let new = found == Stored::Found(numbered(n));
            assert!(old || new, "saving {n} cut at {left}: {found:?}");
            // The store continues to work.
            after.prepare().expect("prepared");
            after.save(&numbered(n + 100)).expect("saved");
            assert_eq!(after.load(), Stored::Found(numbered(n + 100)));
            cuts += 1;
        }
        flash = whole.flash;
    }
    assert!(cuts > 9 * savings, "{cuts}");
}

/// Safety: 17.
#[test]
fn power_lost_at_any_step_leaves_the_old_record_or_the_new() {
    for checks in [false, true] {
        // As on a G474, an H743 (shortened), and with blocks smaller than a place.
        cut_everywhere::<8, 2048>(2048, 30, checks);
        cut_everywhere::<32, 8192>(8192, 80, checks);
        cut_everywhere::<4, 256>(512, 10, checks);
    }
}

/// Cuts the power during the erase at start-up.
#[test]
fn power_lost_while_erasing_leaves_the_newest_record() {
    let mut full = store(Flash::<4, 256>::new(2 * 1024), 1024);
    let mut n = 0;
    while full.save(&numbered(n)).is_ok() {
        n += 1;
    }
    for (left, checks) in (1..=4).flat_map(|left| [(left, false), (left, true)]) {
        let mut failing = store(full.flash.clone(), 1024);
        failing.flash.left = left;
        failing.flash.checks = checks;
        let _ = failing.prepare();
        let mut after = store(failing.flash, 1024);
        assert_eq!(
            after.load(),
            Stored::Found(numbered(n - 1)),
            "cut at {left}"
        );
        after.prepare().expect("prepared");
        after.save(&numbered(77)).expect("saved");
    }
}

#[test]
fn garbage_is_damaged_and_can_be_overwritten() {
    let mut flash = Flash::<8, 2048>::new(4096);
    flash.bytes.fill(0xA5);
    let mut store = store(flash, 2048);
    assert_eq!(store.load(), Stored::Damaged);
    store.prepare().expect("prepared");
    store.save(&numbered(1)).expect("saved");
    assert_eq!(store.load(), Stored::Found(numbered(1)));
}

#[test]
fn flipped_bit_in_the_only_record_is_detected() {
    let mut fresh = store(Flash::<8, 2048>::new(4096), 2048);
    fresh.save(&numbered(1)).expect("saved");
    let mut buffer = [0; RECORD_BYTES];
    let length = HEAD + numbered(1).encode(&mut buffer).len();
    for bit in 0..8 * length {
        let mut flash = fresh.flash.clone();
        flash.bytes[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(store(flash, 2048).load(), Stored::Damaged, "bit {bit}");
    }
}
