//! The host's files: frames in, records out.

use core::ffi::CStr;

use hapterra_core::Vec3;
use hapterra_core::grid::GridPoint;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode};
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use serde::Deserialize;

use crate::RECORD;

/// Bytes of one read request to the host.
const CHUNK: usize = 4096;

/// A file of frames.
pub(crate) struct Frames {
    file: File,
    reader: FrameReader<MAX_FRAME>,
    chunk: [u8; CHUNK],
    from: usize,
    to: usize,
}

impl Frames {
    pub(crate) fn open(path: &CStr) -> Self {
        Self {
            file: File::open(path).expect("the host left the file here"),
            reader: FrameReader::new(),
            chunk: [0; CHUNK],
            from: 0,
            to: 0,
        }
    }

    /// Returns the next message; `None` at the end of the file.
    pub(crate) fn next<'a, T: Deserialize<'a>>(&'a mut self) -> Option<T> {
        // The frame is found by its length first: the value that `push` returns cannot be kept
        // while the loop continues.
        loop {
            if self.from == self.to {
                self.to = self.file.read(&mut self.chunk).expect("readable");
                self.from = 0;
                if self.to == 0 {
                    return None;
                }
            }
            let bytes = &self.chunk[self.from..self.to];
            let end = bytes.iter().position(|byte| *byte == 0);
            if let Some(end) = end {
                self.from += end + 1;
                let (_, frame) = self.reader.push(&bytes[..=end]);
                let frame = frame.expect("a frame").expect("well encoded");
                return Some(decode(frame).expect("a valid message"));
            }
            let _ = self.reader.push(bytes);
            self.from = self.to;
        }
    }
}

/// The file of records.
pub(crate) struct Records(File);

impl Records {
    pub(crate) fn create(path: &CStr) -> Self {
        Self(File::create(path).expect("the folder can be written to"))
    }

    pub(crate) fn add(&mut self, first: [u32; 4], vector: Vec3, at: &GridPoint) {
        let words = first
            .into_iter()
            .chain(vector.to_array().map(f32::to_bits))
            .chain(at.cell().map(i32::cast_unsigned))
            .chain(at.frac().to_array().map(f32::to_bits));
        let mut bytes = [0; 4 * RECORD];
        for (four, word) in bytes.chunks_exact_mut(4).zip(words) {
            four.copy_from_slice(&word.to_le_bytes());
        }
        self.0.write_all(&bytes).expect("written");
    }
}
