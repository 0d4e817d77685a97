//! Tables of materials, and the materials of a tile, from bytes.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Damping, Material, MaterialTable};
use hapterra_core::terrain::{TILE_SAMPLES, Tile};

use super::bytes::Bytes;
use super::tick::texture;

/// Returns a table that is valid for a scene, or one of arbitrary numbers.
pub(super) fn table(bytes: &mut Bytes<'_>) -> MaterialTable {
    let count = 1 + usize::from(bytes.byte()) % MaterialTable::MAX;
    let all: Vec<Material> = (0..count).map(|_| material(bytes)).collect();
    MaterialTable::new(&all).unwrap_or(MaterialTable::EMPTY)
}

fn material(bytes: &mut Bytes<'_>) -> Material {
    let kind = bytes.byte();
    let share = |byte: u8| f32::from(byte) / 255.0;
    let dynamic_mu = share(bytes.byte());
    let friction = Friction {
        dynamic_mu,
        static_mu: dynamic_mu + share(bytes.byte()),
        viscous_s: [0.0, share(kind)][usize::from(kind & 1)],
    };
    Material {
        stiffness_n_per_mm: match kind {
            255 => bytes.float(),
            _ => 4.0 * share(bytes.byte()),
        },
        friction: match kind & 6 {
            0 => Friction::NONE,
            _ => friction,
        },
        damping_ns_per_m: share(bytes.byte()) * Damping::MAX_NS_PER_M,
        texture: texture(bytes),
    }
}

/// Fills a tile's materials: as many as its samples, or one less, of this table or beyond it. A
/// refused tile stays vacant.
pub(super) fn fill(tile: &mut Tile, table: &MaterialTable, bytes: &mut Bytes<'_>) {
    let kind = bytes.byte();
    let count = match kind & 3 {
        0 => MaterialTable::MAX,
        _ => table.materials().len(),
    };
    let samples = TILE_SAMPLES * TILE_SAMPLES - usize::from(kind & 12 == 12);
    let classes: Vec<u8> = (0..5).map(|_| bytes.byte()).collect();
    let max = match kind & 16 {
        0 => 16,
        _ => table.materials().len().clamp(1, 16) as u8,
    };
    let class = |i: usize| classes[(i % TILE_SAMPLES / 4 + i / TILE_SAMPLES / 4) % 5] % max;
    let _ = tile.set_materials(count, (0..samples).map(class));
}
