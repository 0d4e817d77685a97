//! Check sums: values in postcard's format, followed by their CRC-32.
//!
//! The sum is computed over complete bytes. postcard's own flavour adds each number of a message to
//! the sum where it is read, which makes every such place in an image larger and slower.

use crc::{CRC_32_ISO_HDLC, Crc, Digest};
use serde::{Deserialize, Serialize};

/// CRC-32 (ISO-HDLC). Its 256-entry table costs 1 KiB of flash and is worth it: a
/// tile's frame is 4.4 kB.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Reads a `T` and its check sum, little-endian. Returns it and the bytes after the sum; `None` if
/// the sum is wrong or the bytes are not a `T`.
#[must_use]
pub fn take<'b, T: Deserialize<'b>>(bytes: &'b [u8]) -> Option<(T, &'b [u8])> {
    let (value, rest) = postcard::take_from_bytes(bytes).ok()?;
    let read = bytes.get(..bytes.len() - rest.len())?;
    let (found, rest) = rest.split_first_chunk()?;
    (u32::from_le_bytes(*found) == sum(read)).then_some((value, rest))
}

/// Writes `value` and its check sum into `buffer`; returns the written bytes, or `None` if they do
/// not fit.
pub fn put<'b, T: Serialize + ?Sized>(value: &T, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
    let length = postcard::to_slice(value, buffer).ok()?.len();
    let (written, rest) = buffer.split_at_mut_checked(length)?;
    *rest.first_chunk_mut()? = sum(written).to_le_bytes();
    buffer.get(..length + size_of::<u32>())
}

/// Returns the check sum of `bytes`. A single function in an image, for all reads and writes.
#[inline(never)]
#[must_use]
pub fn sum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Adds more bytes to a check sum. A function, because `update` is unrolled for each length.
#[inline(never)]
pub(crate) fn add(digest: &mut Digest<'_, u32>, bytes: &[u8]) {
    digest.update(bytes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checked_value_round_trips_and_leaves_trailing_bytes() {
        let mut buffer = [7; 12];
        let length = put(&0x1_2345_u32, &mut buffer).expect("fits").len();
        assert_eq!(length, 3 + 4);
        assert_eq!(take(&buffer), Some((0x1_2345_u32, &[7; 5][..])));
        for length in 0..length {
            assert_eq!(put(&0x1_2345_u32, &mut [0; 12][..length]), None, "{length}");
            assert_eq!(take::<u32>(&buffer[..length]), None, "{length}");
        }
    }

    #[test]
    fn postcard_reads_and_writes_the_same_bytes() {
        let value = (7_u8, -3_i32, 1.5_f32, "proxy");
        let (mut ours, mut theirs) = ([0; 32], [0; 32]);
        let ours = put(&value, &mut ours).expect("fits");
        let theirs = postcard::to_slice_crc32(&value, &mut theirs, CRC.digest()).expect("fits");
        assert_eq!(ours, theirs);
    }
}
