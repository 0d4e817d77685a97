//! A stream with a limit on the length of lines, for files of another kind, or devices, whose lines
//! do not end.

use std::io::{self, Read, Seek, SeekFrom};

/// Max bytes of a line; rows have a few hundred.
const MAX: usize = 1 << 20;

/// A stream that fails if a line is too long.
pub(super) struct Bounded<R> {
    stream: R,
    /// Bytes since the last line end.
    open: usize,
}

impl<R> Bounded<R> {
    pub(super) const fn new(stream: R) -> Self {
        Self { stream, open: 0 }
    }
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.stream.read(into)?;
        let bytes = into.get(..read).unwrap_or_default();
        self.open = match bytes.iter().rposition(|byte| *byte == b'\n') {
            Some(end) => read - end - 1,
            None => self.open + read,
        };
        if self.open > MAX {
            let why = format!("a line of more than {MAX} bytes: this is no CSV");
            return Err(io::Error::new(io::ErrorKind::InvalidData, why));
        }
        Ok(read)
    }
}

impl<R: Seek> Seek for Bounded<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.open = 0;
        self.stream.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endless_line_is_an_error() {
        let line = [&[b'1'; MAX][..], b"\n"].concat();
        let mut whole = Vec::new();
        let mut lines = Bounded::new(io::Cursor::new(line.repeat(3)));
        assert_eq!(
            lines.read_to_end(&mut whole).expect("lines"),
            3 * line.len()
        );
        let error = Bounded::new(io::repeat(0)).read_to_end(&mut whole);
        assert!(error.expect_err("endless").to_string().contains("no CSV"));
    }
}
