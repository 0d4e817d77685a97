//! Grasps of the tip.

use hapterra::phantom::HandModel;

/// A grasp, from the loosest to the tightest.
///
/// Identification studies report 10 to 1,000 N/m and 0.5 to 5 N·s/m towards the target for fingers
/// on a stylus, wrists more; light and firm are a stated choice at the ends of this range, and
/// normal is [`HandModel::default`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grasp {
    /// A loose grasp with two fingertips: the first one to be unstable.
    Light,
    /// A relaxed precision grip.
    Normal,
    /// A fist around the stylus.
    Firm,
}

impl Grasp {
    /// All grasps, from the loosest to the tightest.
    pub const ALL: [Self; 3] = [Self::Light, Self::Normal, Self::Firm];

    /// Returns its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Normal => "normal",
            Self::Firm => "firm",
        }
    }

    /// Returns the masses, springs and dampers of the hand.
    #[must_use]
    pub fn hand(self) -> HandModel {
        match self {
            Self::Light => HandModel {
                mass_kg: 0.05,
                arm_n_per_m: 30.0,
                arm_ns_per_m: 0.5,
                grip_n_per_m: 200.0,
                grip_ns_per_m: 0.5,
            },
            Self::Normal => HandModel::default(),
            Self::Firm => HandModel {
                mass_kg: 0.3,
                arm_n_per_m: 1000.0,
                arm_ns_per_m: 20.0,
                grip_n_per_m: 5000.0,
                grip_ns_per_m: 20.0,
            },
        }
    }
}
