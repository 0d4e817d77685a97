//! Invariants of the reported force under all effects, in each mode in which
//! a current may flow.

use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::guard::{Limits, Mode, WORKING_SHARE};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::TickRecord;

use super::force_share::{Share, Shares};
use super::ground::SceneSurfaces;
use super::limit_cycle::{MAX_TURNS, Swing};

/// Delay of a force after the start of its tick, as a fraction of a tick
/// ([`hapterra_firmware::amplifier::CURRENT_LOOP_US`]).
const DELAY_SHARE: f32 = 0.11;
/// Energy that a contact may create with the controller on, mJ: a hundredth of a tap's without it
/// (docs/explanation/effects.md).
const GAINED_MJ: f32 = 0.05;
/// Additional energy that shaded ground may create until its force is no longer turned
/// (docs/explanation/effects.md), mJ: a constant, a fraction of the largest force times a cell and
/// the depth, and the bound of both.
const SHADED_MJ: f32 = 0.2;
const SHADED_PART: f32 = 0.2;
const MAX_SHADED_MJ: f32 = 2.0;
/// Rounding: a fraction of a force, and a constant in N.
const ROUNDING: f32 = 1e-4;
/// The guard's clamp, N.
const CLAMP_N: f32 = WORKING_SHARE * Calibration::PREMIUM_1_5.max_force_n;
/// Limits that change the force of a scene.
const FORCE_REDUCED: Limits = Limits::SLEW_LIMITED.union(Limits::SPEED_LIMITED);
/// Limits under which a surface is not a spring.
const NO_SPRING_FORCE: Limits = Limits::SPEED_LIMITED
    .union(Limits::TERRAIN_MISSING)
    .union(Limits::EDGE_FADING);

/// Checks the forces of one scene.
pub struct ForceChecks {
    surfaces: SceneSurfaces,
    cell_mm: f32,
    last: Option<TickRecord>,
    /// The force of the tick before the last one.
    before_n: Vec3,
    /// The contact in progress, if all of it is known.
    contact: Option<ContactEnergy>,
    /// The max energy that a contact has added to the tip with the controller on, mJ.
    pub max_gained_mj: f32,
    /// Ticks of these contacts.
    pub watched_ticks: u64,
    /// Those of `watched_ticks` during the ramp.
    pub ramp_ticks: u64,
    /// Those of `watched_ticks` in which the clutch moved.
    pub clutch_ticks: u64,
    share: Share,
    /// The share of force in the last tick, if it is known.
    previous_shares: Option<Shares>,
    swing: Swing,
    /// The most reversals of the tip in a quarter of a second.
    pub max_turns: usize,
}

/// Record of a contact.
#[derive(Clone, Copy, Debug, Default)]
struct ContactEnergy {
    /// The work of its force at the tip, mJ, less the energy due to a rising stiffness.
    gained_mj: f32,
    max_depth_mm: f32,
}

impl ForceChecks {
    /// Creates the checks of a scene.
    #[must_use]
    pub fn new(surfaces: SceneSurfaces, cell_mm: f32) -> Self {
        Self {
            surfaces,
            cell_mm,
            last: None,
            before_n: Vec3::ZERO,
            contact: None,
            max_gained_mj: 0.0,
            watched_ticks: 0,
            ramp_ticks: 0,
            clutch_ticks: 0,
            share: Share::UNKNOWN,
            previous_shares: None,
            swing: Swing::default(),
            max_turns: 0,
        }
    }

    /// Sets another scene.
    pub fn set_surfaces(&mut self, surfaces: SceneSurfaces) {
        self.surfaces = surfaces;
        (self.last, self.contact) = (None, None);
    }

    /// Checks a sample; `is_calm` is true if no fault was injected for a while.
    ///
    /// # Errors
    /// The broken invariant.
    pub fn check(&mut self, sample: &TickRecord, is_calm: bool) -> Result<(), String> {
        let last = self.last.replace(*sample);
        let last = last.filter(|last| last.tick.wrapping_add(1) == sample.tick);
        let before = self.previous_shares;
        let share = self.share.update(last.as_ref(), sample);
        self.previous_shares = share;
        if let Some(last) = &last {
            check_fade(last, sample)?;
        }
        let is_full_force = !sample.limits.intersects(FORCE_REDUCED);
        if let Some(share) =
            share.filter(|_| is_full_force && sample.state == ContactState::Touching)
        {
            let displacement_mm = sample.hip.to(&sample.proxy) * self.cell_mm;
            self.check_size(sample, displacement_mm, share.product())?;
            self.check_no_pull(sample, displacement_mm)?;
        }
        self.check_no_energy_gain(last.as_ref(), sample, before.zip(share), is_calm)
    }

    /// Checks that no force exceeds the stiffest material's at this depth.
    fn check_size(
        &self,
        sample: &TickRecord,
        displacement_mm: Vec3,
        share: f32,
    ) -> Result<(), String> {
        let depth_mm = displacement_mm.length();
        let [high_mm, steep] = self.surfaces.relief();
        let stretch_mm = (depth_mm + high_mm.min(depth_mm)).hypot(steep * depth_mm);
        let spring_n = share * self.surfaces.stiffest_n_per_mm() * stretch_mm;
        let is_damped = self.surfaces.is_damped() || self.surfaces.is_controlled();
        let max_n = if is_damped { 2.0 * spring_n } else { spring_n };
        let force_n = sample.force_n.length();
        match force_n <= max_n * (1.0 + ROUNDING) + ROUNDING {
            true => Ok(()),
            false => Err(format!(
                "{force_n} N at {depth_mm} mm, at most {max_n}: {sample:?}"
            )),
        }
    }

