//! The name of a record.

use std::hash::Hasher;
use std::path::PathBuf;

use twox_hash::XxHash64;

/// Name of a record, as a hash of 128 bits: no URL or path is visible in the folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Name([u64; 2]);

impl Name {
    /// Hashes some texts, in this order.
    pub(crate) fn of(parts: &[&str]) -> Self {
        // Two seeds for two halves of 64 bits.
        let hash = |seed: u64| {
            let mut hasher = XxHash64::with_seed(seed);
            for part in parts {
                hasher.write_u64(part.len() as u64);
                hasher.write(part.as_bytes());
            }
            hasher.finish()
        };
        Self([hash(0), hash(0x6861_7074_6572_7261)])
    }

    /// Returns the record's path in the folder.
    pub(super) fn path(&self) -> PathBuf {
        let text = format!("{:016x}{:016x}", self.0[0], self.0[1]);
        let (folder, rest) = text.split_at(2);
        [folder, rest].iter().collect()
    }

    /// Returns the bytes stored in the record.
    pub(super) fn bytes(&self) -> [u8; 16] {
        let mut bytes = [0; 16];
        bytes[..8].copy_from_slice(&self.0[0].to_le_bytes());
        bytes[8..].copy_from_slice(&self.0[1].to_le_bytes());
        bytes
    }
}
