//! Scenes with materials: their tables, and tiles with materials and without.

use std::vec::Vec;

use hapterra_core::Vec3;
use hapterra_core::force::{Material, MaterialTable, SurfaceParams};
use hapterra_core::grid::{Cell, GridPoint};
use hapterra_core::scene::{HipCommand, Scene, Source};
use hapterra_core::terrain::{CoarseTile, Fallback, TileKey};
use hapterra_core::wire::materials::{
    MAX_TABLE_BYTES, MaterialScene, MaterialTile, TileMaterials, table_bytes,
};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice, ToHost};

use super::rig::{HELLO, Rig, scene};

/// Materials of these stiffnesses.
fn table(stiffnesses: &[f32]) -> MaterialTable {
    let material = |stiffness_n_per_mm: &f32| Material {
        stiffness_n_per_mm: *stiffness_n_per_mm,
        ..Material::of(&SurfaceParams::PREMIUM)
    };
    let materials: Vec<_> = stiffnesses.iter().map(material).collect();
    MaterialTable::new(&materials).expect("some")
}

fn scene_of(table: &MaterialTable, epoch: u32) -> Scene {
    Scene {
        epoch,
        materials: Some(table.check_sum()),
        ..scene(Source::Points)
    }
}

/// Sends a scene with its table and returns true if it was accepted.
fn send_scene(rig: &mut Rig, scene: Scene, table: &MaterialTable) -> bool {
    let mut buffer = [0; MAX_TABLE_BYTES];
    let table = table_bytes(table, &mut buffer);
    rig.send_message(&ToDevice::MaterialScene(MaterialScene { scene, table }));
    rig.run(1);
    is_accepted(rig, scene.epoch)
}

/// Returns true if the last answer, which is to scene `epoch`, accepts it.
fn is_accepted(rig: &Rig, epoch: u32) -> bool {
    let answer = |message: &ToHost| match message {
        ToHost::SceneAck { epoch, accepted } => Some((*epoch, *accepted)),
        _ => None,
    };
    let answers: Vec<_> = rig.received.iter().filter_map(answer).collect();
    assert_eq!(answers.last().map(|answer| answer.0), Some(epoch));
    answers.last().is_some_and(|answer| answer.1)
}

fn opened() -> Rig {
    let mut rig = Rig::new();
    rig.answers_tiles = false;
    rig.send_message(&ToDevice::Hello(HELLO));
    rig.run(1);
    rig
}

/// Returns a flat tile at height 1.5.
fn flat<'t>(epoch: u32, key: TileKey) -> TileMessage<'t> {
    TileMessage {
        epoch,
        key,
        heights: Heights::Flat {
            base: 1,
            height: 0.5,
        },
    }
}

fn answer_tiles(rig: &mut Rig, epoch: u32, materials: TileMaterials<'_>) {
    for key in rig.tile_requests() {
        let tile = flat(epoch, key);
        rig.send_message(&ToDevice::MaterialTile(MaterialTile { tile, materials }));
    }
    rig.run(4);
}

/// Returns the force in N, half a cell deep in the plane: half of the stiffness.
fn rendered(rig: &mut Rig) -> f32 {
    let from = rig.rendered().last().map_or(0, |(seq, _)| seq + 1);
    for (seq, z) in [(from, 2.0), (from + 1, 1.0)] {
        let hip = GridPoint::new([100, 100, 0], Vec3::new(0.5, 0.5, z));
        rig.send_message(&ToDevice::Hip(HipCommand { seq, hip }));
        rig.run(4);
    }
    let rendered = rig.rendered();
    let (seq, sample) = rendered.last().expect("rendered");
    assert_eq!(*seq, from + 1);
    sample.force_n.z
}

#[test]
fn tile_is_rendered_with_its_own_material() {
    let mut rig = opened();
    let table = table(&[0.4, 1.0, 0.8]);
    assert!(send_scene(&mut rig, scene_of(&table, 9), &table));
    answer_tiles(&mut rig, 9, TileMaterials::One(2));
    assert_eq!(rig.status().bad_frames, 0);
    // The scene is a quarter stiffer than the table's default, and so are all materials.
    let force = rendered(&mut rig);
    assert!((force - 0.5 * 0.8 * 0.5 / 0.4).abs() < 1e-6, "{force}");
    // Repeated, because the answer was lost: the stored table stays.
    rig.received.clear();
    assert!(send_scene(&mut rig, scene_of(&table, 9), &table));
    rig.run(300);
    assert_eq!(rig.tile_requests(), []);
}

