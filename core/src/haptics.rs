//! The state of the loop, and what changes it between ticks: commands and scenes.

use crate::clutch::{Clutch, ClutchHold};
use crate::contact::Contact;
use crate::force::MaterialTable;
use crate::guard::thermal::Temperatures;
use crate::guard::{Fault, Guard, GuardInputs, GuardOutputs, Jog, Report};
use crate::phantom::{Calibration, Kinematics};
use crate::rate::TickRate;
use crate::renderer::Renderer;
use crate::scene::{Health, HipCommand, Scene, SceneChange, Source};
use crate::terrain::{Tile, TileKey, Window};

/// From the beginning of a tick until its force acts, s, where a board says nothing else.
pub const LATENCY_S: f32 = 0.1e-3;

/// Command to the loop between ticks.
pub enum Command<'t> {
    /// A scene. The arm is disarmed, and force that was there goes out gently.
    Scene(Scene),
    /// No scene any more. The arm is disarmed likewise.
    DropScene,
    /// Another view of the scene, already checked. The arm stays armed where the clutch is
    /// open; else it is as another scene.
    SceneChange(SceneChange),
    /// Hold the clutch, or let it go.
    Clutch(ClutchHold),
    /// The board's clutch input is held from now on, or no longer.
    ClutchInput(bool),
    /// Mark the next tick, under a number that tells marks apart. The loop around the tick
    /// raises the board's mark pin; nothing else follows from it.
    Mark(u8),
    /// A filled tile.
    Tile(&'t mut Tile),
    /// A haptic interface point for one tick, in a scene fed by points.
    Hip(HipCommand),
    /// Arm, once nothing blocks it and the dead-man switch is pressed.
    Arm,
    /// Drop the scene and arm for a jog in its place: a small current in one motor
    /// for a limited time.
    Jog(Jog),
    /// Disarm; force goes out gently.
    Disarm,
    /// These are the counts in the zero pose of the calibration record.
    Zero([i32; 3]),
    /// Clear the latched fault, if it is this one.
    ClearFault(Option<Fault>),
    /// Latch a fault found outside the tick.
    Trip(Fault),
    /// Hold the outputs at these shares of full scale, -1 to 1, with the amplifiers off,
    /// or no longer ([`Guard::hold`]).
    HoldOutputs(Option<[f32; 3]>),
}

/// A scene or view that cannot be rendered: its numbers are not valid, or its materials are not here.
/// There is no scene from then on, and the arm is disarmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the scene is not valid, or its materials are not those that came")]
pub struct RefusedScene;

/// Source of the next tick's HIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HipSource {
    /// There is no scene: nothing is rendered. The guard still looks at the arm.
    None,
    /// The encoders.
    Encoders,
    /// Points.
    Points {
        /// True if one is being rendered.
        pending: bool,
    },
}

/// The board under a loop.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// Ticks a second.
    pub rate: TickRate,
    /// From the beginning of a tick until its force acts, s: what the board and its amplifiers
    /// take.
    pub latency_s: f32,
    /// Temperatures of the motors; those of the air where nothing is known.
    pub motors: Option<Temperatures>,
    /// A fault that was found at boot.
    pub fault: Option<Fault>,
}

/// All state of the loop over a window of `D × D` tiles.
///
/// Fed by points, it is a replay: no arm is needed, and no force reaches one.
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
///     assert_eq!(outcome.answers, Some(seq));
///     sample = outcome.sample;
/// }
/// // One millimetre deep: half a newton up.
/// assert_eq!((sample.state, sample.force_n), (ContactState::Touching, Vec3::Z * 0.5));
/// # Ok::<(), hapterra_core::tick::RefusedScene>(())
/// ```
// In this order: what every tick reads lies within reach of its loads. 66 instructions of 1,245.
#[repr(C)]
pub struct Haptics<'t, const D: usize> {
    pub(crate) guard: Guard,
    pub(crate) clutch: Clutch,
    pub(crate) mechanism: Option<Kinematics>,
    pub(crate) scene: Option<Scene>,
    /// Counts in the zero pose, once they are known.
    pub(crate) zero: Option<[i32; 3]>,
    pub(crate) tick: u32,
    pub(crate) rate: TickRate,
    /// Number of the view that is rendered.
    pub(crate) view: u8,
    pub(crate) point: Option<HipCommand>,
    pub(crate) renderer: Renderer,
    pub(crate) window: Window<'t, D>,
}

impl<'t, const D: usize> Haptics<'t, D> {
    /// A loop at this rate without calibration and scene: disarmed, with a fault that was found at
    /// boot.
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

