//! The USB loader in the chip's ROM: DFU 1.1 with ST's extensions (AN3156, UM0424).
//!
//! The block number of a download gives its meaning: block 0 is a command; blocks from 2 on are
//! data for the address pointer plus `(block − 2) × transfer size` bytes. The loader starts the
//! operation at a status request and replies with a wait time. The operation is complete if the
//! state is then `dfuDNLOAD-IDLE`.

use std::io;
use std::time::Duration;

use super::error::UpdateError;
use super::layout::Layout;

/// Requests of the DFU class.
pub mod request {
    /// Sends a block to the loader.
    pub const DNLOAD: u8 = 1;
    /// Reads a block from the loader.
    pub const UPLOAD: u8 = 2;
    /// Requests status and state.
    pub const GETSTATUS: u8 = 3;
    /// Clears an error.
    pub const CLRSTATUS: u8 = 4;
    /// Returns to idle.
    pub const ABORT: u8 = 6;
}

/// States of the loader.
const IDLE: u8 = 2;
const DNLOAD_SYNC: u8 = 3;
const DNBUSY: u8 = 4;
const DNLOAD_IDLE: u8 = 5;
const MANIFEST_SYNC: u8 = 6;
const MANIFEST: u8 = 7;
const ERROR: u8 = 10;

/// Commands of block 0.
const SET_ADDRESS: u8 = 0x21;
const ERASE: u8 = 0x41;
/// Number of the block at the address pointer.
const FIRST_BLOCK: u16 = 2;

/// Bits of the functional descriptor's attributes.
const CAN_DOWNLOAD: u8 = 1 << 0;
const CAN_UPLOAD: u8 = 1 << 1;
/// The descriptor's type.
const FUNCTIONAL: u8 = 0x21;
/// Longest transfer used; STM32 loaders report 1,024 or 2,048.
const MAX_TRANSFER_BYTES: u16 = 4096;

/// Time limit of one operation; an H743's sector takes at most 4 s (its data sheet).
const TIMEOUT: Duration = Duration::from_secs(30);
/// Attempts to make a loader idle.
const MAX_ATTEMPTS: usize = 8;

/// Control transfers to the loader's interface.
pub trait ControlPipe {
    /// Sends a class request that reads at most `length` bytes.
    ///
    /// # Errors
    /// The device is disconnected, refuses or does not respond.
    fn read(&mut self, request: u8, value: u16, length: u16) -> io::Result<Vec<u8>>;

    /// Sends a class request that writes.
    ///
    /// # Errors
    /// As for [`Self::read`].
    fn write(&mut self, request: u8, value: u16, bytes: &[u8]) -> io::Result<()>;

    /// Waits without any request to the device.
    fn wait(&mut self, time: Duration);
}

/// Answer of a loader to a status query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Status {
    status: u8,
    wait: Duration,
    state: u8,
}

/// A loader at the end of a pipe.
pub struct Loader<P> {
    pipe: P,
    /// The loader's description of its flash.
    layout: Layout,
    /// Bytes of a transfer.
    transfer: u16,
}

impl<P: ControlPipe> Loader<P> {
    /// Checks a loader's description of its flash and its functional descriptor, and makes it idle.
    ///
    /// # Errors
    /// [`UpdateError`]: the loader is unsuitable or does not respond.
    pub fn open(pipe: P, description: &str, functional: &[u8]) -> Result<Self, UpdateError> {
        let layout = Layout::read(description)?;
        let (attributes, transfer) = match functional {
            [_, FUNCTIONAL, attributes, _, _, low, high, ..] => {
                (*attributes, u16::from_le_bytes([*low, *high]))
            }
            _ => return Err(UpdateError::Cannot("report its capabilities")),
        };
        if attributes & CAN_DOWNLOAD == 0 {
            return Err(UpdateError::Cannot("write"));
        }
        if attributes & CAN_UPLOAD == 0 {
            return Err(UpdateError::Cannot("read back the written bytes"));
        }
        // A transfer contains only whole words of flash.
        let transfer = transfer.min(MAX_TRANSFER_BYTES) / 32 * 32;
        if transfer == 0 {
            return Err(UpdateError::Cannot("accept whole words of flash"));
        }
        let mut loader = Self {
            pipe,
            layout,
            transfer,
        };
        loader.make_idle("begin")?;
        Ok(loader)
    }

    /// Returns the loader's description of its flash.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the pipe.
    pub fn into_pipe(self) -> P {
        self.pipe
    }

    /// Erases the page that begins at an address.
    ///
    /// # Errors
    /// [`UpdateError`].
    pub fn erase(&mut self, address: u64) -> Result<(), UpdateError> {
        self.command(ERASE, address, "erase a page")
    }

