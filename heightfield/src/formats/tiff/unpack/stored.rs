//! The bytes of a strip or tile as stored in the file, in pieces.

use std::io::{self, BufRead, Read};

use tiff_reader::TiffError;
use tiff_reader::source::TiffSource;

/// Size of a read, bytes.
const READ_BYTES: u64 = 256 << 10;

/// The stored bytes of a strip or tile, up to the end of the file.
pub(super) struct StoredBytes<'f> {
    source: &'f dyn TiffSource,
    next: u64,
    end: u64,
    /// True if the bits of each byte are reversed.
    is_reversed: bool,
    buffer: Vec<u8>,
    consumed: usize,
}

impl<'f> StoredBytes<'f> {
    /// Returns a reader of some bytes at an offset.
    pub(super) fn new(
        source: &'f dyn TiffSource,
        place: u64,
        bytes: u64,
        is_reversed: bool,
    ) -> Self {
        Self {
            source,
            next: place,
            end: place.saturating_add(bytes).min(source.len()),
            is_reversed,
            buffer: vec![],
            consumed: 0,
        }
    }
}

impl BufRead for StoredBytes<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.consumed == self.buffer.len() && self.next < self.end {
            let count = READ_BYTES.min(self.end - self.next);
            let buffer = self.source.read_exact_at(self.next, count as usize);
            self.buffer = buffer.map_err(|error| match error {
                TiffError::Io(error, _) => error,
                error => io::Error::other(error),
            })?;
            self.consumed = 0;
            self.next += count;
            if self.is_reversed {
                for byte in &mut self.buffer {
                    *byte = byte.reverse_bits();
                }
            }
        }
        Ok(&self.buffer[self.consumed..])
    }

    fn consume(&mut self, count: usize) {
        self.consumed += count;
    }
}

impl Read for StoredBytes<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(into.len());
        into[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}
