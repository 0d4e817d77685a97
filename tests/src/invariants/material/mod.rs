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
const HALF_WAY: f64 = 1e-6;
/// Most alternatives that are followed.
const FOLLOWED: usize = 256;
/// Ticks a second.
const RATE_HZ: f64 = 1e3;

/// Measurements of an oracle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Judged {
    /// Points in contact whose full force was checked.
    pub in_whole: u64,
    /// Points in contact whose force was checked by size only, as shading turned it or it faded.
    pub by_size: u64,
    /// Points in contact that were not checked, after too many alternatives.
    pub open: u64,
    /// Points in contact during a change of material.
    pub changing: u64,
    /// Points at which a proxy slid over a plane.
    pub sliding: u64,
    /// Points in contact with friction.
    pub rubbed: u64,
}

impl Judged {
    /// Adds another oracle's measurements.
    pub fn add(&mut self, other: &Self) {
        self.in_whole += other.in_whole;
        self.by_size += other.by_size;
        self.open += other.open;
        self.changing += other.changing;
        self.sliding += other.sliding;
        self.rubbed += other.rubbed;
    }
}

/// Checks the points of one scene in turn.
pub struct MaterialOracle<'g> {
    place: TickOracle<'g>,
    materials: &'g Materials,
    kind: Kind,
    shading: Shading,
    shift: [i32; 3],
    /// Materials that may be active; empty if they are unknown.
    courses: Vec<ActiveMaterial>,
    before: Option<Replied>,
    point: usize,
    /// Its measurements.
    pub judged: Judged,
}

impl<'g> MaterialOracle<'g> {
    /// Creates the oracle of a scene that is shifted by this many cells.
    #[must_use]
    pub fn new(scene: &'g Scene, materials: &'g Materials, shift: [i32; 3]) -> Self {
        Self {
            place: TickOracle::new(&scene.terrain),
            materials,
            kind: scene.terrain.kind,
            shading: scene.shading,
            shift,
            courses: vec![ActiveMaterial::default(materials)],
            before: None,
            point: 0,
            judged: Judged::default(),
        }
    }

