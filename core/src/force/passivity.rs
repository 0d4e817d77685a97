//! The energy leak of the sampled wall at the tip, and the damping that dissipates it
//! (Hannaford and Ryu 2002).
//!
//! An ideal spring returns no more energy than it received. A spring that is rendered in ticks
//! does: its force belongs to the start of the tick and acts a latency L later, so it is too small
//! while the tip moves in and too large while it moves out. This creates K (T / 2 + L) v per metre.
//! The observer adds up the work of the forces that acted, each at its time, and compares the sum
//! with the energy of an ideal spring at this depth; the excess was created. So the leak is
//! measured while the tip moves in, and not only after it has left.
//!
//! The damping of the controller also acts a latency later, so the controller predicts: the next
//! forces are known, and the tip is assumed to keep its velocity. It adds the damping that
//! dissipates the energy created until then: K (T / 2 + L) in a uniform motion.

use glam::Vec3;

use super::depth::Depth;
use super::rate_limit_softening::RateLimitSoftening;
use super::{EffectContext, Spring, SurfaceParams};
use crate::scalar::{larger, smaller};

/// Maximum recorded energy, mJ; more is dropped.
pub(super) const MAX_MJ: f32 = 2.0;
/// Maximum damping, as ticks of the stiffness, in addition to the latency. The velocity has an
/// error of some 0.1 count a tick, which causes a force of this many times the spring's force for
/// 0.1 count.
const MAX_TICKS: f32 = 2.0;
/// The same across the force: a uniform motion creates half of the energy that this dissipates.
const MAX_TICKS_ACROSS: f32 = 1.0;
/// Share of the force below which hardly any passes the guard, so damping is not scaled up further.
const MIN_SHARE: f32 = 1e-4;
/// Number of stored forces: the delayed ones, the acting one and the one before it. A power of two.
const STORED_FORCES: usize = 16;
/// Maximum latency of a force in ticks; a longer latency counts as this one.
const MAX_LATENCY_TICKS: usize = STORED_FORCES - 2;

/// The observer's energy record, and the controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passivity {
    tick_s: f32,
    /// Time from the start of a tick until its force acts, s, and the same in whole ticks and a
    /// fraction.
    latency_s: f32,
    latency_ticks: (usize, f32),
    rate_limit_softening: RateLimitSoftening,
    created_mj: f32,
    /// The created energy, predicted for the end of a tick in which this tick's force acts, without
    /// the work of that force, for a force before the guard's share.
    predicted_mj: f32,
    /// The spring before the guard's share, N/mm; the clutch's share is included.
    stiffness_n_per_mm: f32,
    before: Option<LastTick>,
    forces: ForceHistory,
}

/// The state of the last tick.
#[derive(Clone, Copy, Debug)]
struct LastTick {
    depth_mm: f32,
    stiffness_n_per_mm: f32,
    /// Shares of the softening and of the speed limit.
    softening: f32,
    speed: f32,
}

/// The forces that the guard let through, N.
#[derive(Clone, Copy, Debug)]
struct ForceHistory {
    forces_n: [Vec3; STORED_FORCES],
    newest: usize,
}

impl ForceHistory {
    const NONE: Self = Self {
        forces_n: [Vec3::ZERO; STORED_FORCES],
        newest: 0,
    };

    fn add(&mut self, force_n: Vec3) {
        self.newest = (self.newest + 1) % STORED_FORCES;
        self.forces_n[self.newest % STORED_FORCES] = force_n;
    }

    /// Returns the force of `ticks` ticks ago.
    const fn ago(&self, ticks: usize) -> Vec3 {
        self.forces_n[self.newest.wrapping_sub(ticks) % STORED_FORCES]
    }
}

/// The inputs of a tick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassivityInputs {
    /// Vector from the HIP to the proxy.
    pub(crate) displacement_mm: Vec3,
    /// The tip's displacement over the terrain since the last tick.
    pub(crate) moved_mm: Vec3,
    /// Velocity of the tip.
    pub(crate) velocity_mm_s: Vec3,
    /// The force that the guard let through in the last tick.
    pub(crate) commanded_n: Vec3,
    /// The maximum force that the guard permits.
    pub(crate) max_n: f32,
    /// Shares of the spring's force in this tick.
    pub(crate) shares: Shares,
}

/// Shares of a force that clutch and guard let through, each above 0, at most 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shares {
    /// The clutch's share, before the guard's clamp.
    pub(crate) clutch: f32,
    /// The guard's share after arming, after its clamp.
    pub(crate) ramp: f32,
    /// The guard's share for a fast tip, after its clamp.
    pub(crate) speed: f32,
}

impl Shares {
    /// The full force.
    pub(crate) const ALL: Self = Self {
        clutch: 1.0,
        ramp: 1.0,
        speed: 1.0,
    };
}

impl Passivity {
    pub(super) fn new(context: &EffectContext) -> Self {
        let tick_s = context.rate.tick_s();
        let latency_s = context
            .latency_s
            .max(0.0)
            .min(MAX_LATENCY_TICKS as f32 * tick_s);
        let latency_ticks = latency_s / tick_s;
        let whole = latency_ticks as usize;
        Self {
            tick_s,
            latency_s,
            latency_ticks: (whole, latency_ticks - whole as f32),
            rate_limit_softening: RateLimitSoftening::NONE,
            created_mj: 0.0,
            predicted_mj: 0.0,
            stiffness_n_per_mm: 0.0,
            before: None,
            forces: ForceHistory::NONE,
        }
    }

