//! Words separated by white space, from a file of any length and line ends.

use std::io::{BufReader, Bytes, Read};

use crate::RasterError;

/// Longer words are neither numbers nor keys: the file is not text.
const MAX_WORD: usize = 128;

/// A reader of one word at a time.
pub(super) struct Tokens<R> {
    bytes: Bytes<BufReader<R>>,
    word: Vec<u8>,
    /// True if the current word is returned again.
    repeats: bool,
}

impl<R: Read> Tokens<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            // This buffer makes reading single bytes fast for any reader.
            bytes: BufReader::with_capacity(1 << 16, reader).bytes(),
            word: Vec::new(),
            repeats: false,
        }
    }

    /// Returns the next word, or `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<&str>, RasterError> {
        if !std::mem::take(&mut self.repeats) {
            self.read_word()?;
        }
        if self.word.is_empty() {
            return Ok(None);
        }
        match std::str::from_utf8(&self.word) {
            Ok(word) => Ok(Some(word)),
            Err(_) => Err(RasterError::damaged("it is not text")),
        }
    }

    /// Makes `next` return the last word again.
    pub(super) fn put_back(&mut self) {
        self.repeats = true;
    }

    fn read_word(&mut self) -> Result<(), RasterError> {
        self.word.clear();
        for byte in self.bytes.by_ref() {
            let byte = byte.map_err(RasterError::Unreadable)?;
            if !is_space(byte) {
                self.word.push(byte);
            } else if !self.word.is_empty() {
                break;
            }
            if self.word.len() > MAX_WORD {
                return Err(RasterError::damaged(format!(
                    "it has a word of more than {MAX_WORD} bytes: not a grid of numbers"
                )));
            }
        }
        Ok(())
    }
}

/// Returns true for white space, and for end-of-file bytes of old editors.
fn is_space(byte: u8) -> bool {
    byte.is_ascii_whitespace() || matches!(byte, 0x0b | 0x1a | 0x00)
}
