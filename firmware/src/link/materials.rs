//! Scenes with materials: their tables, and the materials of their tiles.

use hapterra_core::force::MaterialTable;
use hapterra_core::scene::Scene;
use hapterra_core::terrain::{Tile, TileError, TileKey};
use hapterra_core::wire::materials::{MaterialScene, TileMaterials};

use super::Link;
use super::commands::CommandRoom;

/// Material table of the loop.
#[derive(Clone, Copy, Debug)]
pub(super) struct LoopMaterials {
    sum: u32,
    /// Number of materials that it has.
    count: usize,
}

impl<const D: usize> Link<'_, D> {
    /// Returns true if the loop has the materials of a scene, or the scene has none.
    pub(super) fn has_materials_of(&self, scene: &Scene) -> bool {
        let is_known = |sum: u32| self.materials.is_some_and(|known| known.sum == sum);
        scene.materials.is_none_or(is_known)
    }

    /// Handles a scene with its table.
    pub(super) fn on_material_scene(&mut self, message: &MaterialScene<'_>, room: CommandRoom) {
        let scene = message.scene;
        if let Some(table) = message.table()
            && scene.is_valid()
            && !self.has_materials_of(&scene)
        {
            self.queue_materials(table);
        }
        self.on_scene(scene, room);
    }

    fn queue_materials(&mut self, table: MaterialTable) {
        self.materials = Some(LoopMaterials {
            sum: table.check_sum(),
            count: table.materials().len(),
        });
        // Callers have checked that there is room.
        let _ = self.ends.materials.enqueue(table);
    }

    /// Fills in the materials of a tile, if it has any.
    ///
    /// # Errors
    /// If they are not in the table, if the scene has materials and the tile has none, or the
    /// reverse.
    pub(super) fn fill_materials(
        &self,
        tile: &mut Tile,
        key: TileKey,
        materials: Option<TileMaterials<'_>>,
    ) -> Result<(), TileError> {
        let scene = self.scene.filter(|scene| scene.materials.is_some());
        // The fallback is of another level, and has none.
        let wanted = scene.is_some_and(|scene| scene.level == key.level);
        match (wanted, materials, self.materials) {
            (false, None, _) => Ok(()),
            (true, Some(materials), Some(known)) => materials.fill(tile, known.count),
            _ => Err(TileError::Materials),
        }
    }
}
