//! The oracle of every tick: all invariants, in the order in which they are checked.
//!
//! `single_tick` checks the output of one tick, `proxy_position` the proxy, and `tick_to_tick` the
//! change from the tick before.

use hapterra_core::contact::{Friction, WORK_PER_TICK};
use hapterra_core::force::Texture;

use super::material::MaterialCounts;
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
    pub compared: u64,
    /// Those of `compared` beyond that bound, because of steep ground or a badly conditioned
    /// minimum.
    pub beyond: u64,
    /// Paths that met the surface but ended free: around a pole.
    pub around: u64,
    /// Most ticks in a row in which a proxy in the air made no progress.
    pub stalled: u32,
    /// Metamorphic tests compared to the end: repeated, shifted, in another window, mirrored or
    /// turned.
    pub metamorphic: [u64; 4],
    /// Measurements on materials.
    pub on_materials: MaterialCounts,
    /// Metamorphic tests on materials, to the end: in another window, shifted, mirrored or turned.
    pub metamorphic_on_materials: [u64; 3],
}

impl Measured {
    /// Adds another oracle's measurements.
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.states.iter_mut().zip(other.states) {
            *own += other;
        }
        for (own, other) in self.metamorphic.iter_mut().zip(other.metamorphic) {
            *own += other;
        }
        let metamorphic = self.metamorphic_on_materials.iter_mut();
        for (own, other) in metamorphic.zip(other.metamorphic_on_materials) {
            *own += other;
        }
        self.on_materials.add(&other.on_materials);
        self.unconverged += other.unconverged;
        self.work = self.work.max(other.work);
        self.off_surface = self.off_surface.max(other.off_surface);
        self.off_minimum = self.off_minimum.max(other.off_minimum);
        self.compared += other.compared;
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
    pub(super) released_from: f64,
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
            released_from: 0.0,
            stalled: 0,
            measured: Measured::default(),
        }
    }

    /// Creates the oracle of a scene.
    #[must_use]
    pub fn of(scene: &'g Scene) -> Self {
        let oracle = Self::new(&scene.terrain)
            .with_friction(scene.friction)
            .with_texture(scene.texture);
        Self {
            work: scene.settings().work_per_tick,
            ..oracle
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
    pub fn check(&mut self, observed: &ObservedTick) -> Verdict {
        self.violations(observed)
            .into_iter()
            .next()
            .map_or(Ok(()), Err)
    }

    /// Checks the proxy of the next tick and its motion, but not its force. If friction may hold it
    /// (`is_rubbed`), [`Self::check_friction`] checks that before.
    ///
    /// # Errors
    /// The first invariant that it breaks.
    pub fn check_position(&mut self, observed: &ObservedTick, is_rubbed: bool) -> Verdict {
        self.check_finite(observed)?;
        self.check_work(observed)?;
        if observed.is_touching() {
            self.check_on_surface(observed)?;
            if !is_rubbed {
                self.check_local_minimum(observed)?;
            }
            self.check_hip_below(observed)?;
        }
        if observed.is_free() {
            self.check_above(observed, self.before.as_ref())?;
        }
        if let Some(before) = self.before {
            self.check_seen_from_above(&before, observed)?;
            self.check_descent(&before, observed)?;
            if before.is_free() {
                self.check_first_crossing(&before, observed)?;
            }
            self.check_no_wall_crossed(&before, observed)?;
        }
        let stays = self.before.is_some_and(|before| observed.stays(&before));
        self.still = if stays { self.still + 1 } else { 0 };
        self.remember(observed);
        Ok(())
    }

    fn remember(&mut self, observed: &ObservedTick) {
        self.began = match self.before {
            Some(before) => self.slip_start(&before, observed),
            None => observed.proxy,
        };
        self.before = Some(*observed);
        self.tick += 1;
    }

    /// Checks that the proxy of the next tick is where a friction between these two allows it.
    ///
    /// # Errors
    /// [`Invariant::Cone`] and [`Invariant::Stuck`].
    pub fn check_friction(
        &mut self,
        [min, max]: [Friction; 2],
        observed: &ObservedTick,
    ) -> Verdict {
        self.friction = max;
        if observed.is_touching() {
            self.check_cone(observed)?;
        }
        self.friction = min;
        if observed.is_touching() {
            self.check_held_back(observed)?;
        }
        let still = self.still;
        let verdict = match self.before {
            Some(before) => self.check_sticks(&before, observed),
            None => Ok(()),
        };
        self.still = still;
        verdict
    }

    /// Checks only the texture of the next tick.
    ///
    /// # Errors
    /// [`Invariant::Texture`].
    pub fn check_texture(&mut self, observed: &ObservedTick) -> Verdict {
        let verdict = self.check_texture_force(observed);
        self.tick += 1;
        verdict
    }

    /// Checks the next tick. Returns all violations.
    pub fn violations(&mut self, observed: &ObservedTick) -> Vec<Violation> {
        let output = &observed.output;
        self.measured.states[output.state as usize] += 1;
        self.measured.unconverged += u64::from(!output.converged);
        self.measured.work = self.measured.work.max(output.work);
        let mut reported = Vec::new();
        reported.extend(self.check_finite(observed).err());
        if reported.is_empty() {
            self.check_finite_tick(observed, &mut reported);
        }
        self.remember(observed);
        reported
    }

    fn check_finite_tick(&mut self, observed: &ObservedTick, reported: &mut Vec<Violation>) {
        reported.extend(self.check_work(observed).err());
        reported.extend(self.check_clamp(observed).err());
        reported.extend(self.check_consistent(observed).err());
        reported.extend(self.check_shading(observed).err());
        reported.extend(self.check_texture_force(observed).err());
        if observed.is_touching() {
            reported.extend(self.check_on_surface(observed).err());
        }
        if observed.is_touching() && observed.output.converged {
            if self.friction.is_none() {
                reported.extend(self.check_local_minimum(observed).err());
            } else {
                reported.extend(self.check_cone(observed).err());
                reported.extend(self.check_held_back(observed).err());
            }
            reported.extend(self.check_hip_below(observed).err());
        }
        if observed.is_free() {
            reported.extend(self.check_above(observed, self.before.as_ref()).err());
        }
        if let Some(before) = self.before {
            self.check_against_previous(&before, observed, reported);
        }
    }

    fn check_against_previous(
        &mut self,
        before: &ObservedTick,
        observed: &ObservedTick,
        reported: &mut Vec<Violation>,
    ) {
        reported.extend(self.check_seen_from_above(before, observed).err());
        reported.extend(self.check_fade(before, observed).err());
        reported.extend(self.check_release(before, observed).err());
        reported.extend(self.check_descent(before, observed).err());
        reported.extend(self.check_basin(before, observed).err());
        reported.extend(self.check_advance(before, observed).err());
        if before.is_free() {
            reported.extend(self.check_first_crossing(before, observed).err());
        }
        reported.extend(self.check_no_wall_crossed(before, observed).err());
        if !self.friction.is_none() {
            reported.extend(self.check_sticks(before, observed).err());
        }
    }

    /// Checks that the force is the untextured one plus the texture's.
    fn check_texture_force(&mut self, observed: &ObservedTick) -> Verdict {
        let compared = self.texture.as_mut().map(|oracle| oracle.check(observed));
        match compared {
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
