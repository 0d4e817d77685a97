//! A simulated ROM loader that follows AN3156 and UM0424 strictly, with injected faults. A request
//! in a state that does not allow it, or before the requested wait has ended, is an error.

use std::io;
use std::time::Duration;

use super::loader::{ControlPipe, request};

const FLASH: u64 = 0x0800_0000;
pub(super) const TRANSFER: usize = 1024;
/// Wait that the loader requests to write, ms.
const WRITE_MS: u64 = 5;

/// The parts of a chip's ROM loader that concern its flash.
#[derive(Debug)]
pub(super) struct Rom {
    /// The board with this chip.
    pub(super) board: &'static str,
    /// The loader's description of its flash.
    pub(super) words: &'static str,
    pub(super) flash_bytes: usize,
    /// Bytes of the smallest erasable unit.
    pub(super) page: usize,
    /// Bytes of the smallest writable unit; the loader refuses a part of one.
    pub(super) word: usize,
    /// Wait that the loader requests to erase, ms: a page of a G474, a sector of an H743.
    pub(super) erase_ms: u64,
}

pub(super) static G474: Rom = Rom {
    board: "nucleo-g474re",
    words: "@Internal Flash   /0x08000000/256*02Kg",
    flash_bytes: 512 * 1024,
    page: 2 * 1024,
    word: 8,
    erase_ms: 25,
};

/// Two banks of eight sectors.
pub(super) static H743: Rom = Rom {
    board: "nucleo-h743zi2",
    words: "@Internal Flash   /0x08000000/8*128Kg,8*128Kg",
    flash_bytes: 2048 * 1024,
    page: 128 * 1024,
    word: 32,
    erase_ms: 4_000,
};

/// States by their numbers (DFU 1.1, A.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum State {
    Idle = 2,
    DownloadSync = 3,
    Busy = 4,
    DownloadIdle = 5,
    ManifestSync = 6,
    Manifest = 7,
    UploadIdle = 9,
    Error = 10,
}

/// Operation on the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FlashOperation {
    Erased(u64),
    Wrote(u64, usize),
    Started(u64),
}

/// Injected faults of the loader.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Faults {
    /// Requests after which the loader is disconnected.
    pub(super) disconnected_after: Option<usize>,
    /// A cell of the flash that reads back a wrong bit.
    pub(super) bad_cell: Option<u64>,
    /// A page that cannot be erased.
    pub(super) stuck_page: Option<u64>,
    /// True if the flash is protected against reading.
    pub(super) protected: bool,
    /// True if no command ever completes.
    pub(super) always_busy: bool,
}

/// The loader.
pub(super) struct Scripted {
    pub(super) rom: &'static Rom,
    pub(super) flash: Vec<u8>,
    pub(super) state: State,
    status: u8,
    pointer: u64,
    /// The last block received.
    block: (u16, Vec<u8>),
    now: Duration,
    busy_until: Duration,
    requests: usize,
    pub(super) operations: Vec<FlashOperation>,
    pub(super) faults: Faults,
}

impl Scripted {
    /// Returns a chip whose flash is full of another program.
    pub(super) fn new(rom: &'static Rom, faults: Faults) -> Self {
        Self {
            rom,
            flash: vec![0xA5; rom.flash_bytes],
            state: State::Idle,
            status: 0,
            pointer: FLASH,
            block: (0, vec![]),
            now: Duration::ZERO,
            busy_until: Duration::ZERO,
            requests: 0,
            operations: vec![],
            faults,
        }
    }

    /// Returns the same chip, reset into its loader again, without faults.
    pub(super) fn reset(self) -> Self {
        Self {
            flash: self.flash,
            ..Self::new(self.rom, Faults::default())
        }
    }

    pub(super) fn requests(&self) -> usize {
        self.requests
    }

    fn count(&mut self) -> io::Result<()> {
        let has_started = matches!(self.operations.last(), Some(FlashOperation::Started(_)));
        if has_started
            || self
                .faults
                .disconnected_after
                .is_some_and(|n| self.requests >= n)
        {
            return Err(io::Error::new(io::ErrorKind::NotConnected, "unplugged"));
        }
        self.requests += 1;
        if self.state == State::Busy && self.now < self.busy_until {
            // A caller that does not wait as requested gets no answer.
            return Err(io::ErrorKind::TimedOut.into());
        }
        Ok(())
    }

    fn stall<T>(&mut self, status: u8) -> io::Result<T> {
        self.state = State::Error;
        self.status = status;
        Err(io::Error::new(io::ErrorKind::BrokenPipe, "stalled"))
    }

    fn place(&self, address: u64, bytes: usize) -> Option<usize> {
        let at = usize::try_from(address.checked_sub(FLASH)?).ok()?;
        (at + bytes <= self.rom.flash_bytes).then_some(at)
    }

