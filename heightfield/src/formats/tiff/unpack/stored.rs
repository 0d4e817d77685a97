//! The bytes of a strip or tile as stored in the file, in pieces.

use std::io::{self, BufRead, Read};

use tiff_reader::TiffError;
use tiff_reader::source::TiffSource;

/// Size of a read, bytes.
const PIECE: u64 = 256 << 10;

/// The stored bytes of a strip or tile, up to the end of the file.
pub(super) struct StoredBytes<'f> {
    source: &'f dyn TiffSource,
    next: u64,
    end: u64,
    /// True if the bits of each byte are reversed.
    is_reversed: bool,
    piece: Vec<u8>,
    taken: usize,
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
            piece: vec![],
            taken: 0,
        }
    }
}

impl BufRead for StoredBytes<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.taken == self.piece.len() && self.next < self.end {
            let count = PIECE.min(self.end - self.next);
            let piece = self.source.read_exact_at(self.next, count as usize);
            self.piece = piece.map_err(|error| match error {
                TiffError::Io(error, _) => error,
                error => io::Error::other(error),
            })?;
            self.taken = 0;
            self.next += count;
            if self.is_reversed {
                for byte in &mut self.piece {
                    *byte = byte.reverse_bits();
                }
            }
        }
        Ok(&self.piece[self.taken..])
    }

    fn consume(&mut self, count: usize) {
        self.taken += count;
    }
}

impl Read for StoredBytes<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let there = self.fill_buf()?;
        let count = there.len().min(into.len());
        into[..count].copy_from_slice(&there[..count]);
        self.consume(count);
        Ok(count)
    }
}
