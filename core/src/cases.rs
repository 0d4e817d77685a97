//! Number of cases in a test.

/// `all`, or so many where Miri runs them, a thousand times as slowly.
pub(crate) const fn cases(all: u32, under_miri: u32) -> u32 {
    if cfg!(miri) { under_miri } else { all }
}
