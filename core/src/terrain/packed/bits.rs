//! Bits out of bytes and into bytes, the highest of a byte first.

/// Reads bits; zeros when the bytes are used up, which [`Self::is_at_end`] tells.
pub(super) struct BitReader<'b> {
    bytes: core::slice::Iter<'b, u8>,
    /// The next bits, from the highest on; zeros below them.
    ahead: u32,
    /// Number of held bits.
    held: u32,
    /// Bytes that were wanted after the last.
    beyond: u32,
}

impl<'b> BitReader<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Self {
        Self {
            bytes: bytes.iter(),
            ahead: 0,
            held: 0,
            beyond: 0,
        }
    }

    /// Sees to it that at least 25 bits are ahead. At most four bytes are taken.
    #[inline(never)] // once in an image
    fn refill(&mut self) {
        while self.held <= 24 {
            let byte = self.bytes.next().copied().unwrap_or_else(|| {
                self.beyond += 1; // at most four for each of some thousand calls
                0
            });
            self.ahead |= u32::from(byte) << (24 - self.held);
            self.held += 8;
        }
    }

    /// Takes the zeros in front of a one, and the one; as many zeros as `most` (at most 24)
    /// are taken alone.
    #[inline(never)]
    pub(super) fn zeros(&mut self, most: u32) -> u32 {
        if self.held < most {
            self.refill();
        }
        let zeros = self.ahead.leading_zeros().min(most);
        self.skip(zeros + u32::from(zeros < most));
        zeros
    }

    /// The next `count` bits, at most 32, as a number.
    #[inline(never)]
    pub(super) fn number(&mut self, count: u32) -> u32 {
        let (mut number, mut left) = (0, count);
        while left > 0 {
            let few = left.min(16);
            if self.held < few {
                self.refill();
            }
            number = (number << few) | (self.ahead >> (32 - few));
            self.skip(few);
            left -= few;
        }
        number
    }

    #[inline]
    fn skip(&mut self, count: u32) {
        self.ahead <<= count;
        self.held -= count;
    }

    /// Returns true if all bytes were used, and what is left of the last one is zeros.
    pub(super) fn is_at_end(&self) -> bool {
        let unused = self.held as i32 - 8 * self.beyond as i32;
        self.bytes.len() == 0 && self.ahead == 0 && (0..8).contains(&unused)
    }
}

/// Writes bits; `None` when the bytes are used up.
pub(super) struct BitWriter<'b> {
    bytes: &'b mut [u8],
    /// Bits written.
    length: usize,
}

impl<'b> BitWriter<'b> {
    pub(super) const fn new(bytes: &'b mut [u8]) -> Self {
        Self { bytes, length: 0 }
    }

    /// The lowest `count` bits of a number, at most 32.
    pub(super) fn number(&mut self, number: u32, count: u32) -> Option<()> {
        for place in (0..count).rev() {
            let (byte, bit) = (self.length / 8, 7 - self.length % 8);
            let to = self.bytes.get_mut(byte)?;
            if bit == 7 {
                *to = 0;
            }
            *to |= ((number >> place & 1) as u8) << bit;
            self.length += 1;
        }
        Some(())
    }

    /// Bytes begun.
    pub(super) const fn len(&self) -> usize {
        self.length.div_ceil(8)
    }
}
