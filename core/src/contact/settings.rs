//! What a contact is told once: its rule, and how its ticks run.

use serde::{Deserialize, Serialize};

use super::budget::WORK_PER_TICK;
use super::friction::Friction;
use crate::rate::TickRate;

/// Which contact rule is in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rule {
    /// Continuous: the first true crossing starts a contact, and the proxy
    /// moves on the surface.
    #[default]
    Swept,
    /// As published, for comparison.
    Paper,
}

/// What happens when a tick cannot finish: a tile is missing, or the budget is
/// spent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Execution {
    /// The loop goes on; the proxy waits, and a force that has to wait comes
    /// in at a bounded rate.
    #[default]
    RealTime,
    /// The tick will be repeated with the same HIP until it can finish, and
    /// only then counts; nothing of the wait is felt.
    LockStep,
}

/// What does not change while a contact lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// The contact rule.
    pub rule: Rule,
    /// What happens when a tick cannot finish.
    pub execution: Execution,
    /// Ticks a second: fades are bounded in time.
    pub rate: TickRate,
    /// Units of work a tick may spend: [`WORK_PER_TICK`], or at least
    /// [`Self::LEAST_WORK`].
    pub work_per_tick: u32,
    /// How rough the surface is. The paper's rule knows of no friction.
    pub friction: Friction,
    /// Whether the shortcuts are taken: free as before, and sliding within a patch.
    /// Without them every answer has the same bits.
    pub shortcuts: bool,
}

impl ContactSettings {
    /// Fewer units of work might not be enough for one short piece of a path.
    pub const LEAST_WORK: u32 = 80;

    /// The swept rule in real time at 1 kHz.
    pub const REAL_TIME: Self = Self {
        rule: Rule::Swept,
        execution: Execution::RealTime,
        rate: TickRate::DEFAULT,
        work_per_tick: WORK_PER_TICK,
        friction: Friction::NONE,
        shortcuts: true,
    };

    /// The swept rule in lock-step.
    pub const LOCK_STEP: Self = Self {
        execution: Execution::LockStep,
        ..Self::REAL_TIME
    };

    /// The same with another rule.
    #[must_use]
    pub const fn with_rule(self, rule: Rule) -> Self {
        Self { rule, ..self }
    }

    /// The same on a rough surface.
    #[must_use]
    pub const fn with_friction(self, friction: Friction) -> Self {
        Self { friction, ..self }
    }

    /// The same at another rate.
    #[must_use]
    pub const fn at_rate(self, rate: TickRate) -> Self {
        Self { rate, ..self }
    }
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self::REAL_TIME
    }
}
