//! End of a program, as bytes in a RAM that survives the reset.
//!
//! A board's panic and fault handlers write a [`CrashRecord`] to memory that start-up does not
//! clear, and reset. The next start reads it ([`CrashRecord::read`]), clears it, and passes it to
//! the application in the boot report. Random content after a power-up is not read as a crash: a
//! record begins with a magic number, ends with a checksum, and zeros follow it.

use hapterra_core::crc;
use hapterra_core::wire::status::{CRASH_FILE, Crash, CrashKind};
use heapless::String;

/// Maximum bytes of a record, in whole words: a magic number, the fields of [`Crash`] as postcard
/// writes them, and the CRC-32 of both.
pub const CRASH_BYTES: usize = 60;

/// "HAPX".
const MAGIC: u32 = 0x4841_5058;
/// "HAPB": the magic number of a minimal record.
const BARE: u32 = 0x4841_5042;

/// All kinds of crashes.
const KINDS: [CrashKind; 5] = [
    CrashKind::Panic,
    CrashKind::HardFault,
    CrashKind::UnhandledInterrupt,
    CrashKind::StackOverflow,
    CrashKind::SupplyLow,
];

/// A crash as plain bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrashRecord([u8; CRASH_BYTES]);

impl CrashRecord {
    /// Content of the memory without a crash.
    pub const NONE: Self = Self([0; CRASH_BYTES]);

    /// Returns the first bytes to write: the kind of crash only, made without a serialiser, a
    /// checksum or a call. They remain if making the whole record fails.
    #[must_use]
    pub const fn bare(kind: CrashKind) -> Self {
        let words = [BARE, !BARE, kind as u32, !(kind as u32)];
        let mut bytes = [0; CRASH_BYTES];
        let mut at = 0;
        while at < 4 * words.len() {
            bytes[at] = words[at / 4].to_le_bytes()[at % 4];
            at += 1;
        }
        Self(bytes)
    }

    /// Creates the record of a panic in `line` of `file`, `tick` ticks after the start.
    #[must_use]
    pub fn panic(file: &str, line: u32, tick: u32) -> Self {
        Self::new(CrashKind::Panic, [0, 0, 0, line, tick], file)
    }

    /// Creates the record of a hard fault at `pc`, called from about `lr`, with the fault `status`.
    #[must_use]
    pub fn hard_fault(pc: u32, lr: u32, status: u32, tick: u32) -> Self {
        Self::new(CrashKind::HardFault, [pc, lr, status, 0, tick], "")
    }

    /// Creates the record of an interrupt without a handler.
    #[must_use]
    pub fn unhandled(number: i16, tick: u32) -> Self {
        let number = u32::from(number.cast_unsigned());
        Self::new(CrashKind::UnhandledInterrupt, [0, 0, number, 0, tick], "")
    }

    /// Creates the record of a stack overflow, at `pc` and `lr` if they could be stored, with the
    /// fault `status`.
    #[must_use]
    pub fn stack_overflow(pc: u32, lr: u32, status: u32, tick: u32) -> Self {
        Self::new(CrashKind::StackOverflow, [pc, lr, status, 0, tick], "")
    }

    /// Creates the record of a supply that fell too low.
    #[must_use]
    pub fn supply_low(tick: u32) -> Self {
        Self::new(CrashKind::SupplyLow, [0, 0, 0, 0, tick], "")
    }

    fn new(kind: CrashKind, [pc, lr, status, line, tick]: [u32; 5], path: &str) -> Self {
        // The end of the path; other characters than ASCII become `?`.
        let skipped = path.len().saturating_sub(CRASH_FILE);
        let mut file = String::new();
        for byte in path.bytes().skip(skipped) {
            let character = if byte.is_ascii_graphic() { byte } else { b'?' };
            let _ = file.push(character.into());
        }
        let crash = Crash {
            kind,
            pc,
            lr,
            status,
            line,
            tick,
            file,
        };
        let mut bytes = Self::NONE.0;
        // The longest crash fits.
        let _ = crc::put(&(MAGIC, crash), &mut bytes);
        Self(bytes)
    }

