//! Numbers from bytes.

/// Reads bytes in turn; returns zeros after the end.
pub(super) struct Bytes<'b>(pub(super) &'b [u8]);

impl Bytes<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn byte(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    pub(super) fn int(&mut self) -> i32 {
        i32::from_le_bytes(self.take())
    }

    /// Returns any bits.
    pub(super) fn float(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    /// Returns a small number most of the time, else any bits.
    pub(super) fn height(&mut self) -> f32 {
        match self.byte() {
            0 => self.float(),
            small => f32::from(small) / 32.0 - 4.0,
        }
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let n = N.min(self.0.len());
        let (here, rest) = self.0.split_at(n);
        taken[..n].copy_from_slice(here);
        self.0 = rest;
        taken
    }
}
