//! A scene by its seed and number, and its run, tick by tick.

use hapterra_core::Vec3;
use hapterra_core::contact::{
    Contact, ContactOutput, ContactSettings, Friction, WORK_PER_TICK, work_per_tick,
};
use hapterra_core::force::{Pattern, Shader, Shading, Texture, Texturer};
use hapterra_core::grid::GridPoint;
use hapterra_core::rate::TickRate;
use hapterra_core::terrain::TileIndex;

use super::hip_path;
use super::materials::Materials;
use super::terrain::{KINDS, Terrain};
use super::tile_supply::{Buffers, SIDE, SuppliedWindow, Supply};
use crate::invariants::observed_tick::{ObservedTick, Shaded};
use crate::invariants::{Invariant, Violation};
use crate::random::Random;
use crate::whole_field::point;

/// Work units of a tick at 10 kHz.
pub(super) const MIN_WORK_PER_TICK: u32 = match TickRate::new(10_000) {
    Some(rate) => work_per_tick(rate),
    None => WORK_PER_TICK,
};

/// Ticks that one HIP may be repeated for in lock-step.
const TIMEOUT: usize = 20_000;
/// One scene in this many has a HIP that stays deep.
const DEEP_EVERY: u64 = 8;

/// A terrain, a path of the HIP, and the settings of the rendering.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The terrain.
    pub terrain: Terrain,
    /// The HIP, cells.
    pub path: Vec<[f64; 3]>,
    /// Execution: a tick once, or repeated until it is done.
    pub execution: Execution,
    /// Supply of the tiles.
    pub supply: Supply,
    /// Friction of the surface.
    pub friction: Friction,
    /// Normals that the force follows.
    pub shading: Shading,
    /// Texture of the surface, with cells of a millimetre.
    pub texture: Texture,
    /// Materials of the ground, for an additional replay on materials.
    pub materials: Option<Materials>,
    /// True if the contact uses its fast paths.
    pub fast_paths: bool,
    /// Work units of a tick at 1 kHz or at 10 kHz.
    pub(super) work_per_tick: u32,
    /// The metamorphic tests that are run.
    pub(super) metamorphic: Metamorphic,
    /// Seed of the metamorphic tests' random choices.
    pub(super) seed: u64,
}

/// The surface of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Surface {
    /// Frictionless.
    #[default]
    Smooth,
    /// With friction, drawn from the scene.
    Rough,
}

impl Surface {
    /// Returns its option of `cargo xtask soak`, after a space.
    #[must_use]
    pub const fn option(self) -> &'static str {
        match self {
            Self::Smooth => "",
            Self::Rough => " --rough",
        }
    }
}

/// The grating of a scene from [`Scene::new`].
const GRATING: Texture = Texture {
    pattern: Pattern::Grating,
    amplitude_mm: 0.05,
    wavelength_mm: 0.5,
    ..Texture::NONE
};

/// Returns true if a texture is the same a multiple of 32 cells away, with cells of `cell_mm`.
pub(super) fn is_alike(texture: &Texture, cell_mm: f32) -> bool {
    // Wave numbers without rounding.
    let fits = [0.25, 0.5, 1.0, 8.0, 32.0].contains(&texture.wavelength_mm)
        && (32.0 * cell_mm / texture.wavelength_mm).fract() == 0.0;
    match texture.pattern {
        Pattern::None => true,
        Pattern::Grain => false,
        Pattern::Grating => fits && texture.direction_deg == 0.0,
    }
}

/// Draws a friction.
pub(super) fn friction(random: &mut Random) -> Friction {
    let dynamic_mu = [0.05, 0.3, 0.7, 2.0][random.below(4)];
    let static_mu = dynamic_mu * [1.0, 1.0, 1.3, 2.0][random.below(4)];
    let viscous_s = [0.0, 0.0, 0.003, 0.05][random.below(4)];
    Friction {
        static_mu,
        dynamic_mu,
        viscous_s,
    }
}

/// Draws the texture of a scene, if it has one.
pub(super) fn texture(mixed: u64) -> Texture {
    // From a generator of its own, so that the rest of a scene stays as it was.
    let mut random = Random::new(mixed ^ 0x7e87_0e5e);
    let pattern = [Pattern::None, Pattern::Grain, Pattern::Grating][random.below(3)];
    if pattern == Pattern::None {
        return Texture::NONE;
    }
    let wavelength_mm = [0.25, 0.5, 1.0, 1.7, 8.0, 32.0, 100.0][random.below(7)];
    let max_mm = (wavelength_mm * Texture::STEEPEST).min(Texture::MAX_AMPLITUDE_MM);
    Texture {
        pattern,
        amplitude_mm: max_mm * [0.02, 0.4, 1.0][random.below(3)],
        wavelength_mm,
        direction_deg: [0.0, 0.0, 33.0, -120.0][random.below(4)],
        seed: [0, 1, random.bits() as u32][random.below(3)],
    }
}

