//! How a program ended, as words in a RAM that survives the reset.
//!
//! A board's panic and fault handlers write a [`CrashRecord`] where start-up
//! does not clear the memory, and reset. The next start reads it
//! ([`CrashRecord::read`]), clears it, and hands it to the application in the
//! boot report. Whatever else that RAM holds after power-up is not mistaken for
//! a crash: there is a magic word and a check sum.

use crc::{CRC_32_ISO_HDLC, Crc};
use hapterra_core::wire::status::{CRASH_FILE, Crash, CrashKind};
use heapless::String;

/// Words in a record.
pub const CRASH_WORDS: usize = 8 + FILE_WORDS;
const FILE_WORDS: usize = CRASH_FILE / 4;
/// Words that the check sum covers: all before it.
const COVERED: usize = CRASH_WORDS - 1;

/// "HAPX".
const MAGIC: u32 = 0x4841_5058;

/// Seldom used, so no table.
static CRC: Crc<u32, crc::NoTable> = Crc::<u32, crc::NoTable>::new(&CRC_32_ISO_HDLC);

/// A crash as plain words, to be written word by word.
///
/// | word | what |
/// | --- | --- |
/// | 0 | magic |
/// | 1 | kind |
/// | 2, 3 | pc, lr |
/// | 4 | fault status, or interrupt number |
/// | 5 | line |
/// | 6 | tick |
/// | 7-12 | end of the file's path, zeros after it |
/// | 13 | CRC-32 of the words before |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrashRecord([u32; CRASH_WORDS]);

impl CrashRecord {
    /// What the memory holds when there is nothing to tell.
    pub const NONE: [u32; CRASH_WORDS] = [0; CRASH_WORDS];

    /// A panic in `line` of `file`, `tick` ticks after the start.
    #[must_use]
    pub fn panic(file: &str, line: u32, tick: u32) -> Self {
        Self::new(CrashKind::Panic, [0, 0, 0, line, tick], file)
    }

    /// A hard fault at `pc`, called from about `lr`, with the fault `status`.
    #[must_use]
    pub fn hard_fault(pc: u32, lr: u32, status: u32, tick: u32) -> Self {
        Self::new(CrashKind::HardFault, [pc, lr, status, 0, tick], "")
    }

    /// An interrupt that has no handler.
    #[must_use]
    pub fn unhandled(number: i16, tick: u32) -> Self {
        let number = u32::from(number.cast_unsigned());
        Self::new(CrashKind::UnhandledInterrupt, [0, 0, number, 0, tick], "")
    }

    fn new(kind: CrashKind, figures: [u32; 5], file: &str) -> Self {
        let mut words = Self::NONE;
        let [pc, lr, status, line, tick] = figures;
        let head = [MAGIC, kind as u32, pc, lr, status, line, tick];
        for (word, value) in words.iter_mut().zip(head.into_iter().chain(packed(file))) {
            *word = value;
        }
        if let Some(last) = words.last_mut() {
            *last = 0;
        }
        let sum = sum(&words);
        if let Some(last) = words.last_mut() {
            *last = sum;
        }
        Self(words)
    }

    /// The words to write.
    #[must_use]
    pub const fn words(&self) -> &[u32; CRASH_WORDS] {
        &self.0
    }

    /// Reads what the memory holds; nothing if that is no crash.
    #[must_use]
    pub fn read(words: &[u32; CRASH_WORDS]) -> Option<Crash> {
        let [magic, kind, pc, lr, status, line, tick, file @ .., check] = words;
        if *magic != MAGIC || *check != sum(words) {
            return None;
        }
        let kind = [
            CrashKind::Panic,
            CrashKind::HardFault,
            CrashKind::UnhandledInterrupt,
        ]
        .into_iter()
        .find(|known| *known as u32 == *kind)?;
        Some(Crash {
            kind,
            pc: *pc,
            lr: *lr,
            status: *status,
            line: *line,
            tick: *tick,
            file: unpacked(file),
        })
    }
}

fn sum(words: &[u32; CRASH_WORDS]) -> u32 {
    let mut digest = CRC.digest();
    for word in words.iter().take(COVERED) {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

/// The end of `file` in words; characters that are not ASCII become `?`.
fn packed(file: &str) -> impl Iterator<Item = u32> {
    let skipped = file.len().saturating_sub(CRASH_FILE);
    let mut bytes = file.bytes().skip(skipped);
    (0..FILE_WORDS).map(move |_| {
        let mut next = || match bytes.next() {
            Some(byte) if byte.is_ascii_graphic() => byte,
            Some(_) => b'?',
            None => 0,
        };
        u32::from_le_bytes([next(), next(), next(), next()])
    })
}

fn unpacked(words: &[u32]) -> String<CRASH_FILE> {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes());
    let text = bytes.take_while(|byte| *byte != 0).map(char::from);
    // As many characters as there are bytes to hold them, all ASCII.
    let mut file = String::new();
    for character in text.filter(char::is_ascii) {
        let _ = file.push(character);
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_comes_back_with_its_place() {
        let record = CrashRecord::panic("firmware/src/link/session.rs", 321, 77);
        let crash = CrashRecord::read(record.words()).expect("a crash");
        assert_eq!(crash.kind, CrashKind::Panic);
        assert_eq!((crash.line, crash.tick), (321, 77));
        assert_eq!(crash.file.as_str(), "ware/src/link/session.rs");
        let short = CrashRecord::panic("a b.rs", 1, 0);
        let crash = CrashRecord::read(short.words()).expect("a crash");
        assert_eq!(crash.file.as_str(), "a?b.rs");
    }

    #[test]
    fn a_hard_fault_and_a_stray_interrupt_come_back() {
        let record = CrashRecord::hard_fault(0x0800_1234, 0x0800_4321, 0x8200, 9);
        let crash = CrashRecord::read(record.words()).expect("a crash");
        assert_eq!((crash.pc, crash.lr), (0x0800_1234, 0x0800_4321));
        assert_eq!((crash.status, crash.tick), (0x8200, 9));
        assert_eq!(crash.kind, CrashKind::HardFault);
        let record = CrashRecord::unhandled(54, 1);
        let crash = CrashRecord::read(record.words()).expect("a crash");
        assert_eq!(
            (crash.kind, crash.status),
            (CrashKind::UnhandledInterrupt, 54)
        );
    }

    #[test]
    fn no_flipped_bit_and_nothing_that_ram_holds_by_itself_is_a_crash() {
        let good = *CrashRecord::panic("x.rs", 1, 2).words();
        for bit in 0..32 * CRASH_WORDS {
            let mut bad = good;
            bad[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(CrashRecord::read(&bad), None, "bit {bit}");
        }
        for filling in [0, u32::MAX, 0xAAAA_AAAA, MAGIC] {
            assert_eq!(CrashRecord::read(&[filling; CRASH_WORDS]), None);
        }
    }
}
