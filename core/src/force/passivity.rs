//! How much energy the ticks have created at the tip, and the damping that takes it back
//! (Hannaford and Ryu 2002).
//!
//! A spring gives no more than it was given. One that is felt in ticks does: its force is that of
//! the tick's beginning and acts a latency L later, too small on the way in and too large on the
//! way out, and gives K (T / 2 + L) v a metre. The observer adds up the work of the forces that did
//! act, each at the time when it acted, and compares it with what a spring would hold at this depth;
//! what is more was created. So it is known while the tip goes in, and not only when it has left.
//!
//! What the controller asks for acts a latency later, too. So it looks ahead by that time: the
//! forces on their way are known, and the tip is taken to go on as it does. It adds the damping that
//! takes back what will have been created by then: K (T / 2 + L) in an even motion.

use glam::Vec3;

use super::depth::Depth;
use super::yielding::Yielding;
use super::{FeltWith, ForceLaw};
use crate::rate::TickRate;
use crate::scalar::{larger, smaller};

/// Least damping of a hand that holds the tip, N·s/mm.
const HAND_NS_PER_MM: f32 = 0.5e-3;
/// What the friction of the arm takes up of the energy that encoder counts create, as
/// a stiffness, N/mm: 2 f_c / Δ (Abbott and Okamura 2005) of a Phantom Premium 1.5.
const FRICTION_N_PER_MM: f32 = 3.3;
/// Latency of a board with converters, s: so much of it is borne by the arm's friction in the
/// map of docs/stability.md.
const CONVERTERS_S: f32 = 0.2e-3;
/// More than this is forgotten, mJ.
pub(super) const MOST_MJ: f32 = 2.0;
/// Most damping, as ticks of the stiffness, besides the latency. What the velocity is off by,
/// some 0.1 of a count a tick, makes a force of so many times the spring's for 0.1 of a count.
const MOST_TICKS: f32 = 2.0;
/// Forces kept: those on their way, the one that acts and the one before it. A power of two.
const KEPT: usize = 16;
/// Most ticks that a force may come late: what is later is taken to come then.
const MOST_LATE: usize = KEPT - 2;

/// Stiffness up to which a surface needs no controller at a rate, N/mm: b / (T / 2 + L) for the hand
/// that damps least, and no more than the arm's friction allows. L is what the latency is longer than
/// that of a board with converters; without it, it is the 2 b / T of Colgate and Schenkel (1997).
#[must_use]
pub fn stiffest_n_per_mm(rate: TickRate, latency_s: f32) -> f32 {
    let late_s = (latency_s - CONVERTERS_S).max(0.0);
    let by_damping = HAND_NS_PER_MM / (0.5 * rate.tick_s() + late_s);
    by_damping.min(FRICTION_N_PER_MM)
}

/// The observer's book, and the controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passivity {
    stiffness_n_per_mm: f32,
    tick_s: f32,
    /// From the beginning of a tick until its force acts, s: so many ticks, and a part of one.
    latency_s: f32,
    late: (usize, f32),
    yielding: Yielding,
    created_mj: f32,
    /// The same when this tick's force has acted for a tick, all but the work of that force.
    coming_mj: f32,
    before: Option<Before>,
    asked: Asked,
}

/// What the tick before left.
#[derive(Clone, Copy, Debug)]
struct Before {
    tip_mm: Vec3,
    stored_mj: f32,
}

/// The forces that the guard let through, N.
#[derive(Clone, Copy, Debug)]
struct Asked {
    forces_n: [Vec3; KEPT],
    newest: usize,
}

impl Asked {
    const NONE: Self = Self {
        forces_n: [Vec3::ZERO; KEPT],
        newest: 0,
    };

    fn add(&mut self, force_n: Vec3) {
        self.newest = (self.newest + 1) % KEPT;
        self.forces_n[self.newest % KEPT] = force_n;
    }

    /// The one of so many ticks ago.
    const fn ago(&self, ticks: usize) -> Vec3 {
        self.forces_n[self.newest.wrapping_sub(ticks) % KEPT]
    }
}