/// Metamorphic tests of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Metamorphic {
    /// One of them, or none, as a stress test has many scenes.
    One(usize),
    /// All of them.
    All,
}

impl Scene {
    /// Draws the scene of this number and seed.
    #[must_use]
    pub fn random(seed: u64, number: u64) -> Self {
        let mixed = seed ^ number.wrapping_mul(0xd134_2543_de82_ef95);
        let mut random = Random::new(mixed);
        let kind = KINDS[random.below(KINDS.len())];
        // A hundred patches a side, or more than the window can store, or a strip of thousands.
        let (size, supply) = match random.below(4) {
            0 | 1 => ([70 + random.below(60) as i32, 90], Supply::Preloaded),
            2 => ([200, 256], Supply::Preloaded),
            _ => {
                let latency = [0, 3, 40][random.below(3)];
                let size = [[1500, 40], [130, 120], [520, 400]][random.below(3)];
                (size, Supply::OnDemand { latency })
            }
        };
        let terrain = Terrain::new(kind, size, random.bits());
        let ticks = 300 + random.below(500);
        // By number, so that the scenes of the other kind stay as they were.
        let path = match number % DEEP_EVERY {
            0 => hip_path::deep(&terrain, &mut random, ticks),
            _ => hip_path::random(&terrain, &mut random, ticks),
        };
        let materials = Materials::drawn(mixed, &terrain);
        let execution = if random.below(2) == 0 {
            Execution::RealTime
        } else {
            Execution::LockStep
        };
        Self {
            terrain,
            path,
            execution,
            supply,
            friction: Friction::NONE,
            // By number, like the path.
            shading: [Shading::None, Shading::Smooth][(number / 2 % 2) as usize],
            texture: texture(mixed),
            materials,
            fast_paths: true,
            metamorphic: Metamorphic::One(random.below(6)),
            // By number, like the path.
            work_per_tick: [WORK_PER_TICK, MIN_WORK_PER_TICK][(number / 4 % 2) as usize],
            seed: random.bits(),
        }
    }

    /// Returns the scene with this surface.
    #[must_use]
    pub fn with_surface(self, surface: Surface) -> Self {
        if surface == Surface::Smooth {
            return self;
        }
        Self {
            friction: friction(&mut Random::new(self.seed ^ 0xf71c_7104)),
            materials: self.materials.map(Materials::roughened),
            ..self
        }
    }

    /// Creates a scene with the work of a tick at 10 kHz and all metamorphic tests.
    #[must_use]
    pub const fn new(
        terrain: Terrain,
        path: Vec<[f64; 3]>,
        execution: Execution,
        supply: Supply,
    ) -> Self {
        Self {
            terrain,
            path,
            execution,
            supply,
            friction: Friction::NONE,
            shading: Shading::Smooth,
            texture: GRATING,
            materials: None,
            fast_paths: true,
            metamorphic: Metamorphic::All,
            work_per_tick: MIN_WORK_PER_TICK,
            seed: 1,
        }
    }

    /// Returns the settings of its contact.
    #[must_use]
    pub const fn settings(&self) -> ContactSettings {
        ContactSettings {
            friction: self.friction,
            fast_paths: self.fast_paths,
            work_per_tick: self.work_per_tick,
            ..ContactSettings::AT_1_KHZ
        }
    }

    /// Runs it over the terrain shifted by `shift` cells, and calls `check` for each tick.
    ///
    /// # Errors
    /// The error of `check`, or a tick that does not converge.
    pub fn render(
        &self,
        buffers: &mut Buffers,
        shift: [i32; 3],
        supply: Supply,
        check: impl FnMut(&ObservedTick) -> Result<(), Violation>,
    ) -> Result<Vec<ObservedTick>, Violation> {
        self.render_in::<SIDE>(buffers, shift, supply, check)
    }

    /// Same as [`Self::render`] with a window of `D × D` tiles.
    ///
    /// # Errors
    /// Like [`Self::render`].
    pub fn render_in<const D: usize>(
        &self,
        buffers: &mut Buffers,
        shift: [i32; 3],
        supply: Supply,
        mut check: impl FnMut(&ObservedTick) -> Result<(), Violation>,
    ) -> Result<Vec<ObservedTick>, Violation> {
        let mut player = Player::<D>::new(self, buffers, shift, supply);
        let mut all = Vec::with_capacity(self.path.len());
        for (tick, hip) in self.path.iter().enumerate() {
            let output = player.step(*hip).ok_or_else(|| Violation {
                invariant: Invariant::Settles,
                tick,
                detail: format!("never settles for {hip:?}"),
            })?;
            let observed = player.observed(*hip, output);
            check(&observed)?;
            all.push(observed);
        }
        Ok(all)
    }

