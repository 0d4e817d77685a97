//! Words separated by white space, from a file of any length and line ends.

use std::io::BufRead;

use crate::raster::Fault;

/// No number or key is longer; what is, is not text.
const LONGEST_WORD: usize = 128;

/// Hands out one word at a time.
pub(super) struct Tokens<R> {
    reader: R,
    word: Vec<u8>,
    /// The current word is handed out once more.
    again: bool,
}

impl<R: BufRead> Tokens<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            word: Vec::new(),
            again: false,
        }
    }

    /// The next word, or `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<&str>, Fault> {
        if !std::mem::take(&mut self.again) {
            self.read_word()?;
        }
        if self.word.is_empty() {
            return Ok(None);
        }
        match std::str::from_utf8(&self.word) {
            Ok(word) => Ok(Some(word)),
            Err(_) => Err(Fault::damaged("it is not text")),
        }
    }

    /// The word handed out last is handed out again.
    pub(super) fn put_back(&mut self) {
        self.again = true;
    }

    fn read_word(&mut self) -> Result<(), Fault> {
        self.word.clear();
        loop {
            let buffer = self.reader.fill_buf().map_err(Fault::Unreadable)?;
            if buffer.is_empty() {
                return Ok(());
            }
            let start = if self.word.is_empty() {
                buffer.iter().position(|&byte| !is_space(byte))
            } else {
                Some(0)
            };
            let Some(start) = start else {
                let skipped = buffer.len();
                self.reader.consume(skipped);
                continue;
            };
            let rest = &buffer[start..];
            let end = rest.iter().position(|&byte| is_space(byte));
            let taken = &rest[..end.unwrap_or(rest.len())];
            if self.word.len() + taken.len() > LONGEST_WORD {
                return Err(Fault::damaged(format!(
                    "it has a word of more than {LONGEST_WORD} bytes: not a grid of numbers"
                )));
            }
            self.word.extend_from_slice(taken);
            let consumed = start + taken.len();
            self.reader.consume(consumed);
            if end.is_some() {
                return Ok(());
            }
        }
    }
}

/// White space, and what editors of other times put at the ends of files.
fn is_space(byte: u8) -> bool {
    byte.is_ascii_whitespace() || matches!(byte, 0x0b | 0x1a | 0x00)
}
