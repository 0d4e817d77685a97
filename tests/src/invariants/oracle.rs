//! The oracle of every tick: all invariants, in the order in which they are checked.
//!
//! `single_tick` checks the output of one tick, `proxy_position` the proxy, and `tick_to_tick` the
//! change from the tick before.

use hapterra_core::contact::{Friction, WORK_PER_TICK};
use hapterra_core::force::Texture;

use super::material::Judged;
use super::observed_tick::ObservedTick;
use super::texture::TextureOracle;
use super::{Invariant, Violation};
use crate::scene::run::Scene;
use crate::scene::terrain::Terrain;

/// Measurements of the oracle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// Ticks unseeded, free, touching and releasing.
    pub states: [u64; 4],
    /// Ticks that did not converge.
    pub unconverged: u64,
    /// Most work units in a tick.
    pub work: u32,
    /// Largest distance of a proxy from the surface, cells, with the HIP within
    /// a few cells.
    pub off_surface: f64,
    /// Largest distance from the exact closest point, cells, among those within
    /// the bound of gentle patches.
    pub off_minimum: f64,
    /// Results compared with the exact closest point.
    pub judged: u64,
    /// Those of `judged` beyond that bound, because of steep ground or a badly conditioned minimum.
    pub beyond: u64,
    /// Paths that met the surface but ended free: around a pole.
    pub around: u64,
    /// Most ticks in a row in which a proxy in the air made no progress.
    pub stalled: u32,
    /// Metamorphic tests compared to the end: repeated, shifted, in another window, mirrored or
    /// turned.
    pub twins: [u64; 4],
    /// Measurements on materials.
    pub on_materials: Judged,
    /// Metamorphic tests on materials, to the end: in another window, shifted, mirrored or turned.
    pub twins_on_materials: [u64; 3],
}

impl Measured {
    /// Adds another oracle's measurements.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.states.iter_mut().zip(other.states) {
            *own += other;
        }
        for (own, other) in self.twins.iter_mut().zip(other.twins) {
            *own += other;
        }
        let twins = self.twins_on_materials.iter_mut();
        for (own, other) in twins.zip(other.twins_on_materials) {
            *own += other;
        }
        self.on_materials.add(&other.on_materials);
        self.unconverged += other.unconverged;
        self.work = self.work.max(other.work);
        self.off_surface = self.off_surface.max(other.off_surface);
        self.off_minimum = self.off_minimum.max(other.off_minimum);
        self.judged += other.judged;
        self.beyond += other.beyond;
        self.around += other.around;
        self.stalled = self.stalled.max(other.stalled);
    }
}

/// Checks the ticks of one scene in turn.
pub struct TickOracle<'g> {
    pub(super) terrain: &'g Terrain,
    pub(super) friction: Friction,
    texture: Option<TextureOracle>,
    /// Work units that a tick may spend.
    pub(super) work: u32,
    /// Ticks in a row in which the proxy has not moved.
    pub(super) still: u32,
    tick: usize,
    pub(super) before: Option<ObservedTick>,
    /// Position of the proxy at the start of its motion for the last HIP.
    pub(super) began: [f64; 3],
    /// Displacement, cells, when the release began.
    pub(super) let_go_from: f64,
    /// Ticks in a row in which a proxy in the air made no progress.
    pub(super) stalled: u32,
    /// Its measurements.
    pub measured: Measured,
}

/// Verdict on a tick.
pub type Verdict = Result<(), Violation>;

impl<'g> TickOracle<'g> {
    /// Creates the oracle of a terrain.
    #[must_use]
    pub fn new(terrain: &'g Terrain) -> Self {
        Self {
            terrain,
            friction: Friction::NONE,
            texture: None,
            work: WORK_PER_TICK,
            still: 0,
            tick: 0,
            before: None,
            began: [0.0; 3],
            let_go_from: 0.0,
            stalled: 0,
            measured: Measured::default(),
        }
    }

    /// Creates the oracle of a scene.
    #[must_use]
    pub fn of(scene: &'g Scene) -> Self {
        let judge = Self::new(&scene.terrain)
            .with_friction(scene.friction)
            .with_texture(scene.texture);
        Self {
            work: scene.settings().work_per_tick,
            ..judge
        }
    }

    /// Returns the oracle for a surface with friction.
    #[must_use]
    pub fn with_friction(self, friction: Friction) -> Self {
        Self { friction, ..self }
    }

    /// Returns the oracle for a surface with a texture, or with none.
    #[must_use]
    pub fn with_texture(self, texture: Texture) -> Self {
        let texture = (!texture.is_none()).then(|| TextureOracle::new(texture));
        Self { texture, ..self }
    }

