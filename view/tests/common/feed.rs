//! A page's stream, read as a page reads it.

use std::io::{BufReader, Read, Write};
use std::net::TcpStream;

use re_chunk::Chunk;
use re_log_encoding::Decoder;
use re_log_types::LogMsg;

use super::HANG;

/// Lengths that no piece has: the session has ended; no piece for a while.
const END: u32 = 0;
const SIGN: u32 = u32::MAX;

/// The recording's entries, one piece at a time.
pub struct Feed(BufReader<TcpStream>);

impl Feed {
    /// Opens the stream at a path.
    pub fn open(port: u16, path: &str) -> Self {
        let mut line = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
        line.set_read_timeout(Some(HANG)).expect("a limit");
        write!(
            line,
            "GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n"
        )
        .expect("it is read");
        let mut from = BufReader::new(line);
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            from.read_exact(&mut byte).expect("a head");
            head.extend(byte);
        }
        Self(from)
    }

    fn length(&mut self) -> u32 {
        let mut length = [0; 4];
        self.0.read_exact(&mut length).expect("a piece");
        u32::from_le_bytes(length)
    }
}

impl Iterator for Feed {
    type Item = Vec<Chunk>;

    fn next(&mut self) -> Option<Vec<Chunk>> {
        let length = loop {
            match self.length() {
                END => return None,
                SIGN => {}
                length => break length,
            }
        };
        let mut piece = vec![0; length as usize];
        self.0.read_exact(&mut piece).expect("a piece");
        let messages = Decoder::<LogMsg>::decode_eager(piece.as_slice()).expect("an .rrd");
        let chunks = messages.filter_map(|message| match message.expect("a message") {
            LogMsg::ArrowMsg(store, rows) if store.is_recording() => {
                Some(Chunk::from_arrow_msg(&rows).expect("a chunk"))
            }
            _ => None,
        });
        Some(chunks.collect())
    }
}