#[test]
fn tiles_whose_materials_are_missing_or_wrong_are_bad_frames() {
    let mut rig = opened();
    let table = table(&[0.5, 1.0]);
    assert!(send_scene(&mut rig, scene_of(&table, 9), &table));
    let key = rig.tile_requests()[0];
    rig.send_message(&ToDevice::Tile(flat(9, key)));
    for materials in [
        TileMaterials::One(2),
        TileMaterials::Runs(&[0, 255]),
        TileMaterials::Each(&[0; 7]),
    ] {
        let tile = flat(9, key);
        rig.send_message(&ToDevice::MaterialTile(MaterialTile { tile, materials }));
    }
    rig.run(4);
    assert_eq!(rig.status().bad_frames, 4);
    // All buffers are available again.
    answer_tiles(&mut rig, 9, TileMaterials::One(1));
    assert_eq!(rendered(&mut rig), 0.5);
    // Without materials in the scene, a tile has none.
    let plain = scene(Source::Points);
    rig.received.clear();
    rig.send_message(&ToDevice::Scene(plain));
    rig.run(4);
    assert!(is_accepted(&rig, plain.epoch));
    answer_tiles(&mut rig, plain.epoch, TileMaterials::One(0));
    assert!(rig.status().bad_frames > 4);
}

#[test]
fn scene_with_missing_or_invalid_material_table_is_refused() {
    let mut rig = opened();
    let (known, other) = (table(&[0.5, 1.0]), table(&[0.5, 2.0]));
    let alone = scene_of(&known, 9);
    rig.send_message(&ToDevice::Scene(alone));
    rig.run(1);
    assert!(!is_accepted(&rig, 9), "without a table");
    assert!(!send_scene(&mut rig, alone, &other), "with another table");
    let broken = table(&[0.0, 1.0]);
    assert!(!send_scene(&mut rig, scene_of(&broken, 9), &broken));
    let broken = table(&[0.5, f32::NAN]);
    assert!(!send_scene(&mut rig, scene_of(&broken, 9), &broken));
    for bytes in [&[][..], &[1], &[200; 600]] {
        rig.send_message(&ToDevice::MaterialScene(MaterialScene {
            scene: alone,
            table: bytes,
        }));
        rig.run(1);
        assert!(!is_accepted(&rig, 9));
    }
    assert_eq!(rig.status().device.epoch, None);
    assert!(send_scene(&mut rig, alone, &known));
    // Its table has arrived by now.
    rig.send_message(&ToDevice::Scene(scene_of(&known, 10)));
    rig.run(1);
    assert!(is_accepted(&rig, 10));
    assert_eq!(rig.status().device.epoch, Some(10));
}

#[test]
fn consecutive_scenes_use_their_own_material_tables() {
    let mut rig = opened();
    let (soft, hard) = (table(&[0.5]), table(&[1.0]));
    let mut buffer = [0; MAX_TABLE_BYTES];
    for (epoch, table) in [(1, &soft), (2, &hard), (3, &soft), (4, &soft), (5, &hard)] {
        let scene = Scene {
            params: SurfaceParams {
                stiffness_n_per_mm: table.materials()[0].stiffness_n_per_mm,
                ..SurfaceParams::PREMIUM
            },
            ..scene_of(table, epoch)
        };
        let table = table_bytes(table, &mut buffer);
        rig.send_message(&ToDevice::MaterialScene(MaterialScene { scene, table }));
        rig.send_message(&ToDevice::Scene(scene));
    }
    rig.run(20);
    assert!(is_accepted(&rig, 5));
    answer_tiles(&mut rig, 5, TileMaterials::One(0));
    assert_eq!(rendered(&mut rig), 0.5);
}

#[test]
fn fallback_tile_with_materials_is_a_bad_frame() {
    let mut rig = opened();
    let table = table(&[0.5, 1.0]);
    let wide = CoarseTile {
        first: Cell::new(0, 0),
        shift: 4,
    };
    let fallback = Fallback { wide, near: None };
    let scene = Scene {
        fallback: Some(fallback),
        source: Source::Encoders,
        ..scene_of(&table, 9)
    };
    assert!(send_scene(&mut rig, scene, &table));
    let key = wide.key(0);
    assert!(rig.tile_requests().contains(&key));
    let (tile, materials) = (flat(9, key), TileMaterials::One(0));
    rig.send_message(&ToDevice::MaterialTile(MaterialTile { tile, materials }));
    rig.run(2);
    assert_eq!(rig.status().bad_frames, 1);
    rig.send_message(&ToDevice::Tile(tile));
    rig.run(2);
    assert_eq!(rig.status().bad_frames, 1);
}
