//! Unbounded encoder counts from the 16-bit counters of encoder timers.

/// A counter that wraps around at 2^16, followed to a total count.
///
/// The count is exact while the counter moves by less than 32,768 counts between two readings. With
/// a reading each millisecond that is 8 motor turns, hundreds of times a Phantom's top speed.
#[derive(Clone, Copy, Debug, Default)]
pub struct EndlessCount {
    last: u16,
    total: i32,
}

impl EndlessCount {
    /// Updates with the counter's current reading and returns the total count.
    pub fn update(&mut self, reading: u16) -> i32 {
        let moved = reading.wrapping_sub(self.last).cast_signed();
        self.last = reading;
        self.total = self.total.wrapping_add(i32::from(moved));
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn count_continues_through_the_wrap_in_both_directions() {
        let mut count = EndlessCount::default();
        let mut truth = 0;
        for step in [5, -10, 30_000, 30_000, 30_000, -32_768, -32_000, 32_767] {
            truth += step;
            assert_eq!(count.update(truth as u16), truth);
        }
    }
}