/// What a tick begins with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// From the HIP to the proxy.
    pub(crate) displacement_mm: Vec3,
    /// Where the tip is, in a frame that stays.
    pub(crate) tip_mm: Vec3,
    /// How fast the tip moves.
    pub(crate) velocity_mm_s: Vec3,
    /// The force that the guard let through in the tick before.
    pub(crate) asked_n: Vec3,
    /// The most that it lets through.
    pub(crate) most_n: f32,
}

impl Passivity {
    pub(super) fn new(law: &ForceLaw, felt: &FeltWith) -> Self {
        let tick_s = felt.rate.tick_s();
        let latency_s = felt.latency_s.max(0.0).min(MOST_LATE as f32 * tick_s);
        let late = latency_s / tick_s;
        let whole = late as usize;
        Self {
            stiffness_n_per_mm: law.stiffness_n_per_mm,
            tick_s,
            latency_s,
            late: (whole, late - whole as f32),
            yielding: Yielding::NONE,
            created_mj: 0.0,
            coming_mj: 0.0,
            before: None,
            asked: Asked::NONE,
        }
    }

    /// The share of the spring's force that is felt.
    pub(super) const fn share(&self) -> f32 {
        self.yielding.share()
    }

    /// The surface is another one from this tick on. What a spring that becomes stiffer holds
    /// more is energy that the ticks create.
    pub(super) const fn feels(&mut self, law: &ForceLaw) {
        self.stiffness_n_per_mm = law.stiffness_n_per_mm;
    }

    pub(super) const fn created_mj(&self) -> f32 {
        self.created_mj
    }

    pub(super) const fn rest(&mut self) {
        (self.created_mj, self.coming_mj, self.before) = (0.0, 0.0, None);
        (self.yielding, self.asked) = (Yielding::NONE, Asked::NONE);
    }

    /// Books what happened since the tick before, and what is going to happen until this tick's
    /// force has acted for a tick, all but the work of that force. Energy that was lost gives no
    /// credit.
    pub(super) fn observe(&mut self, law: &ForceLaw, now: &Moment) {
        let depth = Depth::of(now.displacement_mm, now.velocity_mm_s);
        self.yielding.observe(law, &depth, now.most_n, self.tick_s);
        self.asked.add(now.asked_n);
        let (whole, part) = self.late;
        let (acting_n, before_n) = (self.asked.ago(whole), self.asked.ago(whole + 1));
        let share = self.yielding.share();
        // Where less of the force is felt, it gets to its limit later.
        let most_n = now.most_n / share;
        let stored_mj = share * law.stored_mj(depth.mm, most_n);
        if let Some(before) = self.before {
            let acted_n = acting_n + (before_n - acting_n) * part;
            let given_mj = acted_n.dot(now.tip_mm - before.tip_mm);
            self.created_mj = within(self.created_mj + given_mj + stored_mj - before.stored_mj);
        }
        self.before = Some(Before {
            tip_mm: now.tip_mm,
            stored_mj,
        });
        // At most `MOST_LATE` ticks.
        let on_their_way = (0..whole).map(|ticks| self.asked.ago(ticks));
        let sum_n = on_their_way.fold(acting_n * part, |sum_n, asked_n| sum_n + asked_n);
        let gives_mj = sum_n.dot(now.velocity_mm_s) * self.tick_s;
        let depth_mm = depth.after_mm(self.latency_s + self.tick_s);
        let holds_mj = share * law.stored_mj(depth_mm, most_n);
        self.coming_mj = self.created_mj + gives_mj + holds_mj - stored_mj;
    }

    /// The damping that takes back what was created, and what a spring's force will have created
    /// when it has acted for a tick, N·s/mm. `along` is that force times the velocity, `squared` the
    /// square of the force.
    pub(super) fn damping_ns_per_mm(&self, along: f32, squared: f32) -> f32 {
        let most = (MOST_TICKS * self.tick_s + self.latency_s) * self.stiffness_n_per_mm;
        let created_mj = within(self.coming_mj + along * self.tick_s);
        let takes_back = created_mj * squared / (along * along * self.tick_s);
        // No number where nothing moves: then there is nothing to take from.
        match takes_back < most {
            true => takes_back,
            false => most,
        }
    }
}

/// What is kept of an energy, mJ: what is no number counts as none.
fn within(mj: f32) -> f32 {
    smaller(larger(mj, 0.0), MOST_MJ)
}
