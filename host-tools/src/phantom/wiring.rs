//! Wiring of a board to an arm, with common mistakes.

/// Assignment of commands to motors and of counters to encoders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wiring {
    /// The motor (0 to 2) that each of the three commands drives.
    pub motor: [usize; 3],
    /// Factor of each command: −1 if a motor's two wires are crossed, 0 if its amplifier or its
    /// cable is missing, 2 if an amplifier's full scale is twice the board's setting.
    pub gain: [f64; 3],
    /// True for each encoder whose counter does not change.
    pub dead_encoder: [bool; 3],
}

impl Wiring {
    /// Wiring as documented.
    pub const RIGHT: Self = Self {
        motor: [0, 1, 2],
        gain: [1.0; 3],
        dead_encoder: [false; 3],
    };

    /// Exchanges the commands of two axes.
    #[must_use]
    pub fn swapped(self, one: usize, other: usize) -> Self {
        let mut wiring = self;
        wiring.motor.swap(one, other);
        wiring
    }

    /// Multiplies one command by `gain`.
    #[must_use]
    pub fn with_gain(self, axis: usize, gain: f64) -> Self {
        let mut wiring = self;
        wiring.gain[axis] *= gain;
        wiring
    }

    /// Disables the counter of one encoder.
    #[must_use]
    pub fn with_dead_encoder(self, axis: usize) -> Self {
        let mut wiring = self;
        wiring.dead_encoder[axis] = true;
        wiring
    }

    /// Returns the motors' currents, A, for the board's commands.
    #[must_use]
    pub fn currents_a(&self, commands_a: [f64; 3]) -> [f64; 3] {
        let mut currents_a = [0.0; 3];
        for (axis, motor) in self.motor.into_iter().enumerate() {
            currents_a[motor] += self.gain[axis] * commands_a[axis];
        }
        currents_a
    }

    /// Returns the readings of the board's counters for encoders at `counts`.
    #[must_use]
    pub fn counts(&self, counts: [i32; 3]) -> [i32; 3] {
        std::array::from_fn(|axis| match self.dead_encoder[axis] {
            true => 0,
            false => counts[axis],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wiring_mistakes_affect_only_their_axis() {
        let commands = [1.0, 2.0, 3.0];
        assert_eq!(Wiring::RIGHT.currents_a(commands), commands);
        let swapped = Wiring::RIGHT.swapped(1, 2);
        assert_eq!(swapped.currents_a(commands), [1.0, 3.0, 2.0]);
        // A command's gain follows the command, whichever motor it drives.
        let swapped = swapped.with_gain(1, -1.0);
        assert_eq!(swapped.currents_a(commands), [1.0, 3.0, -2.0]);
        let missing = Wiring::RIGHT.with_gain(0, 0.0);
        assert_eq!(missing.currents_a(commands), [0.0, 2.0, 3.0]);
        let dead = Wiring::RIGHT.with_dead_encoder(2);
        assert_eq!(dead.counts([7, 8, 9]), [7, 8, 0]);
    }
}