    /// Returns the bytes to write.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; CRASH_BYTES] {
        &self.0
    }

    /// Reads the memory's content; `None` if it is no crash.
    #[must_use]
    pub fn read(bytes: &[u8; CRASH_BYTES]) -> Option<Crash> {
        if let Some(kind) = KINDS.into_iter().find(|kind| Self::bare(*kind).0 == *bytes) {
            return Some(Crash {
                kind,
                pc: 0,
                lr: 0,
                status: 0,
                line: 0,
                tick: 0,
                file: String::new(),
            });
        }
        let ((magic, crash), rest): ((u32, Crash), _) = crc::take(bytes)?;
        (magic == MAGIC && rest.iter().all(|byte| *byte == 0)).then_some(crash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_record_fits() {
        let longest = CrashRecord::new(CrashKind::HardFault, [u32::MAX; 5], &"x".repeat(99));
        let crash = CrashRecord::read(longest.bytes()).expect("a crash");
        assert_eq!((crash.pc, crash.file.len()), (u32::MAX, CRASH_FILE));
    }

    #[test]
    fn panic_record_keeps_file_line_and_tick() {
        let record = CrashRecord::panic("firmware/src/link/session.rs", 321, 77);
        let crash = CrashRecord::read(record.bytes()).expect("a crash");
        assert_eq!(crash.kind, CrashKind::Panic);
        assert_eq!((crash.line, crash.tick), (321, 77));
        assert_eq!(crash.file.as_str(), "ware/src/link/session.rs");
        let short = CrashRecord::panic("a b.rs", 1, 0);
        let crash = CrashRecord::read(short.bytes()).expect("a crash");
        assert_eq!(crash.file.as_str(), "a?b.rs");
    }

    #[test]
    fn hard_fault_and_stray_interrupt_records_round_trip() {
        let record = CrashRecord::hard_fault(0x0800_1234, 0x0800_4321, 0x8200, 9);
        let crash = CrashRecord::read(record.bytes()).expect("a crash");
        assert_eq!((crash.pc, crash.lr), (0x0800_1234, 0x0800_4321));
        assert_eq!((crash.status, crash.tick), (0x8200, 9));
        assert_eq!(crash.kind, CrashKind::HardFault);
        let record = CrashRecord::unhandled(54, 1);
        let crash = CrashRecord::read(record.bytes()).expect("a crash");
        assert_eq!(
            (crash.kind, crash.status),
            (CrashKind::UnhandledInterrupt, 54)
        );
    }

    #[test]
    fn stack_overflow_and_low_supply_records_round_trip() {
        let record = CrashRecord::stack_overflow(1, 2, 0x82, 3);
        let crash = CrashRecord::read(record.bytes()).expect("a crash");
        assert_eq!(crash.kind, CrashKind::StackOverflow);
        assert_eq!((crash.pc, crash.lr, crash.status), (1, 2, 0x82));
        let record = CrashRecord::supply_low(9);
        let crash = CrashRecord::read(record.bytes()).expect("a crash");
        assert_eq!((crash.kind, crash.tick), (CrashKind::SupplyLow, 9));
    }

    /// Safety: images.
    #[test]
    fn bare_record_keeps_kind_and_rejects_flipped_bits() {
        for kind in KINDS {
            let bare = *CrashRecord::bare(kind).bytes();
            let crash = CrashRecord::read(&bare).expect("a crash");
            assert_eq!((crash.kind, crash.pc, crash.tick), (kind, 0, 0));
            for bit in 0..8 * CRASH_BYTES {
                let mut bad = bare;
                bad[bit / 8] ^= 1 << (bit % 8);
                assert_eq!(CrashRecord::read(&bad), None, "bit {bit}");
            }
        }
    }

    #[test]
    fn flipped_bits_and_uninitialised_ram_are_not_a_crash() {
        let good = *CrashRecord::panic("x.rs", 1, 2).bytes();
        for bit in 0..8 * CRASH_BYTES {
            let mut bad = good;
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(CrashRecord::read(&bad), None, "bit {bit}");
        }
        for filling in [0, u32::MAX, 0xAAAA_AAAA, MAGIC] {
            let words = [filling.to_le_bytes(); CRASH_BYTES / 4];
            let bytes = words.concat().try_into().expect("whole words");
            assert_eq!(CrashRecord::read(&bytes), None);
        }
    }
}
