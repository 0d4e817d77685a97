//! Number of cases in a test.

/// Returns `all`, or a smaller number under Miri, which is a thousand times slower.
pub(crate) const fn cases(all: u32, under_miri: u32) -> u32 {
    if cfg!(miri) { under_miri } else { all }
}
