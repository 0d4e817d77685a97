//! Framing: postcard + CRC-32 + COBS, ended by a zero byte.

use heapless::Vec;
use postcard::ser_flavors::{Cobs, Flavor, Slice, crc::CrcModifier};
use serde::{Deserialize, Serialize};

use crate::crc::{self, CRC};

/// Maximum frame length in bytes, with its zero: a tile with materials and the bytes around it.
pub const MAX_FRAME: usize = 5120;

/// Reason why a frame was invalid. It is dropped; the link continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// The frame is longer than the reader's buffer.
    TooLong,
    /// The bytes are not valid COBS.
    Encoding,
    /// The check sum or the content is wrong.
    Content,
}

/// Writes `message` as one frame into `buffer`; returns the bytes to send, or `None` if it does not
/// fit.
pub fn encode<'b, T: Serialize + ?Sized>(message: &T, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let cobs = Cobs::try_new(Slice::new(buffer)).ok()?;
    let framing = Framing(CrcModifier::new(cobs, CRC.digest()));
    postcard::serialize_with_flavor(message, framing)
        .ok()
        .map(|frame| &*frame)
}

/// Check sum and COBS of a frame in progress. Each function is once in an image; otherwise it would
/// be copied to every place where a message's number is written.
struct Framing<'b>(CrcModifier<'static, Cobs<Slice<'b>>, u32>);

impl<'b> Flavor for Framing<'b> {
    type Output = &'b mut [u8];

    #[inline(never)]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.0.try_push(byte)
    }

    #[inline(never)]
    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        bytes.iter().try_for_each(|byte| self.try_push(*byte))
    }

    fn finalize(self) -> postcard::Result<Self::Output> {
        self.0.finalize()
    }
}

/// Reads a message from a frame's decoded bytes, check sum included.
///
/// # Errors
/// Returns [`FrameError::Content`] if the check sum is wrong, or if the bytes are not exactly one
/// `T`.
pub fn decode<'b, T: Deserialize<'b>>(bytes: &'b [u8]) -> Result<T, FrameError> {
    match crc::take(bytes) {
        Some((message, [])) => Ok(message),
        _ => Err(FrameError::Content),
    }
}

/// Reader that collects bytes into frames of up to `N` bytes.
#[derive(Default)]
pub struct FrameReader<const N: usize> {
    frame: Vec<u8, N>,
    overflowed: bool,
    /// True if the frame was returned: the next byte starts another.
    ended: bool,
}

impl<const N: usize> FrameReader<N> {
    /// Creates an empty reader.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frame: Vec::new(),
            overflowed: false,
            ended: false,
        }
    }

    /// Reads bytes up to and including the end of one frame.
    ///
    /// Returns the number of bytes read and, at a frame's end, its decoded bytes (for [`decode`])
    /// or an error. Empty frames are ignored: a sender may start with a zero to end earlier
    /// garbage.
    pub fn push(&mut self, bytes: &[u8]) -> (usize, Option<Result<&[u8], FrameError>>) {
        if self.ended {
            (self.ended, self.overflowed) = (false, false);
            self.frame.clear();
        }
        let end = bytes.iter().position(|b| *b == 0);
        let body = bytes.get(..end.unwrap_or(bytes.len())).unwrap_or(&[]);
        self.overflowed |= self.frame.extend_from_slice(body).is_err();
        let Some(end) = end else {
            return (bytes.len(), None);
        };
        self.ended = true;
        if self.overflowed {
            return (end + 1, Some(Err(FrameError::TooLong)));
        }
        if self.frame.is_empty() {
            return (end + 1, None);
        }
        let length = cobs::decode_in_place(&mut self.frame).ok();
        let decoded = length.and_then(|length| self.frame.get(..length));
        (end + 1, Some(decoded.ok_or(FrameError::Encoding)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn frames(reader: &mut FrameReader<64>, mut bytes: &[u8]) -> Vec<Result<u32, FrameError>> {
        let mut found = Vec::new();
        while !bytes.is_empty() {
            let (taken, frame) = reader.push(bytes);
            if let Some(frame) = frame {
                found.push(frame.and_then(decode));
            }
            bytes = &bytes[taken..];
        }
        found
    }

    fn frame(n: u32) -> Vec<u8> {
        encode(&n, &mut [0; 64]).unwrap().to_vec()
    }

    #[test]
    fn frames_decode_byte_by_byte_and_all_at_once() {
        let bytes = [frame(7), frame(0), frame(u32::MAX)].concat();
        let mut reader = FrameReader::new();
        assert_eq!(frames(&mut reader, &bytes), [Ok(7), Ok(0), Ok(u32::MAX)]);
        let one_by_one: Vec<_> = bytes
            .iter()
            .flat_map(|b| frames(&mut reader, &[*b]))
            .collect();
        assert_eq!(one_by_one, [Ok(7), Ok(0), Ok(u32::MAX)]);
    }

    #[test]
    fn reader_joins_in_the_middle_of_a_stream() {
        let bytes = [frame(123_456), frame(5)].concat();
        for cut in 1..frame(123_456).len() - 1 {
            let found = frames(&mut FrameReader::new(), &bytes[cut..]);
            assert_eq!(found.last(), Some(&Ok(5)));
            assert!(found.iter().filter(|f| f.is_ok()).count() == 1, "cut {cut}");
        }
    }

    #[test]
    fn frame_with_any_flipped_bit_is_rejected() {
        let good = frame(123_456);
        for bit in 0..good.len() * 8 {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            bad.extend(frame(5));
            let found = frames(&mut FrameReader::new(), &bad);
            let understood: Vec<_> = found.into_iter().flatten().collect();
            // A flip in the zero itself may also destroy the next frame.
            assert!(
                understood.iter().all(|n| *n == 5),
                "bit {bit}: {understood:?}"
            );
        }
    }

    #[test]
    fn endless_noise_is_dropped_and_the_next_frame_is_found() {
        let mut reader = FrameReader::new();
        assert_eq!(frames(&mut reader, &[0xA5; 1000]), []);
        let found = frames(&mut reader, &[&[0], &*frame(9)].concat());
        assert_eq!(found, [Err(FrameError::TooLong), Ok(9)]);
    }
}
