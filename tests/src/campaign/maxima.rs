//! The largest values of a campaign.

use hapterra_core::guard::MAX_COUNTS_PER_S;

/// Largest encoder error up to which the force at the true tip must keep the record's limit,
/// counts: two jumps at 1 kHz that the guard accepts.
pub const OFF_COUNTS: u32 = 2 * (MAX_COUNTS_PER_S / 1_000);

/// The force at the true tip while an encoder was wrong by more than
/// [`OFF_COUNTS`]: recorded, not checked, as the true levers cannot be computed then.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Misled {
    /// The force, N.
    pub force_n: f64,
    /// Largest error of an encoder at that time, counts.
    pub off_counts: u32,
}

/// The largest values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Maxima {
    /// Force reported by the device, N.
    pub force_n: f64,
    /// Force of the currents with the levers of the encoders' pose, N.
    pub read_force_n: f64,
    /// Force of the currents at the true tip while no encoder was off by more than [`OFF_COUNTS`],
    /// N.
    pub tip_force_n: f64,
    /// The same while an encoder was off by more.
    pub misled: Misled,
    /// Current of a motor, A.
    pub current_a: f64,
    /// Change of force from one tick to the next, N.
    pub slew_n: f64,
    /// Temperature of a winding of the virtual arm, °C.
    pub winding_c: f64,
    /// Energy that the ticks have created, as reported by the device, mJ.
    pub created_mj: f32,
    /// The max energy that a contact has added to the tip with the controller on, mJ.
    pub gained_mj: f32,
    /// Ticks in which `gained_mj` was computed.
    pub watched_ticks: u64,
    /// Those of `watched_ticks` during the ramp.
    pub ramp_ticks: u64,
    /// Those of `watched_ticks` in which the clutch moved.
    pub clutch_ticks: u64,
    /// The most reversals of the tip in a quarter of a second.
    pub turns: usize,
    /// Ticks with the amplifiers on and an encoder off by more than [`OFF_COUNTS`].
    pub misled_ticks: u64,
    /// Ticks with the amplifiers on near a singular pose, where the force at the tip is not
    /// computed.
    pub singular_ticks: u64,
}

impl Maxima {
    /// Returns the larger of each value, and the sum of the ticks.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self {
            force_n: self.force_n.max(other.force_n),
            read_force_n: self.read_force_n.max(other.read_force_n),
            tip_force_n: self.tip_force_n.max(other.tip_force_n),
            misled: self.misled.max(other.misled),
            current_a: self.current_a.max(other.current_a),
            slew_n: self.slew_n.max(other.slew_n),
            winding_c: self.winding_c.max(other.winding_c),
            created_mj: self.created_mj.max(other.created_mj),
            gained_mj: self.gained_mj.max(other.gained_mj),
            watched_ticks: self.watched_ticks + other.watched_ticks,
            ramp_ticks: self.ramp_ticks + other.ramp_ticks,
            clutch_ticks: self.clutch_ticks + other.clutch_ticks,
            turns: self.turns.max(other.turns),
            misled_ticks: self.misled_ticks + other.misled_ticks,
            singular_ticks: self.singular_ticks + other.singular_ticks,
        }
    }
}

impl Misled {
    /// Returns the one with the larger force.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        if other.force_n > self.force_n {
            other
        } else {
            self
        }
    }
}
