//! A calibration record as bytes: what a device keeps in flash and a file holds.
//!
//! ```text
//! "HAPC"   version (u16, little-endian)   postcard   CRC-32 (ISO-HDLC, little-endian)
//! ```
//!
//! The check sum covers everything before it. Bytes after it are passed over:
//! flash is read in larger pieces than it was written.

use crc::{CRC_32_ISO_HDLC, Crc};

use super::calibration::Calibration;
use super::check::BadCalibration;

/// Version of the layout. Any change to [`Calibration`] is a new one.
pub const VERSION: u16 = 1;
/// The longest record in bytes, and a multiple of every flash's write size.
pub const RECORD_BYTES: usize = 256;

const MAGIC: [u8; 4] = *b"HAPC";
/// Magic and version.
const HEAD: usize = 6;

/// A few dozen bytes now and then: no table.
static CRC: Crc<u32, crc::NoTable> = Crc::<u32, crc::NoTable>::new(&CRC_32_ISO_HDLC);

/// Why bytes are no calibration record.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BadRecord {
    /// They do not begin as a record does.
    #[error("these bytes are no calibration record")]
    NotARecord,
    /// A record of another version of this program.
    #[error("a calibration record of layout {found}; this program reads layout {VERSION}")]
    Version {
        /// The record's version.
        found: u16,
    },
    /// A record, but cut short or with the wrong check sum.
    #[error("the calibration record is damaged")]
    Damaged,
    /// An undamaged record with a number that makes no sense.
    #[error("the calibration record does not make sense: {0}")]
    Invalid(#[source] BadCalibration),
}

impl Calibration {
    /// Writes the record into `buffer`; returns the bytes to keep.
    #[must_use]
    pub fn encode<'b>(&self, buffer: &'b mut [u8; RECORD_BYTES]) -> &'b [u8] {
        let length = self.write(buffer).unwrap_or(0); // a record fits, see the test
        buffer.get(..length).unwrap_or(&[])
    }

    fn write(&self, buffer: &mut [u8; RECORD_BYTES]) -> Option<usize> {
        let (head, body) = buffer.split_at_mut_checked(HEAD)?;
        let (magic, version) = head.split_at_mut_checked(MAGIC.len())?;
        magic.copy_from_slice(&MAGIC);
        version.copy_from_slice(&VERSION.to_le_bytes());
        let end = HEAD + postcard::to_slice(self, body).ok()?.len();
        let sum = CRC.checksum(buffer.get(..end)?).to_le_bytes();
        buffer.get_mut(end..end + sum.len())?.copy_from_slice(&sum);
        Some(end + sum.len())
    }

    /// Reads a record and checks it as a whole.
    ///
    /// # Errors
    /// [`BadRecord`].
    pub fn decode(bytes: &[u8]) -> Result<Self, BadRecord> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(BadRecord::NotARecord)?;
        let (version, body) = rest.split_first_chunk().ok_or(BadRecord::Damaged)?;
        let found = u16::from_le_bytes(*version);
        if found != VERSION {
            return Err(BadRecord::Version { found });
        }
        let (record, rest) =
            postcard::take_from_bytes::<Self>(body).map_err(|_| BadRecord::Damaged)?;
        let end = bytes.len() - rest.len();
        let covered = bytes.get(..end).ok_or(BadRecord::Damaged)?;
        let (sum, _) = rest.split_first_chunk().ok_or(BadRecord::Damaged)?;
        if CRC.checksum(covered) != u32::from_le_bytes(*sum) {
            return Err(BadRecord::Damaged);
        }
        record.validate().map_err(BadRecord::Invalid)?;
        Ok(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn bytes() -> Vec<u8> {
        Calibration::PREMIUM_1_5
            .encode(&mut [0xFF; RECORD_BYTES])
            .to_vec()
    }

    #[test]
    fn what_goes_in_comes_out_whatever_follows_it() {
        let mut bytes = bytes();
        assert!(
            (100..RECORD_BYTES - 32).contains(&bytes.len()),
            "{}",
            bytes.len()
        );
        assert_eq!(Calibration::decode(&bytes), Ok(Calibration::PREMIUM_1_5));
        bytes.resize(2048, 0xFF);
        assert_eq!(Calibration::decode(&bytes), Ok(Calibration::PREMIUM_1_5));
    }

    #[test]
    fn no_flipped_bit_and_no_missing_byte_gets_through() {
        let good = bytes();
        // Miri is some hundred times slower: there, a few of each.
        let (bits, lengths) = if cfg!(miri) { (61, 17) } else { (1, 1) };
        for bit in (0..8 * good.len()).step_by(bits) {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let error = Calibration::decode(&bad).expect_err("damaged");
            let expected = match bit / 8 {
                0..4 => matches!(error, BadRecord::NotARecord),
                4..6 => matches!(error, BadRecord::Version { .. }),
                _ => matches!(error, BadRecord::Damaged),
            };
            assert!(expected, "bit {bit}: {error:?}");
        }
        for length in (0..good.len()).step_by(lengths) {
            assert!(Calibration::decode(&good[..length]).is_err(), "{length}");
        }
        assert_eq!(Calibration::decode(&[0xFF; 64]), Err(BadRecord::NotARecord));
        assert_eq!(Calibration::decode(&[0; 64]), Err(BadRecord::NotARecord));
    }

    #[test]
    fn an_undamaged_record_that_makes_no_sense_is_told_apart() {
        let record = Calibration {
            l1_mm: 1.0,
            ..Calibration::PREMIUM_1_5
        };
        let mut buffer = [0; RECORD_BYTES];
        let error = Calibration::decode(record.encode(&mut buffer)).expect_err("nonsense");
        assert!(matches!(error, BadRecord::Invalid(_)), "{error}");
    }
}
