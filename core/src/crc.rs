//! The check sum of frames and records.

use crc::{CRC_32_ISO_HDLC, Crc};

/// CRC-32 (ISO-HDLC). Its 256-entry table costs 1 KiB of flash and is worth it: a
/// tile's frame is 4.4 kB.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
