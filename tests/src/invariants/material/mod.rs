//! Oracle of scenes with materials, by docs/how-to/materials.md and
//! docs/explanation/effects.md.
//!
//! The oracle has the class of each sample, and computes in f64 the possible materials. If a proxy
//! lies on the line half way between two samples, both classes are valid: the oracle follows both
//! until the force decides.

mod active_material;
mod force;
mod slides;

use glam::DVec3;
use hapterra_core::Vec3;
use hapterra_core::contact::{ContactOutput, ContactState};
use hapterra_core::force::Shading;
use hapterra_core::guard::Limits;
use hapterra_core::scene::TickRecord;

use super::observed_tick::ObservedTick;
use super::oracle::{TickOracle, Verdict};
use super::{Invariant, Violation};
use crate::scene::loop_replay::Replied;
use crate::scene::materials::Materials;
use crate::scene::run::Scene;
use crate::scene::terrain::Kind;
use active_material::ActiveMaterial;
use force::TickConditions;

/// Distance from the line half way between two samples, cells, within which both classes are valid.
const TIE: f64 = 1e-6;
/// Most alternatives that are followed.
const MAX_CANDIDATES: usize = 256;
/// Ticks a second.
const RATE_HZ: f64 = 1e3;

/// Measurements of an oracle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MaterialCounts {
    /// Points in contact whose full force was checked.
    pub compared_as_vectors: u64,
    /// Points in contact whose force was checked by size only, as shading turned it or it faded.
    pub compared_by_size: u64,
    /// Points in contact that were not checked, after too many alternatives.
    pub open: u64,
    /// Points in contact during a change of material.
    pub changing: u64,
    /// Points at which a proxy slid over a plane.
    pub sliding: u64,
    /// Points in contact with friction.
    pub with_friction: u64,
}

impl MaterialCounts {
    /// Adds another oracle's measurements.
    pub fn add(&mut self, other: &Self) {
        self.compared_as_vectors += other.compared_as_vectors;
        self.compared_by_size += other.compared_by_size;
        self.open += other.open;
        self.changing += other.changing;
        self.sliding += other.sliding;
        self.with_friction += other.with_friction;
    }
}

/// Checks the points of one scene in turn.
pub struct MaterialOracle<'g> {
    position_oracle: TickOracle<'g>,
    materials: &'g Materials,
    kind: Kind,
    shading: Shading,
    shift: [i32; 3],
    /// Materials that may be active; empty if they are unknown.
    candidates: Vec<ActiveMaterial>,
    before: Option<Replied>,
    point: usize,
    /// Its measurements.
    pub counts: MaterialCounts,
}

impl<'g> MaterialOracle<'g> {
    /// Creates the oracle of a scene that is shifted by this many cells.
    #[must_use]
    pub fn new(scene: &'g Scene, materials: &'g Materials, shift: [i32; 3]) -> Self {
        Self {
            position_oracle: TickOracle::new(&scene.terrain),
            materials,
            kind: scene.terrain.kind,
            shading: scene.shading,
            shift,
            candidates: vec![ActiveMaterial::default(materials)],
            before: None,
            point: 0,
            counts: MaterialCounts::default(),
        }
    }

