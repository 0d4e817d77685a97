//! Random numbers by place: the same place and seed yield the same number.

/// Mixes a seed and a place into 64 uniform bits (the finaliser of SplitMix64).
pub(super) fn hash(seed: u64, column: i64, row: i64) -> u64 {
    let mut bits = seed
        .wrapping_add((column as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15))
        .wrapping_add((row as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f));
    for _ in 0..2 {
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
    }
    bits
}

/// Returns a number in [0, 1) from a part of a hash's bits: `which` is 0, 1 or 2.
pub(super) fn unit(hash: u64, which: u32) -> f64 {
    f64::from((hash >> (21 * which)) as u32 & 0x1f_ffff) / f64::from(1 << 21)
}
