//! How much energy the ticks have created at the tip, and the damping that takes it back
//! (Hannaford and Ryu 2002).
//!
//! A spring gives no more than it was given. One that is felt in ticks does: its force is that of
//! the tick's beginning, too small on the way in and too large on the way out, and gives
//! ½ K Δx² a tick. The observer adds up the work of the force that did act, and compares it
//! with what a spring would hold at this depth; what is more was created. So it is known while
//! the tip goes in, and not only when it has left. The controller adds the damping that takes
//! it back within a tick: K T / 2 in an even motion, Colgate and Schenkel's bound.

use glam::Vec3;

use super::ForceLaw;
use crate::rate::TickRate;

/// Least damping of a hand that holds the tip, N·s/mm.
const HAND_NS_PER_MM: f32 = 0.5e-3;
/// What the friction of the arm takes up of the energy that encoder counts create, as
/// a stiffness, N/mm: 2 f_c / Δ (Abbott and Okamura 2005) of a Phantom Premium 1.5.
const FRICTION_N_PER_MM: f32 = 3.3;
/// From the encoders to the amplifiers, s: so much later a tick's force is taken to act. The
/// slowest board that has converters takes 0.08 ms (docs/hardware.md).
const LATENCY_S: f32 = 0.1e-3;
/// More than this is forgotten, mJ.
const MOST_MJ: f32 = 2.0;
/// Most damping, as ticks of the stiffness. What the velocity is off by, some 0.1 of a
/// count a tick, makes a force of so many times the spring's for 0.1 of a count.
const MOST_TICKS: f32 = 2.0;

/// Stiffness up to which a surface needs no controller at a rate, N/mm: 2 b / T (Colgate
/// and Schenkel 1997) for the hand that damps least, and no more than the arm's friction allows.
#[must_use]
pub fn stiffest_n_per_mm(rate: TickRate) -> f32 {
    let by_damping = 2.0 * HAND_NS_PER_MM * rate.hz() as f32;
    by_damping.min(FRICTION_N_PER_MM)
}

/// The observer's book, and the controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passivity {
    stiffness_n_per_mm: f32,
    tick_s: f32,
    /// The part of a tick in which the force of the tick before still acts.
    late: f32,
    created_mj: f32,
    before: Option<Before>,
}

/// What the tick before left.
#[derive(Clone, Copy, Debug)]
struct Before {
    tip_mm: Vec3,
    stored_mj: f32,
    /// The force that the tick before that had asked for.
    asked_n: Vec3,
}

impl Passivity {
    pub(super) fn new(law: &ForceLaw, rate: TickRate) -> Self {
        Self {
            stiffness_n_per_mm: law.stiffness_n_per_mm,
            tick_s: rate.tick_s(),
            late: (LATENCY_S * rate.hz() as f32).min(1.0),
            created_mj: 0.0,
            before: None,
        }
    }

    /// The surface is another one from this tick on. What a spring that becomes stiffer holds
    /// more is energy that the ticks create.
    pub(super) const fn feels(&mut self, law: &ForceLaw) {
        self.stiffness_n_per_mm = law.stiffness_n_per_mm;
    }

    pub(super) const fn created_mj(&self) -> f32 {
        self.created_mj
    }

    pub(super) fn rest(&mut self) {
        (self.created_mj, self.before) = (0.0, None);
    }

    /// Books what happened since the tick before, when `asked_n` was asked for. The spring holds
    /// `stored_mj` now. Energy that was lost gives no credit.
    pub(super) fn observe(&mut self, stored_mj: f32, tip_mm: Vec3, asked_n: Vec3) {
        if let Some(before) = self.before {
            let acted_n = asked_n + (before.asked_n - asked_n) * self.late;
            let given_mj = acted_n.dot(tip_mm - before.tip_mm);
            let created = self.created_mj + given_mj + stored_mj - before.stored_mj;
            self.created_mj = match created > 0.0 {
                true => created.min(MOST_MJ),
                false => 0.0,
            };
        }
        self.before = Some(Before {
            tip_mm,
            stored_mj,
            asked_n,
        });
    }

    /// The damping that takes back what was created within a tick at a speed along the force,
    /// given in (mm/s)², N·s/mm.
    pub(super) fn damping_ns_per_mm(&self, speed_squared: f32) -> f32 {
        let most = MOST_TICKS * self.tick_s * self.stiffness_n_per_mm;
        let takes_back = self.created_mj / (speed_squared * self.tick_s);
        // No number where nothing moves: then there is nothing to take from.
        match takes_back < most {
            true => takes_back,
            false => most,
        }
    }
}