    /// The same on a board.
    #[must_use]
    pub fn on_board(tiles: [[&'t mut Tile; D]; D], board: &Board) -> Self {
        let mut guard = Guard::new(board.rate, board.fault);
        if let Some(motors) = board.motors {
            guard.begin_at(motors);
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
        }
    }

    /// Returns the temperatures of the motors, which a board keeps over a reset.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.guard.motors().temperatures()
    }

    /// Takes a command between ticks. Returns a tile buffer that is free again, if there is
    /// one: most tiles bring one in the place of another, those of a fallback stay besides, and
    /// their buffers return one by one under a scene that has none.
    ///
    /// # Errors
    /// [`RefusedScene`]: a scene or view was not taken, and there is no scene any more.
    pub fn accept(&mut self, command: Command<'t>) -> Result<Option<&'t mut Tile>, RefusedScene> {
        let mut back = None;
        match command {
            Command::Scene(scene) => self.take_scene(Some(scene))?,
            Command::DropScene => self.take_scene(None)?,
            Command::SceneChange(view) => self.take_view(&view)?,
            Command::Clutch(hold) => self.clutch.hold(hold),
            Command::ClutchInput(held) => self.clutch.press(held),
            Command::Mark(_) => {}
            Command::Tile(tile) => back = self.take_tile(tile),
            Command::Hip(HipCommand { seq, hip }) => {
                // Whatever bits came over the wire.
                let hip = hip.normalised();
                self.point = Some(HipCommand { seq, hip });
            }
            Command::Arm => self.guard.arm(),
            Command::Jog(jog) => {
                self.take_scene(None)?;
                self.guard.jog(jog);
            }
            Command::Disarm => self.guard.disarm(),
            Command::Zero(counts) => self.take_zero(counts),
            Command::ClearFault(seen) => self.guard.clear_seen(seen),
            Command::Trip(fault) => self.guard.trip(fault),
            Command::HoldOutputs(shares) => self.guard.hold(shares),
        }
        Ok(back.or_else(|| self.window.take_spare()))
    }

    /// Swaps the arm's settings between ticks. The caller sees to it that the arm is disarmed; if
    /// it is not, it is switched off.
    pub fn configure(&mut self, mechanism: Kinematics) {
        self.guard.stop();
        self.guard.configure(&mechanism);
        self.mechanism = Some(mechanism);
        self.renderer.restart(self.scene.as_ref());
    }

    /// Takes a table of materials: that of the scene which follows with [`Haptics::accept`] before
    /// another tick. One that is not valid has its scene refused.
    pub fn take_materials(&mut self, table: &MaterialTable) {
        self.renderer.take_materials(table);
    }

    /// Returns the source of the next tick's HIP, by the scene in force.
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

    /// Takes a scene, or drops the one there is: force that was there goes out. Drops it for one that
    /// it cannot take, too: its sender assumes it to be set.
    fn take_scene(&mut self, scene: Option<Scene>) -> Result<(), RefusedScene> {
        let asked = scene.is_some();
        let scene = scene.filter(|scene| self.renderer.can_take(scene));
        match &scene {
            Some(scene) if scene.source == Source::Points => self.guard.stop(),
            _ => self.guard.disarm(),
        }
        if let Some(scene) = &scene {
            self.window.reset(scene.level, scene.size, scene.top);
            self.window.lay(scene.fallback);
            self.tick = 0;
        }
        self.renderer.take(scene.as_ref(), None);
        self.scene = scene;
        self.point = None;
        let of_arm = scene.is_some_and(|scene| scene.source == Source::Encoders);
        self.clutch.begin(self.rate, of_arm);
        self.view = 0;
        match asked && scene.is_none() {
            true => Err(RefusedScene),
            false => Ok(()),
        }
    }

    /// Sets another placement. No force shows the change: the clutch of an arm is open,
    /// and in a replay no arm is driven. A proxy that touched begins on the surface
    /// where it was in the hand, as deep as before.
    fn take_view(&mut self, view: &SceneChange) -> Result<(), RefusedScene> {
        let &SceneChange { scene, hip, .. } = view;
        let before = self.scene.as_ref();
        let may_change = before.is_some_and(|before| {
            before.source == scene.source
                && (scene.source == Source::Points || self.clutch.is_open())
        });
        let displacement = before
            .zip(self.renderer.contact().displacement())
            .map(|(before, displacement)| displacement * (before.cell_mm / scene.cell_mm));
        if !may_change || !self.renderer.can_take(&scene) {
            return self.take_scene(Some(scene));
        }
        if !view.keeps_tiles {
            self.window.reset(scene.level, scene.size, scene.top);
        }
        let has_other_fallback = before.is_none_or(|before| before.fallback != scene.fallback);
        if has_other_fallback || !view.keeps_tiles {
            self.window.lay(scene.fallback);
        }
        // Whatever bits came over the wire.
        let hip = hip.normalised();
        self.renderer.take(
            Some(&scene),
            displacement.map(|displacement| (hip, displacement)),
        );
        self.clutch.put(hip);
        self.scene = Some(scene);
        self.point = None;
        self.view = view.number;
        Ok(())
    }

    /// The tip is somewhere else from now on, so nothing is driven meanwhile.
    fn take_zero(&mut self, counts: [i32; 3]) {
        self.guard.stop();
        self.guard.restart_counts();
        self.renderer.restart(self.scene.as_ref());
        self.zero = Some(counts);
    }

    /// Refuses a tile of an arm's scene whose slot holds the tile under the proxy, or a tile next to
    /// it. Such a tile was requested for a place that the proxy has left.
    fn take_tile(&mut self, tile: &'t mut Tile) -> Option<&'t mut Tile> {
        let level = self.window.level();
        let of_arm = self
            .scene
            .as_ref()
            .is_some_and(|it| it.source == Source::Encoders);
        let under_proxy = self.renderer.contact().patch().filter(|_| of_arm);
        let under_proxy = under_proxy.map(|cell| TileKey::holding(level, cell));
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

    /// The scene in force.
    #[must_use]
    pub const fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// The contact of the last tick.
    #[must_use]
    pub const fn contact(&self) -> &Contact {
        self.renderer.contact()
    }

    /// The calibration in force.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.mechanism.as_ref().map(Kinematics::calibration)
    }

    /// The state of the guard and what was measured, after a tick.
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

    /// The state of the guard after a tick.
    #[must_use]
    pub const fn report(&self) -> Report {
        self.guard.report()
    }
}