    /// Checks the force of the next point.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn look(&mut self, replied: &Replied) -> Verdict {
        let seen = seen(replied, self.shift);
        self.is_bounded(replied)?;
        self.place_is_right(&seen)?;
        self.force_is_right(replied, &seen)?;
        self.before = Some(*replied);
        self.point += 1;
        Ok(())
    }

    /// Checks every force: its limit, and none without a contact.
    fn is_bounded(&self, replied: &Replied) -> Verdict {
        let (force, state) = (replied.sample.force_n.as_dvec3(), replied.sample.state);
        let most = f64::from(self.materials.params.max_force_n);
        let is_bounded = force.length() <= most * (1.0 + 1e-6);
        let may_press = matches!(state, ContactState::Touching | ContactState::Releasing);
        if !is_bounded || !(may_press || force == DVec3::ZERO) {
            return self.fail(
                Invariant::Material,
                format!("{force} N, {most} at most: {replied:?}"),
            );
        }
        Ok(())
    }

    /// Checks that the proxy is where the friction of its last position allows it.
    fn place_is_right(&mut self, seen: &ObservedTick) -> Verdict {
        let touches = seen.output.state == ContactState::Touching;
        let is_open = self.courses.is_empty();
        let mut is_rubbed = is_open;
        let mut wrong = None;
        let mut courses = std::mem::take(&mut self.courses);
        courses.retain(|course| {
            let friction = course.friction();
            is_rubbed |= course.may_rub();
            let verdict = match friction.is_none() {
                true => Ok(()),
                false => self
                    .place
                    .is_held_by(course.frictions(), seen)
                    .and_then(|()| self.slides(course, seen)),
            };
            verdict.map_err(|violation| wrong = Some(violation)).is_ok()
        });
        self.judged.rubbed += u64::from(touches && is_rubbed && !is_open);
        if let (true, Some(violation)) = (courses.is_empty(), wrong) {
            return Err(violation);
        }
        self.courses = courses;
        self.place.look_at_place(seen, is_rubbed)
    }

    /// Checks that the force is that of a possible material.
    fn force_is_right(&mut self, replied: &Replied, seen: &ObservedTick) -> Verdict {
        let TickRecord { state, proxy, .. } = replied.sample;
        let touches = state == ContactState::Touching;
        // A point keeps its class, whichever of two equally near classes it has.
        let stays = self
            .before
            .is_some_and(|before| before.sample.proxy == proxy);
        let touched = self.is_touched_before();
        let nearest = self.nearest(replied.proxy);
        let mut next: Vec<ActiveMaterial> = Vec::new();
        let courses = std::mem::take(&mut self.courses);
        let was_open = courses.is_empty();
        for course in courses {
            let own = [course.wanted()];
            let is_own = stays && touched && nearest.contains(&own[0]);
            let nearest = if is_own { &own[..] } else { &nearest };
            for after in course.after(self.materials, state, nearest, &proxy) {
                if !next.iter().any(|one| one.is_same(&after)) {
                    next.push(after);
                }
            }
        }
        if touches {
            self.keep_rendered(&mut next, was_open, replied, seen)?;
        }
        if next.len() > FOLLOWED {
            next.clear();
        }
        self.courses = next;
        Ok(())
    }

    fn is_touched_before(&self) -> bool {
        let state = self.before.map(|before| before.sample.state);
        state == Some(ContactState::Touching)
    }

    /// Drops the alternatives with another force.
    fn keep_rendered(
        &mut self,
        courses: &mut Vec<ActiveMaterial>,
        was_open: bool,
        replied: &Replied,
        seen: &ObservedTick,
    ) -> Verdict {
        self.judged.open += u64::from(was_open);
        if was_open {
            return Ok(());
        }
        let output = self.output(replied, seen);
        let force = replied.sample.force_n.as_dvec3();
        let fades = replied.sample.limits.contains(Limits::EDGE_FADING);
        let is_whole = !fades && self.shading == Shading::None;
        let mut reported = String::new();
        let changing = courses.iter().any(|course| !course.is_settled());
        courses.retain(|course| {
            let (is_rendered, wanted) = match is_whole {
                true => {
                    let wanted = output.force(course);
                    let is_rendered = (force - wanted.force_n).length() <= wanted.allowed_n;
                    (is_rendered, format!("{wanted:?}"))
                }
                false => {
                    let [least, most] = output.sizes(course, fades);
                    let is_rendered = (least..=most).contains(&force.length());
                    (is_rendered, format!("{least} to {most} N"))
                }
            };
            if !is_rendered {
                reported = format!("{force} N of {}, {wanted} by {course:?}", force.length());
            }
            is_rendered
        });
        if courses.is_empty() {
            return self.fail(Invariant::Material, format!("{reported}: {replied:?}"));
        }
        self.never_pulls(&output, force, replied)?;
        self.judged.changing += u64::from(changing);
        self.judged.in_whole += u64::from(is_whole);
        self.judged.by_size += u64::from(!is_whole);
        Ok(())
    }

    /// Checks that no force acts against the spring, and that shading turns it by 60° at most.
    fn never_pulls(&self, output: &TickConditions<'_>, force: DVec3, replied: &Replied) -> Verdict {
        let (depth, size) = (output.way.length(), force.length());
        let is_even = self.materials.table.iter().all(|one| one.texture.is_none());
        let least = match self.shading {
            Shading::None => 0.0,
            Shading::Smooth if is_even => 0.5,
            Shading::Smooth => return Ok(()),
        };
        let off = (output.allowed / depth).min(1.0) + 1e-4;
        if depth > 0.0 && force.dot(output.way) < (least - 2.0 * off) * depth * size {
            let detail = format!("{force} N pulls along {}: {replied:?}", output.way);
            return self.fail(Invariant::Material, detail);
        }
        Ok(())
    }

    fn output<'p>(&self, replied: &'p Replied, seen: &ObservedTick) -> TickConditions<'p> {
        let cell_mm = f64::from(self.materials.cell_mm);
        let [hip, proxy] = [replied.hip, replied.proxy].map(DVec3::from_array);
        let from = self.before.map_or(replied.hip, |before| before.hip);
        TickConditions {
            way: proxy - hip,
            allowed: seen.allowed_in_space(self.place.terrain),
            proxy: &replied.sample.proxy,
            velocity_mm_s: (hip - DVec3::from_array(from)) * (cell_mm * RATE_HZ),
            max_n: f64::from(self.materials.params.max_force_n),
            cell_mm,
        }
    }

    /// Returns the classes of the samples nearest to a point, each once.
    fn nearest(&self, [x, y, _]: [f64; 3]) -> Vec<u8> {
        let along = |at: f64| {
            let [low, high] = [-HALF_WAY, HALF_WAY].map(|off| (at + off + 0.5).floor() as i32);
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
fn seen(replied: &Replied, shift: [i32; 3]) -> ObservedTick {
    let TickRecord {
        state, proxy, work, ..
    } = replied.sample;
    let way = DVec3::from_array(replied.proxy) - DVec3::from_array(replied.hip);
    let output = ContactOutput {
        state,
        proxy,
        displacement: match state {
            ContactState::Touching => way.as_vec3(),
            _ => Vec3::ZERO,
        },
        converged: true,
        missing_tile: None,
        work,
    };
    ObservedTick::new(replied.hip, output, shift)
}