    /// Returns the rendered share of the spring's force.
    pub(super) const fn share(&self) -> f32 {
        self.rate_limit_softening.share()
    }

    pub(super) const fn created_mj(&self) -> f32 {
        self.created_mj
    }

    pub(super) const fn reset(&mut self) {
        (self.created_mj, self.predicted_mj, self.before) = (0.0, 0.0, None);
        (self.rate_limit_softening, self.forces) = (RateLimitSoftening::NONE, ForceHistory::NONE);
    }

    /// Records the energy since the last tick, and predicts the energy until this tick's force has
    /// acted for a tick, without the work of that force. Lost energy is not credited.
    ///
    /// The spring is the one of the force after the guard: the scene's, times all shares. A spring
    /// that becomes stiffer adds energy. For ramp and clutch this is intended, once each, and not
    /// recorded; everything else is.
    pub(super) fn observe(&mut self, params: &SurfaceParams, now: &PassivityInputs) {
        let depth = Depth::of(now.displacement_mm, now.velocity_mm_s);
        let Shares {
            clutch,
            ramp,
            speed,
        } = now.shares;
        let stiffness_n_per_mm = clutch * params.stiffness_n_per_mm;
        let max_force_n = smaller(clutch * params.max_force_n, now.max_n);
        let ramped = Spring {
            stiffness_n_per_mm: ramp * stiffness_n_per_mm,
            max_force_n: ramp * max_force_n,
        };
        self.rate_limit_softening
            .observe(&ramped, &depth, self.tick_s);
        self.forces.add(now.commanded_n);
        let (whole, part) = self.latency_ticks;
        let (acting_n, before_n) = (self.forces.ago(whole), self.forces.ago(whole + 1));
        let softening = self.rate_limit_softening.share();
        let spring = Spring {
            stiffness_n_per_mm: softening * stiffness_n_per_mm,
            max_force_n,
        };
        let stored_mj = ramp * speed * spring.stored_mj(depth.mm);
        if let Some(before) = self.before {
            let spring = Spring {
                stiffness_n_per_mm: before.softening * clutch * before.stiffness_n_per_mm,
                max_force_n,
            };
            let before_mj = ramp * before.speed * spring.stored_mj(before.depth_mm);
            let acted_n = acting_n + (before_n - acting_n) * part;
            let work_mj = acted_n.dot(now.moved_mm);
            self.created_mj = within(self.created_mj + work_mj + stored_mj - before_mj);
        }
        self.before = Some(LastTick {
            depth_mm: depth.mm,
            stiffness_n_per_mm: params.stiffness_n_per_mm,
            softening,
            speed,
        });
        // At most `MAX_LATENCY_TICKS` ticks.
        let pending = (0..whole).map(|ticks| self.forces.ago(ticks));
        let sum_n = pending.fold(acting_n * part, |sum_n, commanded_n| sum_n + commanded_n);
        let predicted_work_mj = sum_n.dot(now.velocity_mm_s) * self.tick_s;
        let depth_mm = depth.after_mm(self.latency_s + self.tick_s);
        let predicted_stored_mj = ramp * speed * spring.stored_mj(depth_mm);
        let predicted_mj = self.created_mj + predicted_work_mj + predicted_stored_mj - stored_mj;
        self.predicted_mj = predicted_mj / larger(ramp * speed, MIN_SHARE);
        self.stiffness_n_per_mm = stiffness_n_per_mm;
    }

    /// Returns the damping, N·s/mm, that dissipates the created energy and the energy that the
    /// spring's force will have created after acting for a tick: along that force, and across it if
    /// damping along it is not enough, as where the tip moves around a peak or a point that
    /// friction holds.
    pub(super) fn damping_ns_per_mm(&self, motion: &Motion) -> DampingCoefficients {
        // NaN or infinite at rest, where damping has no effect.
        let damping = |mj: f32, squared: f32, ticks: f32| {
            let max_damping = (ticks * self.tick_s + self.latency_s) * self.stiffness_n_per_mm;
            match mj / (squared * self.tick_s) {
                damping if damping < max_damping => damping,
                _ => max_damping,
            }
        };
        let created_mj = within(self.predicted_mj + motion.along * self.tick_s);
        let along = damping(created_mj, motion.along_squared, MAX_TICKS);
        let left_mj = within(created_mj - along * motion.along_squared * self.tick_s);
        DampingCoefficients {
            along,
            across: damping(left_mj, motion.across_squared, MAX_TICKS_ACROSS),
        }
    }
}

/// Motion of the tip while a force acts.
pub(super) struct Motion {
    /// The force times the velocity, mJ/s.
    pub(super) along: f32,
    /// Squares of the speeds along the force and across it, mm²/s².
    pub(super) along_squared: f32,
    pub(super) across_squared: f32,
}

/// Damping along a force and across it, N·s/mm.
#[derive(Default)]
pub(super) struct DampingCoefficients {
    pub(super) along: f32,
    pub(super) across: f32,
}

/// Limits an energy to its bounds, mJ; NaN counts as zero.
fn within(mj: f32) -> f32 {
    smaller(larger(mj, 0.0), MAX_MJ)
}