    /// Checks the force of the next point.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn check(&mut self, replied: &Replied) -> Verdict {
        let observed = observed(replied, self.shift);
        self.check_bounds(replied)?;
        self.check_position(&observed)?;
        self.check_force(replied, &observed)?;
        self.before = Some(*replied);
        self.point += 1;
        Ok(())
    }

    /// Checks every force: its limit, and none without a contact.
    fn check_bounds(&self, replied: &Replied) -> Verdict {
        let (force, state) = (replied.sample.force_n.as_dvec3(), replied.sample.state);
        let max = f64::from(self.materials.params.max_force_n);
        let is_bounded = force.length() <= max * (1.0 + 1e-6);
        let may_press = matches!(state, ContactState::Touching | ContactState::Releasing);
        if !is_bounded || !(may_press || force == DVec3::ZERO) {
            return self.fail(
                Invariant::Material,
                format!("{force} N, {max} at most: {replied:?}"),
            );
        }
        Ok(())
    }

    /// Checks that the proxy is where the friction of its last position allows it.
    fn check_position(&mut self, observed: &ObservedTick) -> Verdict {
        let touches = observed.output.state == ContactState::Touching;
        let is_open = self.candidates.is_empty();
        let mut has_friction = is_open;
        let mut last_violation = None;
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.retain(|candidate| {
            let friction = candidate.friction();
            has_friction |= candidate.may_have_friction();
            let verdict = match friction.is_none() {
                true => Ok(()),
                false => self
                    .position_oracle
                    .check_friction(candidate.friction_bounds(), observed)
                    .and_then(|()| self.check_slides(candidate, observed)),
            };
            verdict
                .map_err(|violation| last_violation = Some(violation))
                .is_ok()
        });
        self.counts.with_friction += u64::from(touches && has_friction && !is_open);
        if let (true, Some(violation)) = (candidates.is_empty(), last_violation) {
            return Err(violation);
        }
        self.candidates = candidates;
        self.position_oracle.check_position(observed, has_friction)
    }

    /// Checks that the force is that of a possible material.
    fn check_force(&mut self, replied: &Replied, observed: &ObservedTick) -> Verdict {
        let TickRecord { state, proxy, .. } = replied.sample;
        let touches = state == ContactState::Touching;
        // A point keeps its class, whichever of two equally near classes it has.
        let stays = self
            .before
            .is_some_and(|before| before.sample.proxy == proxy);
        let touched = self.is_touched_before();
        let nearest = self.nearest(replied.proxy);
        let mut next: Vec<ActiveMaterial> = Vec::new();
        let candidates = std::mem::take(&mut self.candidates);
        let was_open = candidates.is_empty();
        for candidate in candidates {
            let own = [candidate.class()];
            let is_own = stays && touched && nearest.contains(&own[0]);
            let nearest = if is_own { &own[..] } else { &nearest };
            for after in candidate.successors(self.materials, state, nearest, &proxy) {
                if !next.iter().any(|one| one.is_same(&after)) {
                    next.push(after);
                }
            }
        }
        if touches {
            self.retain_rendered(&mut next, was_open, replied, observed)?;
        }
        if next.len() > MAX_CANDIDATES {
            next.clear();
        }
        self.candidates = next;
        Ok(())
    }

    fn is_touched_before(&self) -> bool {
        let state = self.before.map(|before| before.sample.state);
        state == Some(ContactState::Touching)
    }

    /// Drops the alternatives with another force.
    fn retain_rendered(
        &mut self,
        candidates: &mut Vec<ActiveMaterial>,
        was_open: bool,
        replied: &Replied,
        observed: &ObservedTick,
    ) -> Verdict {
        self.counts.open += u64::from(was_open);
        if was_open {
            return Ok(());
        }
        let output = self.output(replied, observed);
        let force = replied.sample.force_n.as_dvec3();
        let fades = replied.sample.limits.contains(Limits::EDGE_FADING);
        let is_whole = !fades && self.shading == Shading::None;
        let mut reported = String::new();
        let changing = candidates.iter().any(|candidate| !candidate.is_settled());
        candidates.retain(|candidate| {
            let (is_rendered, expected) = match is_whole {
                true => {
                    let expected = output.force(candidate);
                    let is_rendered = (force - expected.force_n).length() <= expected.allowed_n;
                    (is_rendered, format!("{expected:?}"))
                }
                false => {
                    let [min, max] = output.sizes(candidate, fades);
                    let is_rendered = (min..=max).contains(&force.length());
                    (is_rendered, format!("{min} to {max} N"))
                }
            };
            if !is_rendered {
                reported = format!(
                    "{force} N of {}, {expected} by {candidate:?}",
                    force.length()
                );
            }
            is_rendered
        });
        if candidates.is_empty() {
            return self.fail(Invariant::Material, format!("{reported}: {replied:?}"));
        }
        self.check_no_pull(&output, force, replied)?;
        self.counts.changing += u64::from(changing);
        self.counts.compared_as_vectors += u64::from(is_whole);
        self.counts.compared_by_size += u64::from(!is_whole);
        Ok(())
    }

    /// Checks that no force acts against the spring, and that shading turns it by 60° at most.
    fn check_no_pull(
        &self,
        output: &TickConditions<'_>,
        force: DVec3,
        replied: &Replied,
    ) -> Verdict {
        let (depth, size) = (output.displacement.length(), force.length());
        let is_even = self.materials.table.iter().all(|one| one.texture.is_none());
        let min = match self.shading {
            Shading::None => 0.0,
            Shading::Smooth if is_even => 0.5,
            Shading::Smooth => return Ok(()),
        };
        let off = (output.allowed / depth).min(1.0) + 1e-4;
        if depth > 0.0 && force.dot(output.displacement) < (min - 2.0 * off) * depth * size {
            let detail = format!("{force} N pulls along {}: {replied:?}", output.displacement);
            return self.fail(Invariant::Material, detail);
        }
        Ok(())
    }

    fn output<'p>(&self, replied: &'p Replied, observed: &ObservedTick) -> TickConditions<'p> {
        let cell_mm = f64::from(self.materials.cell_mm);
        let [hip, proxy] = [replied.hip, replied.proxy].map(DVec3::from_array);
        let from = self.before.map_or(replied.hip, |before| before.hip);
        TickConditions {
            displacement: proxy - hip,
            allowed: observed.allowed_in_space(self.position_oracle.terrain),
            proxy: &replied.sample.proxy,
            velocity_mm_s: (hip - DVec3::from_array(from)) * (cell_mm * RATE_HZ),
            max_n: f64::from(self.materials.params.max_force_n),
            cell_mm,
        }
    }

    /// Returns the classes of the samples nearest to a point, each once.
    fn nearest(&self, [x, y, _]: [f64; 3]) -> Vec<u8> {
        let along = |at: f64| {
            let [low, high] = [-TIE, TIE].map(|off| (at + off + 0.5).floor() as i32);
            low..=high
        };
        let mut classes: Vec<u8> = along(x)
            .flat_map(|x| along(y).map(move |y| (x, y)))
            .map(|(x, y)| self.materials.class(x, y))
            .collect();
        classes.sort_unstable();
        classes.dedup();
        classes
    }

    fn fail(&self, invariant: Invariant, detail: String) -> Verdict {
        Err(Violation {
            invariant,
            tick: self.point,
            detail,
        })
    }
}

/// Returns the contact of a point in the form of the other checks. If the whole spring is rendered,
/// the displacement is the vector to the proxy.
fn observed(replied: &Replied, shift: [i32; 3]) -> ObservedTick {
    let TickRecord {
        state, proxy, work, ..
    } = replied.sample;
    let displacement = DVec3::from_array(replied.proxy) - DVec3::from_array(replied.hip);
    let output = ContactOutput {
        state,
        proxy,
        displacement: match state {
            ContactState::Touching => displacement.as_vec3(),
            _ => Vec3::ZERO,
        },
        converged: true,
        missing_tile: None,
        work,
    };
    ObservedTick::new(replied.hip, output, shift)
}
