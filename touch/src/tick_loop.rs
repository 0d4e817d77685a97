//! The device's loop and the memory of its tiles, in one value.

use alloc::boxed::Box;
use alloc::vec::Vec;

use hapterra_core::force::MaterialTable;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::GuardInputs;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{HipCommand, Scene, SceneChange, TickRecord};
use hapterra_core::terrain::{Tile, TileKey};
use hapterra_core::tick::{Command, Haptics, Outcome, RefusedScene};
use self_cell::{MutBorrow, self_cell};

use crate::terrain::Terrain;
use crate::tile_cutter::CutError;

/// Tiles along the side of the window: the same number as in the `hapterra` command.
const WINDOW: usize = 16;
/// Maximum ticks of a step: a path over 20,000 cells of rough ground takes about a hundredth of it.
const MAX_TICKS: u32 = 1 << 20;

self_cell!(
    /// Tiles, and the loop that borrows them.
    struct Cell {
        owner: MutBorrow<Box<[Tile]>>,
        #[covariant]
        dependent: Running,
    }
);

struct Running<'t> {
    haptics: Haptics<'t, WINDOW>,
    spare: Option<&'t mut Tile>,
    outcome: Outcome,
    /// Buffer for the samples of a tile.
    buffer: Vec<f64>,
    seq: u32,
    view: u8,
}

/// The loop.
pub(crate) struct TickLoop(Cell);

impl TickLoop {
    pub(crate) fn new(rate: TickRate) -> Self {
        let mut tiles = Vec::new();
        // One by one: all of them together may exceed a stack.
        tiles.resize_with(WINDOW * WINDOW + 1, || Tile::VACANT);
        let tiles = MutBorrow::new(tiles.into_boxed_slice());
        Self(Cell::new(tiles, |tiles| {
            Running::new(tiles.borrow_mut(), rate)
        }))
    }

    /// Begins a scene, with the table of its materials.
    pub(crate) fn set_scene(
        &mut self,
        scene: Scene,
        materials: Option<&MaterialTable>,
    ) -> Result<(), RefusedScene> {
        self.0.with_dependent_mut(|_, running| {
            if let Some(table) = materials {
                running.haptics.set_materials(table);
            }
            running.accept(Command::Scene(scene))
        })
    }

    /// Changes the surface, with the HIP at its last position.
    pub(crate) fn change_surface(
        &mut self,
        scene: Scene,
        materials: Option<&MaterialTable>,
        hip: GridPoint,
    ) -> Result<(), RefusedScene> {
        self.0.with_dependent_mut(|_, running| {
            if let Some(table) = materials {
                running.haptics.set_materials(table);
            }
            running.view = running.view.wrapping_add(1);
            // Tiles with materials differ from those without.
            let before = running.haptics.scene().and_then(|scene| scene.materials);
            running.accept(Command::SceneChange(SceneChange {
                number: running.view,
                scene,
                hip,
                keeps_tiles: before.is_some() == scene.materials.is_some(),
                in_contact: None,
            }))
        })
    }

    /// Renders a point with all terrain that it needs; `None` if that requires too many ticks.
    pub(crate) fn step(
        &mut self,
        hip: GridPoint,
        terrain: &Terrain,
        materials: usize,
    ) -> Result<Option<TickRecord>, CutError> {
        self.0
            .with_dependent_mut(|_, running| running.step(hip, terrain, materials))
    }
}

impl<'t> Running<'t> {
    fn new(tiles: &'t mut [Tile], rate: TickRate) -> Self {
        let mut tiles = tiles.iter_mut();
        let mut next = || tiles.next().expect("a tile for each slot was made");
        let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
        let spare = Some(next());
        Self {
            haptics: Haptics::new(slots, rate, None),
            spare,
            outcome: Outcome::default(),
            buffer: Vec::new(),
            seq: 0,
            view: 0,
        }
    }

    fn accept(&mut self, command: Command<'t>) -> Result<(), RefusedScene> {
        if let Some(tile) = self.haptics.accept(command)? {
            self.spare = Some(tile);
        }
        Ok(())
    }

    fn step(
        &mut self,
        hip: GridPoint,
        terrain: &Terrain,
        materials: usize,
    ) -> Result<Option<TickRecord>, CutError> {
        self.seq = self.seq.wrapping_add(1);
        let seq = self.seq;
        // A point is never refused, and returns no tile.
        let _ = self.accept(Command::Hip(HipCommand { seq, hip }));
        let sense = GuardInputs::default();
        for _ in 0..MAX_TICKS {
            self.haptics.tick_into(&sense, true, &mut self.outcome);
            if self.outcome.answered_seq == Some(seq) {
                return Ok(Some(self.outcome.sample));
            }
            if let Some(index) = self.outcome.sample.missing_tile {
                self.load_tile(TileKey { level: 0, index }, terrain, materials)?;
            }
        }
        Ok(None)
    }

    fn load_tile(
        &mut self,
        key: TileKey,
        terrain: &Terrain,
        materials: usize,
    ) -> Result<(), CutError> {
        let Some(tile) = self.spare.take() else {
            return Ok(());
        };
        if let Err(error) = terrain.cut(key, materials, &mut self.buffer, tile) {
            self.spare = Some(tile);
            return Err(error);
        }
        // A tile is never refused; the replaced buffer is returned.
        let _ = self.accept(Command::Tile(tile));
        Ok(())
    }
}