    /// Returns true if its texture is the same a multiple of 32 cells away.
    #[must_use]
    pub fn is_textured_alike(&self) -> bool {
        is_alike(&self.texture, 1.0)
    }

    /// Returns the same settings over another terrain, with another path of the HIP.
    #[must_use]
    pub fn with(&self, terrain: Terrain, path: Vec<[f64; 3]>) -> Self {
        Self {
            terrain,
            path,
            materials: self.materials.clone(),
            ..*self
        }
    }
}

/// Condition for the result of a HIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Execution {
    /// After one tick.
    RealTime,
    /// When it has converged with all of the terrain it needs, as in a replay.
    LockStep,
}

/// A contact in a scene, tick by tick.
pub struct Player<'t, 'g, const D: usize> {
    /// Its state, for tests that repeat a tick.
    pub contact: Contact,
    shader: Option<Shader>,
    /// The last displacement, shaded.
    shaded: Vec3,
    texturer: Option<Texturer>,
    /// The last displacement, shaded and textured.
    textured: Vec3,
    /// The window and its supply of tiles.
    pub supplied: SuppliedWindow<'t, 'g, D>,
    execution: Execution,
    shift: [i32; 3],
    now: u32,
}

impl<'t, 'g, const D: usize> Player<'t, 'g, D> {
    /// Creates the contact before the first tick.
    pub fn new(
        scene: &'g Scene,
        buffers: &'t mut Buffers,
        shift: [i32; 3],
        supply: Supply,
    ) -> Self {
        Self {
            contact: Contact::new(scene.settings()),
            shader: Shader::of(scene.shading),
            shaded: Vec3::ZERO,
            texturer: Texturer::of(&scene.texture, 1.0, TickRate::DEFAULT),
            textured: Vec3::ZERO,
            supplied: SuppliedWindow::new(buffers, &scene.terrain, shift, supply),
            execution: scene.execution,
            shift,
            now: 0,
        }
    }

    /// Renders one HIP: one tick, or in lock-step as many as it needs; `None` if it never
    /// converges. `work` is the most of a tick.
    pub fn step(&mut self, hip: [f64; 3]) -> Option<ContactOutput> {
        let hip = shifted(hip, self.shift);
        let mut work = 0;
        let in_real_time = self.execution == Execution::RealTime;
        let before = (self.contact.clone(), self.shader);
        let installed = self.supplied.installed.len();
        for _ in 0..TIMEOUT {
            self.contact.step(&self.supplied.window, &hip);
            let output = *self.contact.output();
            work = work.max(output.work);
            self.shaded = self.shade();
            // A HIP that needs more tiles than the window can store is rendered without them.
            let waits = self.supplied.installed.len() - installed < 4 * D * D;
            let missing = output.missing_tile.or(self.missing());
            let waits_for = ContactOutput {
                missing_tile: missing,
                ..output
            };
            self.supplied
                .supply(self.now, &self.contact, &waits_for, &hip);
            self.now += 1;
            let is_done = output.converged && missing.is_none();
            if in_real_time || is_done || (missing.is_some() && !waits) {
                if let Some(texturer) = &mut self.texturer {
                    self.textured = texturer.add(self.shaded, &output.proxy);
                }
                return Some(ContactOutput { work, ..output });
            }
            if missing.is_some() && waits {
                // A transaction, as in a replay.
                (self.contact, self.shader) = before.clone();
            } else {
                self.contact.resume(before.0.output());
            }
        }
        None
    }

    fn shade(&mut self) -> Vec3 {
        match &mut self.shader {
            Some(shader) => shader.shade(&self.supplied.window, &self.contact),
            None => self.contact.output().displacement,
        }
    }

    fn missing(&self) -> Option<TileIndex> {
        self.shader.as_ref().and_then(Shader::missing)
    }

    /// Returns the last HIP's result for the oracle.
    #[must_use]
    pub fn observed(&self, hip: [f64; 3], output: ContactOutput) -> ObservedTick {
        ObservedTick {
            shaded: self.shader.as_ref().map(|shader| Shaded {
                displacement: self.shaded,
                is_whole: shader.missing().is_none(),
            }),
            textured: self.texturer.as_ref().map(|_| self.textured),
            ..ObservedTick::new(hip, output, self.shift)
        }
    }
}

/// Returns a position in cells, shifted by whole cells.
pub(super) fn shifted(hip: [f64; 3], shift: [i32; 3]) -> GridPoint {
    let here = point(hip);
    let cell = here.cell();
    GridPoint::new([0, 1, 2].map(|i| cell[i] + shift[i]), here.frac())
}
