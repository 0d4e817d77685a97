//! A calibration record as bytes, for a device's flash and for a file.
//!
//! ```text
//! "HAPC"   version (u16, little-endian)   postcard   CRC-32 (ISO-HDLC, little-endian)
//! ```
//!
//! The check sum covers everything before it. Bytes after it are ignored: flash is read in larger
//! pieces than it was written.

use serde::{Deserialize, Serialize};

use super::calibration::Calibration;
use super::check::CalibrationError;
use crate::crc;

/// Version of the layout, which increases with every change to [`Calibration`].
pub const VERSION: u16 = 1;
/// Maximum record length in bytes, a multiple of every flash's write size.
pub const RECORD_BYTES: usize = 256;

const MAGIC: [u8; 4] = *b"HAPC";

/// Stored content, before the check sum.
#[derive(Serialize, Deserialize)]
struct Record {
    magic: [u8; 4],
    #[serde(with = "postcard::fixint::le")]
    version: u16,
    calibration: Calibration,
}

/// Reason why bytes are not a calibration record.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// The bytes do not start like a record.
    #[error("these bytes are no calibration record")]
    NotARecord,
    /// A record of another version of this program.
    #[error("a calibration record of layout {found}; this program reads layout {VERSION}")]
    Version {
        /// The record's version.
        found: u16,
    },
    /// A record that is incomplete or has the wrong check sum.
    #[error("the calibration record is damaged")]
    Damaged,
    /// An undamaged record with an invalid number.
    #[error("the calibration record does not make sense: {0}")]
    Invalid(#[source] CalibrationError),
}

impl Calibration {
    /// Writes the record into `buffer`; returns the bytes to store.
    #[must_use]
    pub fn encode<'b>(&self, buffer: &'b mut [u8; RECORD_BYTES]) -> &'b [u8] {
        let record = Record {
            magic: MAGIC,
            version: VERSION,
            calibration: *self,
        };
        crc::put(&record, buffer).unwrap_or(&[]) // a record always fits, see the test
    }

    /// Reads and validates a record.
    ///
    /// # Errors
    /// Returns a [`RecordError`].
    pub fn decode(bytes: &[u8]) -> Result<Self, RecordError> {
        let rest = bytes.strip_prefix(&MAGIC).ok_or(RecordError::NotARecord)?;
        let version = rest.first_chunk().ok_or(RecordError::Damaged)?;
        let found = u16::from_le_bytes(*version);
        if found != VERSION {
            return Err(RecordError::Version { found });
        }
        let (record, _) = crc::take::<Record>(bytes).ok_or(RecordError::Damaged)?;
        let calibration = record.calibration;
        calibration.validate().map_err(RecordError::Invalid)?;
        Ok(calibration)
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
    fn record_round_trips_despite_trailing_bytes() {
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

    /// Safety: 17.
    #[test]
    fn record_with_flipped_bit_or_missing_byte_is_rejected() {
        let good = bytes();
        // Miri is some hundred times slower, so it tests only a few of each.
        let (bits, lengths) = if cfg!(miri) { (61, 17) } else { (1, 1) };
        for bit in (0..8 * good.len()).step_by(bits) {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let error = Calibration::decode(&bad).expect_err("damaged");
            let expected = match bit / 8 {
                0..4 => matches!(error, RecordError::NotARecord),
                4..6 => matches!(error, RecordError::Version { .. }),
                _ => matches!(error, RecordError::Damaged),
            };
            assert!(expected, "bit {bit}: {error:?}");
        }
        for length in (0..good.len()).step_by(lengths) {
            assert!(Calibration::decode(&good[..length]).is_err(), "{length}");
        }
        assert_eq!(
            Calibration::decode(&[0xFF; 64]),
            Err(RecordError::NotARecord)
        );
        assert_eq!(Calibration::decode(&[0; 64]), Err(RecordError::NotARecord));
    }

    #[test]
    fn intact_record_with_bad_values_is_invalid_not_damaged() {
        let record = Calibration {
            l1_mm: 1.0,
            ..Calibration::PREMIUM_1_5
        };
        let mut buffer = [0; RECORD_BYTES];
        let error = Calibration::decode(record.encode(&mut buffer)).expect_err("nonsense");
        assert!(matches!(error, RecordError::Invalid(_)), "{error}");
    }
}