    /// Writes `bytes` to erased flash at an address.
    ///
    /// # Errors
    /// [`UpdateError`].
    pub fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), UpdateError> {
        const OPERATION: &str = "write";
        self.command(SET_ADDRESS, address, OPERATION)?;
        for (block, chunk) in (FIRST_BLOCK..).zip(bytes.chunks(self.transfer.into())) {
            self.send_block(block, chunk, OPERATION)?;
        }
        Ok(())
    }

    /// Reads `bytes` bytes of flash from an address.
    ///
    /// # Errors
    /// [`UpdateError`].
    pub fn read(&mut self, address: u64, bytes: usize) -> Result<Vec<u8>, UpdateError> {
        const OPERATION: &str = "read back";
        self.command(SET_ADDRESS, address, OPERATION)?;
        // A loader returns blocks only if it is idle or already reading.
        self.make_idle(OPERATION)?;
        let mut all = Vec::with_capacity(bytes);
        let mut block = FIRST_BLOCK;
        while all.len() < bytes {
            let length = (bytes - all.len()).min(self.transfer.into()) as u16;
            let got = self.pipe.read(request::UPLOAD, block, length);
            let got = got.map_err(|source| self.failure(OPERATION, source))?;
            if got.len() != usize::from(length) {
                return Err(UpdateError::Cannot("read back the written bytes"));
            }
            all.extend(got);
            block = block.wrapping_add(1);
        }
        self.make_idle(OPERATION)?;
        Ok(all)
    }

    /// Ends the loader and starts the program at an address.
    ///
    /// # Errors
    /// [`UpdateError`].
    pub fn start_program(&mut self, address: u64) -> Result<(), UpdateError> {
        const OPERATION: &str = "start the program";
        self.command(SET_ADDRESS, address, OPERATION)?;
        let sent = self.pipe.write(request::DNLOAD, 0, &[]);
        sent.map_err(|source| UpdateError::Disconnected {
            operation: OPERATION,
            source,
        })?;
        // The loader ends at the status request, possibly before it replies.
        match self.status(OPERATION) {
            Ok(status) if matches!(status.state, MANIFEST | MANIFEST_SYNC) => Ok(()),
            Ok(status) => Err(refusal(OPERATION, status)),
            Err(_) => Ok(()),
        }
    }

    fn command(
        &mut self,
        command: u8,
        address: u64,
        operation: &'static str,
    ) -> Result<(), UpdateError> {
        let [a, b, c, d, ..] = address.to_le_bytes();
        self.send_block(0, &[command, a, b, c, d], operation)
    }

    /// Sends a block to the loader and waits until it is processed.
    fn send_block(
        &mut self,
        block: u16,
        bytes: &[u8],
        operation: &'static str,
    ) -> Result<(), UpdateError> {
        let sent = self.pipe.write(request::DNLOAD, block, bytes);
        sent.map_err(|source| self.failure(operation, source))?;
        let mut waited = Duration::ZERO;
        while waited < TIMEOUT {
            let status = self.status(operation)?;
            match status.state {
                DNLOAD_IDLE if status.status == 0 => return Ok(()),
                DNBUSY | DNLOAD_SYNC if status.status == 0 => {
                    // A loader must not block the host for ever or make it spin.
                    let wait = status.wait.clamp(Duration::from_millis(1), TIMEOUT);
                    self.pipe.wait(wait);
                    waited += wait;
                }
                _ => return Err(refusal(operation, status)),
            }
        }
        Err(UpdateError::Endless(operation))
    }

    /// Returns the error of a failed transfer: the loader's status, if it still responds.
    fn failure(&mut self, operation: &'static str, source: io::Error) -> UpdateError {
        match self.status(operation) {
            Ok(status) if status.state == ERROR => refusal(operation, status),
            _ => UpdateError::Disconnected { operation, source },
        }
    }

    /// Makes the loader `dfuIDLE` from any state.
    fn make_idle(&mut self, operation: &'static str) -> Result<(), UpdateError> {
        for _ in 0..MAX_ATTEMPTS {
            let status = self.status(operation)?;
            let number = match status.state {
                IDLE => return Ok(()),
                ERROR => request::CLRSTATUS,
                DNBUSY => {
                    self.pipe.wait(status.wait.min(TIMEOUT));
                    continue;
                }
                _ => request::ABORT,
            };
            let done = self.pipe.write(number, 0, &[]);
            done.map_err(|source| UpdateError::Disconnected { operation, source })?;
        }
        Err(UpdateError::Endless(operation))
    }

    fn status(&mut self, operation: &'static str) -> Result<Status, UpdateError> {
        let answer = self.pipe.read(request::GETSTATUS, 0, 6);
        let answer = answer.map_err(|source| UpdateError::Disconnected { operation, source })?;
        let [status, low, middle, high, state, _] = answer[..] else {
            return Err(UpdateError::Cannot("report its status"));
        };
        let ms = u32::from_le_bytes([low, middle, high, 0]);
        Ok(Status {
            status,
            wait: Duration::from_millis(ms.into()),
            state,
        })
    }
}

fn refusal(operation: &'static str, Status { status, state, .. }: Status) -> UpdateError {
    UpdateError::Refused {
        operation,
        why: meaning(status),
        status,
        state,
    }
}

/// Returns the meaning of a status (DFU 1.1, 6.1.2; ST redefines some).
const fn meaning(status: u8) -> &'static str {
    match status {
        0x00 => "it is not in the expected state",
        0x01 => "it cannot write this address",
        0x02 => "the bytes are not for this device",
        0x03 => "its flash cannot be written",
        0x04 => "its flash cannot be erased",
        0x08 => "the address is out of its range",
        0x0B => "its flash is protected against reading",
        0x0F => "it did not expect that request",
        _ => "it does not report the reason",
    }
}
