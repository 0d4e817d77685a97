//! The state of the loop, and its changes between ticks: commands and scenes.

use crate::clutch::{Clutch, ClutchMode};
use crate::contact::Contact;
use crate::force::MaterialTable;
use crate::guard::thermal::Temperatures;
use crate::guard::{Fault, Guard, GuardInputs, GuardOutputs, Jog, Report};
use crate::phantom::{Calibration, Kinematics};
use crate::rate::TickRate;
use crate::renderer::Renderer;
use crate::scene::{Health, HipCommand, Scene, SceneChange, Source};
use crate::terrain::{Tile, TileKey, Window};

/// Default time from the start of a tick until its force acts, s.
pub const LATENCY_S: f32 = 0.1e-3;

/// Command to the loop between ticks.
pub enum Command<'t> {
    /// Render this scene. The arm is disarmed, and the last force ramps down.
    Scene(Scene),
    /// Drop the scene. The arm is disarmed in the same way.
    DropScene,
    /// Change the placement; already checked. The arm stays armed if the clutch is open; otherwise
    /// this acts as another scene.
    SceneChange(SceneChange),
    /// Forget the change of placement with this number, if it still waits for its terrain.
    CancelChange(u8),
    /// Hold or release the clutch.
    Clutch(ClutchMode),
    /// Set the state of the board's clutch input: true while it is held.
    ClutchInput(bool),
    /// Mark the next tick with this number. It only makes the loop around the tick raise the
    /// board's mark pin.
    Mark(u8),
    /// A filled tile.
    Tile(&'t mut Tile),
    /// A haptic interface point (HIP) for one tick of a replay.
    Hip(HipCommand),
    /// Arm, once nothing blocks it and the dead-man switch is pressed.
    Arm,
    /// Drop the scene and arm for a jog in its place: a small current in one motor
    /// for a limited time.
    Jog(Jog),
    /// Disarm; the force ramps down.
    Disarm,
    /// Set the encoder counts in the zero pose of the calibration record.
    Zero([i32; 3]),
    /// Clear the latched fault, if it is this one.
    ClearFault(Option<Fault>),
    /// Latch a fault found outside the tick.
    Trip(Fault),
    /// Hold the outputs at these shares of full scale, -1 to 1, with the amplifiers off; `None`
    /// ends that ([`Guard::hold`]).
    HoldOutputs(Option<[f32; 3]>),
}

/// Refusal of a scene or placement: its numbers are not valid, or its materials are missing. The
/// loop then has no scene, and the arm is disarmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the scene is not valid, or its materials are not those that came")]
pub struct RefusedScene;

/// Source of the next tick's HIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HipSource {
    /// No scene: nothing is rendered. The guard still monitors the arm.
    None,
    /// The encoders.
    Encoders,
    /// Points of the host.
    Points {
        /// True if a point is being rendered.
        pending: bool,
    },
}

/// The board under a loop.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// Ticks a second.
    pub rate: TickRate,
    /// Time from the start of a tick until its force acts, s: the delay of the board and its
    /// amplifiers.
    pub latency_s: f32,
    /// Temperatures of the motors; `None` if unknown: the motors then start at air temperature.
    pub motors: Option<Temperatures>,
    /// A fault that was found at boot.
    pub fault: Option<Fault>,
}

