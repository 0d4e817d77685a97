//! Reading and writing of bits, the highest bit of a byte first.

/// Reader of bits. It returns zeros after the last byte; [`Self::is_at_end`] detects that.
pub(super) struct BitReader<'b> {
    bytes: core::slice::Iter<'b, u8>,
    /// The next bits, from the highest on, with zeros below them.
    ahead: u32,
    /// Number of valid bits in `ahead`.
    available: u32,
    /// Bytes requested after the last one.
    beyond: u32,
}

impl<'b> BitReader<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Self {
        Self {
            bytes: bytes.iter(),
            ahead: 0,
            available: 0,
            beyond: 0,
        }
    }

    /// Loads at least 25 bits, from at most four bytes.
    #[inline(never)] // once in an image
    fn refill(&mut self) {
        while self.available <= 24 {
            let byte = self.bytes.next().copied().unwrap_or_else(|| {
                self.beyond += 1; // at most four for each of some thousand calls
                0
            });
            self.ahead |= u32::from(byte) << (24 - self.available);
            self.available += 8;
        }
    }

    /// Reads the zeros before a one, and the one; after `max` zeros (at most 24) reads no one.
    #[inline(never)]
    pub(super) fn zeros(&mut self, max: u32) -> u32 {
        if self.available < max {
            self.refill();
        }
        let zeros = self.ahead.leading_zeros().min(max);
        self.skip(zeros + u32::from(zeros < max));
        zeros
    }

    /// Reads the next `count` bits, at most 32, as a number.
    #[inline(never)]
    pub(super) fn number(&mut self, count: u32) -> u32 {
        let (mut number, mut left) = (0, count);
        while left > 0 {
            let few = left.min(16);
            if self.available < few {
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
        self.available -= count;
    }

    /// Returns true if all bytes were used, and the rest of the last one is zeros.
    pub(super) fn is_at_end(&self) -> bool {
        let unused = self.available as i32 - 8 * self.beyond as i32;
        self.bytes.len() == 0 && self.ahead == 0 && (0..8).contains(&unused)
    }
}

/// Writer of bits. It returns `None` if the buffer is full.
pub(super) struct BitWriter<'b> {
    bytes: &'b mut [u8],
    /// Number of written bits.
    length: usize,
}

impl<'b> BitWriter<'b> {
    pub(super) const fn new(bytes: &'b mut [u8]) -> Self {
        Self { bytes, length: 0 }
    }

    /// Writes the lowest `count` bits of a number, at most 32.
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

    /// Returns the number of started bytes.
    pub(super) const fn len(&self) -> usize {
        self.length.div_ceil(8)
    }
}