    /// Checks that no force points away from the proxy: friction resists and does not push. Shading
    /// turns a force by 60° at most.
    fn check_no_pull(&self, sample: &TickRecord, displacement_mm: Vec3) -> Result<(), String> {
        let [high_mm, _] = self.surfaces.relief();
        if high_mm > 0.0 && self.surfaces.is_shaded() {
            return Ok(());
        }
        let along = sample.force_n.dot(displacement_mm);
        let min = -ROUNDING * (displacement_mm.length() + 1e-3) * (sample.force_n.length() + 1e-3);
        match along >= min {
            true => Ok(()),
            false => Err(format!(
                "the force pulls along {displacement_mm}: {sample:?}"
            )),
        }
    }

    /// Returns the energy of the spring at a depth, mJ: the guard clamps the clutch's share of the
    /// force, and the ramp scales the result.
    fn stored_share_mj(&self, depth_mm: f32, shares: Shares) -> f32 {
        if shares.clutch == 0.0 {
            return 0.0;
        }
        let max_n = CLAMP_N / shares.clutch;
        shares.product() * self.surfaces.stored_mj(depth_mm, max_n)
    }

    fn shading_mj(&self, max_depth_mm: f32) -> f32 {
        let displacement_mm = self.cell_mm + max_depth_mm;
        let max_gain_mj =
            SHADED_MJ + SHADED_PART * self.surfaces.max_n(max_depth_mm) * displacement_mm;
        max_gain_mj.min(MAX_SHADED_MJ)
    }

    /// Checks that with the controller on no contact returns more energy than it received, at any
    /// time, and that the tip does not swing, within the allowance for shading and texture.
    /// `shares` are those of the last tick and of this one.
    fn check_no_energy_gain(
        &mut self,
        last: Option<&TickRecord>,
        sample: &TickRecord,
        shares: Option<(Shares, Shares)>,
        is_calm: bool,
    ) -> Result<(), String> {
        let before_n =
            std::mem::replace(&mut self.before_n, last.map_or(Vec3::ZERO, |s| s.force_n));
        let is_spring = |sample: &TickRecord| !sample.limits.intersects(NO_SPRING_FORCE);
        let is_checked = self.surfaces.is_spring() && self.surfaces.is_controlled() && is_calm;
        let last = last.filter(|last| is_checked && is_spring(last) && is_spring(sample));
        let Some((last, (before, now))) = last.zip(shares) else {
            (self.contact, self.swing) = (None, Swing::default());
            return Ok(());
        };
        let acted_n = last.force_n + (before_n - last.force_n) * DELAY_SHARE;
        let moved_mm = last.hip.to(&sample.hip) * self.cell_mm;
        let work_mj = acted_n.dot(moved_mm);
        let depth_mm = sample.hip.to(&sample.proxy).length() * self.cell_mm;
        // A rising stiffness may add this energy at this depth.
        let is_rendered = sample.state == ContactState::Touching;
        let intended_mj = match is_rendered {
            true => self.stored_share_mj(depth_mm, now) - self.stored_share_mj(depth_mm, before),
            false => 0.0,
        };
        // A force that fades belongs to the contact before.
        let begins = last.force_n == Vec3::ZERO
            && (last.state == ContactState::Free || before.product() == 0.0);
        self.contact = match begins {
            true => Some(ContactEnergy::default()),
            false => self.contact,
        }
        .map(|previous| ContactEnergy {
            gained_mj: previous.gained_mj + work_mj - intended_mj,
            max_depth_mm: previous.max_depth_mm.max(depth_mm),
        });
        let along = sample.force_n.normalize_or_zero();
        let turns = self.swing.turns(sample.tick, moved_mm, along);
        self.max_turns = self.max_turns.max(turns);
        if turns > MAX_TURNS {
            return Err(format!(
                "the tip swings, {turns} turns in 0.25 s: {sample:?}"
            ));
        }
        let Some(contact) = self.contact else {
            return Ok(());
        };
        self.watched_ticks += 1;
        self.ramp_ticks += u64::from(sample.limits.contains(Limits::RAMPING) && is_rendered);
        self.clutch_ticks += u64::from(sample.limits.contains(Limits::CLUTCH_MOVES) && is_rendered);
        self.max_gained_mj = self.max_gained_mj.max(contact.gained_mj);
        let [high_mm, _] = self.surfaces.relief();
        let textures = 2.0 * self.surfaces.stiffest_n_per_mm() * high_mm * contact.max_depth_mm;
        let shading = match self.surfaces.is_shaded() {
            true => self.shading_mj(contact.max_depth_mm),
            false => 0.0,
        };
        match contact.gained_mj <= GAINED_MJ + shading + textures {
            true => Ok(()),
            false => Err(format!(
                "the contact added too much energy: {contact:?}: {sample:?}"
            )),
        }
    }
}

/// Checks that a fading force only decreases, whatever the tip does, and that with an open
/// clutch only the slew limit leaves any.
fn check_fade(last: &TickRecord, sample: &TickRecord) -> Result<(), String> {
    let (was, is) = (last.force_n, sample.force_n);
    if sample.mode == Mode::Fading && is.length() > was.length() * (1.0 + ROUNDING) {
        return Err(format!(
            "a force of {} N increased while it ramped down: {sample:?}",
            was.length()
        ));
    }
    let is_open = sample.limits.contains(Limits::CLUTCH_OPEN);
    let is_late = sample.limits.contains(Limits::SLEW_LIMITED) || sample.mode == Mode::Fading;
    match is_open && !is_late && is != Vec3::ZERO {
        true => Err(format!("{is} N with an open clutch: {sample:?}")),
        false => Ok(()),
    }
}