/// All state of the loop over a window of `D × D` tiles.
///
/// With points as its source it renders a replay: no arm is needed, and none is driven.
///
/// ```
/// use hapterra_core::Vec3;
/// use hapterra_core::contact::ContactState;
/// use hapterra_core::force::SurfaceParams;
/// use hapterra_core::grid::GridPoint;
/// use hapterra_core::guard::GuardInputs;
/// use hapterra_core::rate::TickRate;
/// use hapterra_core::scene::{HipCommand, Scene, Source};
/// use hapterra_core::terrain::{FieldSize, TileArena, Tile, TileKey};
/// use hapterra_core::tick::{Command, Haptics};
///
/// let size = FieldSize::new(32, 32);
/// let (mut storage, mut tile) = (TileArena::<1>::new(), Tile::VACANT);
/// tile.fill_from(TileKey::new(0, 0, 0), 0, size, |_x, _y| 2.0).expect("in range");
///
/// let mut haptics = Haptics::new(storage.slots(), TickRate::DEFAULT, None);
/// let scene = Scene {
///     epoch: 1,
///     level: 0,
///     size,
///     top: 3,
///     fallback: None,
///     cell_mm: 1.0,
///     home: GridPoint::default(),
///     params: SurfaceParams::PREMIUM,
///     source: Source::Points,
///     hold_clock: false,
///     materials: None,
/// };
/// haptics.accept(Command::Scene(scene))?;
/// assert!(haptics.accept(Command::Tile(&mut tile))?.is_some());
/// let mut sample = Default::default();
/// for (seq, height) in [(0, 5.0), (1, 1.0)] {
///     let hip = GridPoint::new([10, 10, 0], Vec3::new(0.5, 0.5, height));
///     haptics.accept(Command::Hip(HipCommand { seq, hip }))?;
///     let outcome = haptics.tick(&GuardInputs::default(), true);
///     assert_eq!(outcome.answered_seq, Some(seq));
///     sample = outcome.sample;
/// }
/// // One millimetre deep: half a newton up.
/// assert_eq!((sample.state, sample.force_n), (ContactState::Touching, Vec3::Z * 0.5));
/// # Ok::<(), hapterra_core::tick::RefusedScene>(())
/// ```
// Field order: fields that every tick reads are within the offset range of its loads. This saves 66
// of 1,245 instructions.
#[repr(C)]
pub struct Haptics<'t, const D: usize> {
    pub(crate) guard: Guard,
    pub(crate) clutch: Clutch,
    pub(crate) mechanism: Option<Kinematics>,
    pub(crate) scene: Option<Scene>,
    /// Encoder counts in the zero pose, if known.
    pub(crate) zero: Option<[i32; 3]>,
    pub(crate) tick: u32,
    pub(crate) rate: TickRate,
    /// Number of the rendered placement.
    pub(crate) view: u8,
    pub(crate) point: Option<HipCommand>,
    pub(crate) renderer: Renderer,
    pub(crate) window: Window<'t, D>,
    /// A change of placement that waits for its terrain.
    pub(crate) pending: Option<SceneChange>,
}