    /// Checks the next tick.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn look(&mut self, seen: &ObservedTick) -> Verdict {
        self.all(seen).into_iter().next().map_or(Ok(()), Err)
    }

    /// Checks the proxy of the next tick and its motion, but not its force. If friction may hold it
    /// (`is_rubbed`), [`Self::is_held_by`] checks that before.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn look_at_place(&mut self, seen: &ObservedTick, is_rubbed: bool) -> Verdict {
        self.is_finite(seen)?;
        self.is_within_work(seen)?;
        if seen.is_touching() {
            self.is_on_surface(seen)?;
            if !is_rubbed {
                self.is_local_minimum(seen)?;
            }
            self.is_hip_below(seen)?;
        }
        if seen.is_free() {
            self.is_above(seen, self.before.as_ref())?;
        }
        if let Some(before) = self.before {
            self.was_seen_above(&before, seen)?;
            self.descends(&before, seen)?;
            if before.is_free() {
                self.first_crossing(&before, seen)?;
            }
            self.passes_no_wall(&before, seen)?;
        }
        let stays = self.before.is_some_and(|before| seen.stays(&before));
        self.still = if stays { self.still + 1 } else { 0 };
        self.remembers(seen);
        Ok(())
    }

    fn remembers(&mut self, seen: &ObservedTick) {
        self.began = match self.before {
            Some(before) => self.begun_at(&before, seen),
            None => seen.proxy,
        };
        self.before = Some(*seen);
        self.tick += 1;
    }

    /// Checks that the proxy of the next tick is where a friction between these two allows it.
    ///
    /// # Errors
    /// [`Invariant::Cone`] and [`Invariant::Stuck`].
    pub fn is_held_by(&mut self, [least, most]: [Friction; 2], seen: &ObservedTick) -> Verdict {
        self.friction = most;
        if seen.is_touching() {
            self.is_in_cone(seen)?;
        }
        self.friction = least;
        if seen.is_touching() {
            self.is_held_back(seen)?;
        }
        let still = self.still;
        let verdict = match self.before {
            Some(before) => self.sticks(&before, seen),
            None => Ok(()),
        };
        self.still = still;
        verdict
    }

    /// Checks only the texture of the next tick.
    ///
    /// # Errors
    /// [`Invariant::Texture`].
    pub fn look_at_texture(&mut self, seen: &ObservedTick) -> Verdict {
        let verdict = self.is_textured(seen);
        self.tick += 1;
        verdict
    }

    /// Checks the next tick. Returns all violations.
    pub fn all(&mut self, seen: &ObservedTick) -> Vec<Violation> {
        let output = &seen.output;
        self.measured.states[output.state as usize] += 1;
        self.measured.unconverged += u64::from(!output.converged);
        self.measured.work = self.measured.work.max(output.work);
        let mut reported = Vec::new();
        reported.extend(self.is_finite(seen).err());
        if reported.is_empty() {
            self.finite(seen, &mut reported);
        }
        self.remembers(seen);
        reported
    }

    fn finite(&mut self, seen: &ObservedTick, reported: &mut Vec<Violation>) {
        reported.extend(self.is_within_work(seen).err());
        reported.extend(self.is_clamped(seen).err());
        reported.extend(self.is_consistent(seen).err());
        reported.extend(self.is_shaded(seen).err());
        reported.extend(self.is_textured(seen).err());
        if seen.is_touching() {
            reported.extend(self.is_on_surface(seen).err());
        }
        if seen.is_touching() && seen.output.converged {
            if self.friction.is_none() {
                reported.extend(self.is_local_minimum(seen).err());
            } else {
                reported.extend(self.is_in_cone(seen).err());
                reported.extend(self.is_held_back(seen).err());
            }
            reported.extend(self.is_hip_below(seen).err());
        }
        if seen.is_free() {
            reported.extend(self.is_above(seen, self.before.as_ref()).err());
        }
        if let Some(before) = self.before {
            self.since(&before, seen, reported);
        }
    }

    fn since(&mut self, before: &ObservedTick, seen: &ObservedTick, reported: &mut Vec<Violation>) {
        reported.extend(self.was_seen_above(before, seen).err());
        reported.extend(self.fades(before, seen).err());
        reported.extend(self.lets_go_gently(before, seen).err());
        reported.extend(self.descends(before, seen).err());
        reported.extend(self.stays_in_basin(before, seen).err());
        reported.extend(self.advances(before, seen).err());
        if before.is_free() {
            reported.extend(self.first_crossing(before, seen).err());
        }
        reported.extend(self.passes_no_wall(before, seen).err());
        if !self.friction.is_none() {
            reported.extend(self.sticks(before, seen).err());
        }
    }

    /// Checks that the force is the untextured one plus the texture's.
    fn is_textured(&mut self, seen: &ObservedTick) -> Verdict {
        let judged = self.texture.as_mut().map(|judge| judge.look(seen));
        match judged {
            Some(Err(detail)) => self.fail(Invariant::Texture, detail),
            _ => Ok(()),
        }
    }

    pub(super) fn fail(&self, invariant: Invariant, detail: String) -> Verdict {
        Err(Violation {
            invariant,
            tick: self.tick,
            detail,
        })
    }
}
