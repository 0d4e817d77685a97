//! A small seeded generator for tests, the same everywhere (xorshift64*).

/// State of the generator, not zero.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// A number in `[0, 1)`.
    pub(super) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A number in `[low, high)`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Places `step` cells apart, each turned by up to `max_turn` rad from the last direction, within a
/// square field of `size` cells and away from its border.
pub(super) fn wander(
    random: Random,
    ticks: u32,
    size: i32,
    step: f64,
    max_turn: f64,
) -> impl Iterator<Item = [f64; 2]> {
    let (mut random, mut heading) = (random, 0.3_f64);
    let mut at = [0.5 * f64::from(size); 2];
    (0..ticks).map(move |_| {
        heading += random.between(-max_turn, max_turn);
        let next = [at[0] + step * heading.cos(), at[1] + step * heading.sin()];
        if next
            .iter()
            .all(|x| (4.0..f64::from(size) - 4.0).contains(x))
        {
            at = next;
        } else {
            heading += 1.0;
        }
        at
    })
}