impl<'t, const D: usize> Haptics<'t, D> {
    /// Creates a disarmed loop at this rate, without calibration and scene, and with the fault
    /// found at boot, if any.
    #[must_use]
    pub fn new(
        tiles: [[&'t mut Tile; D]; D],
        rate: TickRate,
        found_at_boot: Option<Fault>,
    ) -> Self {
        let board = Board {
            rate,
            latency_s: LATENCY_S,
            motors: None,
            fault: found_at_boot,
        };
        Self::on_board(tiles, &board)
    }

    /// Creates a disarmed loop on a board.
    #[must_use]
    pub fn on_board(tiles: [[&'t mut Tile; D]; D], board: &Board) -> Self {
        let mut guard = Guard::new(board.rate, board.fault);
        if let Some(motors) = board.motors {
            guard.set_temperatures(motors);
        }
        Self {
            renderer: Renderer::new(board.rate, board.latency_s),
            guard,
            scene: None,
            clutch: Clutch::new(board.rate),
            mechanism: None,
            zero: None,
            tick: 0,
            rate: board.rate,
            view: 0,
            point: None,
            window: Window::new(tiles),
            pending: None,
        }
    }

    /// Returns the temperatures of the motors, which a board keeps across a reset.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.guard.motors().temperatures()
    }

    /// Applies a command between ticks. Returns a tile buffer that has become free, if any. Most
    /// tiles replace another one; those of a fallback occupy additional buffers, which are returned
    /// one by one under a scene without fallback.
    ///
    /// # Errors
    /// [`RefusedScene`] if a scene or placement was refused; the loop then has no scene.
    pub fn accept(&mut self, command: Command<'t>) -> Result<Option<&'t mut Tile>, RefusedScene> {
        let mut back = None;
        match command {
            Command::Scene(scene) => self.set_scene(Some(scene))?,
            Command::DropScene => self.set_scene(None)?,
            Command::SceneChange(view) => self.set_placement(&view)?,
            Command::CancelChange(number) => self.cancel_change_numbered(number),
            Command::Clutch(hold) => self.clutch.set_mode(hold),
            Command::ClutchInput(held) => self.clutch.set_input(held),
            Command::Mark(_) => {}
            Command::Tile(tile) => back = self.store_tile(tile),
            Command::Hip(HipCommand { seq, hip }) => {
                // The link can deliver any bits.
                let hip = hip.normalised();
                self.point = Some(HipCommand { seq, hip });
            }
            Command::Arm => self.guard.arm(),
            Command::Jog(jog) => {
                self.set_scene(None)?;
                self.guard.jog(jog);
            }
            Command::Disarm => self.guard.disarm(),
            Command::Zero(counts) => self.set_zero(counts),
            Command::ClearFault(fault) => self.guard.clear_if_acknowledged(fault),
            Command::Trip(fault) => self.guard.trip(fault),
            Command::HoldOutputs(shares) => self.guard.hold(shares),
        }
        Ok(back.or_else(|| self.window.take_spare()))
    }

    /// Returns one more tile buffer that has become free, if any.
    pub fn take_spare(&mut self) -> Option<&'t mut Tile> {
        self.window.take_spare()
    }

    /// Returns the epoch of the scene, or of the change that waits for its terrain.
    #[must_use]
    pub fn epoch(&self) -> Option<u32> {
        let pending = self.pending.as_ref().map(|change| &change.scene);
        pending.or(self.scene.as_ref()).map(|scene| scene.epoch)
    }

    /// Replaces the arm's settings between ticks. The arm should be disarmed; otherwise it is
    /// switched off.
    pub fn configure(&mut self, mechanism: Kinematics) {
        self.guard.stop();
        self.guard.configure(&mechanism);
        self.mechanism = Some(mechanism);
        self.renderer.restart(self.scene.as_ref());
    }

    /// Sets the table of materials for the scene that follows through [`Haptics::accept`] before
    /// the next tick. A scene with an invalid table is refused.
    pub fn set_materials(&mut self, table: &MaterialTable) {
        self.renderer.set_materials(table);
    }

    /// Returns the source of the next tick's HIP in the current scene.
    #[must_use]
    pub fn source(&self) -> HipSource {
        match self.scene.as_ref().map(|scene| scene.source) {
            None => HipSource::None,
            Some(Source::Encoders) => HipSource::Encoders,
            Some(Source::Points) => HipSource::Points {
                pending: self.point.is_some(),
            },
        }
    }

    /// Sets a scene, or drops the current one; the force ramps down. A refused scene also drops the
    /// current one, because its sender assumes it to be set.
    fn set_scene(&mut self, scene: Option<Scene>) -> Result<(), RefusedScene> {
        self.cancel_change();
        let is_requested = scene.is_some();
        let scene = scene.filter(|scene| self.renderer.can_render(scene));
        match &scene {
            Some(scene) if scene.source == Source::Points => self.guard.stop(),
            _ => self.guard.disarm(),
        }
        if let Some(scene) = &scene {
            self.window.reset(scene.level, scene.size, scene.top);
            self.window.set_fallback(scene.fallback);
            self.tick = 0;
        }
        self.renderer.set_scene(scene.as_ref(), None);
        self.scene = scene;
        self.point = None;
        let of_arm = scene.is_some_and(|scene| scene.source == Source::Encoders);
        self.clutch.restart(self.rate, of_arm);
        self.view = 0;
        match is_requested && scene.is_none() {
            true => Err(RefusedScene),
            false => Ok(()),
        }
    }

    /// Sets another placement, with an open clutch or in a replay at once, and under a pressing hand
    /// when its terrain has arrived. Otherwise it acts as another scene.
    fn set_placement(&mut self, change: &SceneChange) -> Result<(), RefusedScene> {
        self.cancel_change();
        let before = self.scene.as_ref();
        let is_same_source = before.is_some_and(|before| before.source == change.scene.source);
        if !is_same_source || !self.renderer.can_render(&change.scene) {
            return self.set_scene(Some(change.scene));
        }
        let is_point = change.scene.source == Source::Points;
        if is_point || self.clutch.is_open() {
            self.apply_change(change);
        } else if change.in_contact.is_some() {
            self.wait_for_change(change);
        } else {
            return self.set_scene(Some(change.scene));
        }
        Ok(())
    }

    /// Sets the zero counts. The tip's position then jumps, so the outputs are switched off.
    fn set_zero(&mut self, counts: [i32; 3]) {
        self.guard.stop();
        self.guard.restart_counts();
        self.renderer.restart(self.scene.as_ref());
        self.zero = Some(counts);
    }

    /// Stores a tile. In a scene of an arm it is refused if its slot holds the tile under the
    /// proxy, or a tile next to it: it was requested for a place that the proxy has left.
    fn store_tile(&mut self, tile: &'t mut Tile) -> Option<&'t mut Tile> {
        if let Some(change) = &self.pending {
            if tile
                .key()
                .is_some_and(|key| self.window.expects_in_next(key))
            {
                return self.window.take_for_next(tile);
            }
            // The window still has the tiles of the current placement.
            if !change.keeps_tiles {
                return Some(tile);
            }
        }
        let level = self.window.level();
        let of_arm = self
            .scene
            .as_ref()
            .is_some_and(|it| it.source == Source::Encoders);
        let under_proxy = self.renderer.contact().patch().filter(|_| of_arm);
        let under_proxy = under_proxy.map(|cell| TileKey::containing(level, cell));
        if let (Some(under_proxy), Some(key)) = (under_proxy, tile.key())
            && key != under_proxy
            && self.window.expects(key)
            && let Some(occupant) = self.window.occupant(key)
            && (occupant == under_proxy
                || (occupant.index.is_beside(under_proxy.index)
                    && !key.index.is_beside(under_proxy.index)))
        {
            return Some(tile);
        }
        let contact = self.renderer.contact();
        let in_use = [contact.output().proxy, *contact.hip()];
        self.window.take(tile, in_use.map(|point| point.column()))
    }

    /// Returns the current scene.
    #[must_use]
    pub const fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// Returns the contact of the last tick.
    #[must_use]
    pub const fn contact(&self) -> &Contact {
        self.renderer.contact()
    }

    /// Returns the current calibration.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.mechanism.as_ref().map(Kinematics::calibration)
    }

    /// Returns the state of the guard and the measured values after a tick.
    #[must_use]
    pub fn health(&self, sense: &GuardInputs, drive: &GuardOutputs) -> Health {
        let angles = |m: &Kinematics| m.angles(sense.counts, self.zero.unwrap_or_default());
        Health {
            report: self.guard.report(),
            sense: *sense,
            zero: self.zero,
            angles_rad: self.mechanism.as_ref().map(angles).unwrap_or_default(),
            currents_a: drive.currents_a,
            winding_c: self.guard.motors().winding_c(),
            created_mj: self.renderer.created_mj(),
        }
    }

    /// Returns the state of the guard after a tick.
    #[must_use]
    pub const fn report(&self) -> Report {
        self.guard.report()
    }
}