    /// Executes the last block, and returns the next status.
    fn carry_out(&mut self) -> u8 {
        let (block, bytes) = std::mem::take(&mut self.block);
        if block >= 2 {
            return self.program(block, &bytes);
        }
        let [command, rest @ ..] = &bytes[..] else {
            return 0x0F;
        };
        let Ok(address) = <[u8; 4]>::try_from(rest) else {
            // An erase without an address erases everything.
            return 0x0F;
        };
        let address = u64::from(u32::from_le_bytes(address));
        let Some(at) = self.place(address, 1) else {
            return 0x01;
        };
        match command {
            0x21 => self.pointer = address,
            0x41 if self.faults.stuck_page == Some(address) => return 0x04,
            0x41 => {
                let bytes = self.rom.page;
                let page = at / bytes * bytes;
                self.flash[page..page + bytes].fill(0xFF);
                self.operations.push(FlashOperation::Erased(address));
            }
            _ => return 0x0F,
        }
        0
    }

    fn program(&mut self, block: u16, bytes: &[u8]) -> u8 {
        let address = self.pointer + u64::from(block - 2) * TRANSFER as u64;
        let Some(at) = self.place(address, bytes.len()) else {
            return 0x08;
        };
        let cells = &mut self.flash[at..at + bytes.len()];
        let whole = |n: usize| n.is_multiple_of(self.rom.word);
        if !whole(at) || !whole(bytes.len()) || cells.iter().any(|cell| *cell != 0xFF) {
            return 0x03;
        }
        cells.copy_from_slice(bytes);
        self.operations
            .push(FlashOperation::Wrote(address, bytes.len()));
        0
    }

    fn get_status(&mut self) -> [u8; 6] {
        let mut wait = 0;
        match self.state {
            State::DownloadSync => {
                let erases = self.block.0 == 0 && self.block.1.first() == Some(&0x41);
                wait = match erases {
                    true => self.rom.erase_ms,
                    false => WRITE_MS,
                };
                self.busy_until = self.now + Duration::from_millis(wait);
                self.state = State::Busy;
            }
            State::Busy if self.faults.always_busy => {}
            State::Busy => {
                self.status = self.carry_out();
                self.state = match self.status {
                    0 => State::DownloadIdle,
                    _ => State::Error,
                };
            }
            State::ManifestSync => {
                self.state = State::Manifest;
                self.operations.push(FlashOperation::Started(self.pointer));
            }
            _ => {}
        }
        let [a, b, c, ..] = wait.to_le_bytes();
        [self.status, a, b, c, self.state as u8, 0]
    }
}

impl ControlPipe for Scripted {
    fn read(&mut self, number: u8, value: u16, length: u16) -> io::Result<Vec<u8>> {
        self.count()?;
        match number {
            request::GETSTATUS => Ok(self.get_status().to_vec()),
            request::UPLOAD if self.faults.protected => self.stall(0x0B),
            request::UPLOAD
                if matches!(self.state, State::Idle | State::UploadIdle) && value >= 2 =>
            {
                let address = self.pointer + u64::from(value - 2) * TRANSFER as u64;
                let length = usize::from(length);
                let Some(at) = self.place(address, length).filter(|_| length <= TRANSFER) else {
                    return self.stall(0x08);
                };
                self.state = match length == TRANSFER {
                    true => State::UploadIdle,
                    false => State::Idle,
                };
                let mut bytes = self.flash[at..at + length].to_vec();
                let bad = self
                    .faults
                    .bad_cell
                    .and_then(|cell| cell.checked_sub(address));
                if let Some(byte) = bad.and_then(|at| bytes.get_mut(at as usize)) {
                    *byte ^= 0x10;
                }
                Ok(bytes)
            }
            _ => self.stall(0x0F),
        }
    }

    fn write(&mut self, number: u8, value: u16, bytes: &[u8]) -> io::Result<()> {
        self.count()?;
        let idle = matches!(self.state, State::Idle | State::DownloadIdle);
        match number {
            request::DNLOAD if idle && bytes.is_empty() => self.state = State::ManifestSync,
            request::DNLOAD if idle && bytes.len() <= TRANSFER && value != 1 => {
                self.block = (value, bytes.to_vec());
                self.state = State::DownloadSync;
            }
            request::CLRSTATUS if self.state == State::Error => {
                self.state = State::Idle;
                self.status = 0;
            }
            request::ABORT if !matches!(self.state, State::Error | State::Busy) => {
                self.state = State::Idle;
            }
            _ => return self.stall(0x0F),
        }
        Ok(())
    }

    fn wait(&mut self, time: Duration) {
        self.now += time;
    }
}
