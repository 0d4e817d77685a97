//! The format of a record: 8 bytes of signature, its name (16), the number of content bytes (8),
//! their XXH64 (8), all numbers little-endian, and the content.

use std::hash::Hasher;

use twox_hash::XxHash64;

use super::Name;

const SIGNATURE: &[u8; 8] = b"hapterr1";
/// Size of the header, bytes.
pub(super) const HEADER_BYTES: usize = 8 + 16 + 8 + 8;

fn sum(bytes: &[u8]) -> u64 {
    let mut hasher = XxHash64::with_seed(0);
    hasher.write(bytes);
    hasher.finish()
}

/// Returns a record with some content.
pub(super) fn encode(name: &Name, bytes: &[u8]) -> Vec<u8> {
    let length = (bytes.len() as u64).to_le_bytes();
    let sum = sum(bytes).to_le_bytes();
    [SIGNATURE, &name.bytes()[..], &length, &sum, bytes].concat()
}

/// Returns the content of a record; `None` if the name differs or it is incomplete.
pub(super) fn decode(name: &Name, mut record: Vec<u8>) -> Option<Vec<u8>> {
    let head = record.get(..HEADER_BYTES)?;
    let length = (record.len() - HEADER_BYTES) as u64;
    let expected = [SIGNATURE, &name.bytes()[..], &length.to_le_bytes()].concat();
    let is_whole =
        head[..32] == expected && head[32..] == sum(&record[HEADER_BYTES..]).to_le_bytes();
    is_whole.then(|| record.split_off(HEADER_BYTES))
}
