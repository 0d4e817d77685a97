//! The `#` lines before a CSV header, and a stream that is read again from its beginning.

use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};

use super::bounded::Bounded;

/// Max bytes of comments that are read: settings have less than two thousand.
const MAX_LINE_BYTES: usize = 1 << 16;
/// A byte order mark, which some editors write.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// A stream whose first bytes were already read and are returned again. Positions count from its
/// beginning.
pub(super) struct Rewound<R> {
    head: Cursor<Vec<u8>>,
    remaining: BufReader<Bounded<R>>,
}

/// Reads the comments before the first other line. Returns them without their `#` and a space after
/// it, and the stream from its beginning.
pub(super) fn split<R: Read>(stream: R) -> io::Result<(String, Rewound<R>)> {
    let mut remaining = BufReader::with_capacity(1 << 16, Bounded::new(stream));
    let (mut head, mut comments) = (Vec::new(), String::new());
    while head.len() < MAX_LINE_BYTES {
        let from = head.len();
        remaining
            .by_ref()
            .take((MAX_LINE_BYTES - from) as u64)
            .read_until(b'\n', &mut head)?;
        let line = head.get(from..).unwrap_or_default();
        let line = line.strip_prefix(MARK).unwrap_or(line);
        let Some(comment) = line.strip_prefix(b"#") else {
            break;
        };
        let comment = comment.strip_prefix(b" ").unwrap_or(comment);
        comments += &String::from_utf8_lossy(comment);
    }
    let head = Cursor::new(head);
    Ok((comments, Rewound { head, remaining }))
}

impl<R: Read> Read for Rewound<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self.head.read(into)? {
            0 => self.remaining.read(into),
            read => Ok(read),
        }
    }
}

impl<R: Seek> Seek for Rewound<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        // The bytes in `head` are part of the stream.
        self.head.set_position(self.head.get_ref().len() as u64);
        self.remaining.seek(to)
    }
}

/// First words of a comment block for a placement or a mark.
const LATER: [&[u8]; 2] = [b"[[view]]", b"[[mark]]"];
/// Max bytes of such blocks that are read: a placement has less than four hundred.
const MAX_BYTES: usize = 1 << 24;

/// Reads the comments between rows that describe placements and marks, without their `#` and a
/// space after it. Other comments are skipped, and so is one after the last row: it may be
/// incomplete because its writer was killed.
pub(super) fn later(stream: impl Read) -> io::Result<String> {
    let (mut reader, mut line) = (
        BufReader::with_capacity(1 << 16, Bounded::new(stream)),
        Vec::new(),
    );
    let (mut found, mut block) = (String::new(), String::new());
    let (mut is_meant, mut was_comment) = (false, true);
    while found.len() < MAX_BYTES {
        line.clear();
        if reader.read_until(b'\n', &mut line)? == 0 {
            break;
        }
        let comment = line.strip_prefix(b"#");
        let comment = comment.map(|text| text.strip_prefix(b" ").unwrap_or(text));
        // Comments before the header are the settings, which were already read.
        let begins = comment.is_some() && !was_comment;
        was_comment = comment.is_some();
        match comment {
            Some(text) => {
                if begins {
                    is_meant = LATER.iter().any(|table| text.starts_with(table));
                }
                if is_meant && block.len() < MAX_BYTES {
                    block += &String::from_utf8_lossy(text);
                }
            }
            None => {
                is_meant = false;
                found += &std::mem::take(&mut block);
            }
        }
    }
    Ok(found)
}

/// Returns the number of empty lines and comments from here to the next row.
pub(super) fn lines_before_a_row(stream: impl Read) -> u64 {
    let (mut reader, mut line, mut count) = (BufReader::new(stream), Vec::new(), 0);
    loop {
        line.clear();
        let read = reader.read_until(b'\n', &mut line);
        let passed_over = line.starts_with(b"#") || line.trim_ascii().is_empty();
        if !passed_over || line.is_empty() || read.is_err() {
            return count;
        }
        count += 1;
    }
}

/// Returns true if the row that begins here is incomplete: the file ends in it.
pub(super) fn row_is_cut(stream: impl Read) -> bool {
    let (mut reader, mut line) = (BufReader::new(stream), Vec::new());
    loop {
        line.clear();
        let read = reader.read_until(b'\n', &mut line);
        let passed_over = line.starts_with(b"#") || line.trim_ascii().is_empty();
        if read.is_err() || line.is_empty() || !passed_over {
            return !line.is_empty() && !line.ends_with(b"\n");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(text: &[u8]) -> (String, Vec<u8>) {
        let (comments, mut again) = split(text).expect("in memory");
        let mut whole = Vec::new();
        again.read_to_end(&mut whole).expect("in memory");
        (comments, whole)
    }

    #[test]
    fn comments_are_separated_without_loss_of_bytes() {
        for (text, expected) in [
            (
                &b"# a = 1\n#\n#b\r\nt_s\n0\n# later\n"[..],
                "a = 1\n\nb\r\n",
            ),
            (b"\xef\xbb\xbf# a\nt_s", "a\n"),
            (b"t_s\n1\n", ""),
            (b"# a", "a"),
            (b"", ""),
        ] {
            assert_eq!(parts(text), (expected.to_owned(), text.to_vec()));
        }
        let endless = [b'#'; 3 * MAX_LINE_BYTES];
        assert_eq!(parts(&endless).1.len(), endless.len());
    }

    #[test]
    fn placements_between_rows_are_found_among_comments() {
        let text = "# a = 1\n# [[view]]\nt_s\n0\n# [[view]]\n# number = 1\n1\n# a remark\n\
                    # [[view]]\n2\n# [[mark]]\n# t_s = 1\n# [[view]]\r\n# number = 2\r\n3\n";
        let found = later(text.as_bytes()).expect("in memory");
        assert_eq!(
            found,
            "[[view]]\nnumber = 1\n[[mark]]\nt_s = 1\n[[view]]\r\nnumber = 2\r\n"
        );
        let cut = b"# a = 1\nt_s\n0\n# [[view]]\n# numb";
        assert_eq!(later(&cut[..]).expect("in memory"), "", "killed meanwhile");
        assert_eq!(later(&b""[..]).expect("in memory"), "");
    }

    #[test]
    fn non_row_lines_are_counted() {
        for (text, count) in [("1,2\n", 0), ("\n# a\n \r\n1,2\n", 3), ("", 0), ("#", 1)] {
            assert_eq!(lines_before_a_row(text.as_bytes()), count, "{text:?}");
        }
    }
}
