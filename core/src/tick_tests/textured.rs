//! Texture in a replay, where a tick is repeated for a tile.

use std::vec::Vec;

use super::*;
use crate::force::{Pattern, Shading, Texture};
use crate::terrain::TileIndex;

/// Points at one place, enough to forget the path to it.
const REST: u32 = 60;

/// Returns the forces of points that move by a fifth of a wave a tick over two tiles, the second of
/// which arrives `late` ticks after its request; and the number of ticks.
fn rendered(late: u32) -> (Vec<Vec3>, u32) {
    let mut tiles = std::vec![Tile::VACANT; 6];
    let mut spare: Vec<_> = tiles.iter_mut().collect();
    let mut next = || spare.pop().expect("a tile");
    let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
    let mut filled = |x| {
        let tile = next();
        let size = FieldSize::new(64, 32);
        let ground = |x: i32, _| 0.1 * (x % 2) as f32;
        tile.fill_from(TileKey::new(0, x, 0), 0, size, ground)
            .expect("in range");
        tile
    };
    let (west, east) = (filled(0), filled(1));
    let mut haptics = Haptics::<2>::new(slots, TickRate::DEFAULT, None);
    let mut scene = Scene {
        size: FieldSize::new(64, 32),
        ..scene(Source::Points)
    };
    scene.params.shading = Shading::Smooth;
    scene.params.texture = Texture {
        pattern: Pattern::Grating,
        amplitude_mm: 0.1,
        wavelength_mm: 1.0,
        ..Texture::NONE
    };
    assert!(matches!(haptics.accept(Command::Scene(scene)), Ok(None)));
    assert!(matches!(haptics.accept(Command::Tile(west)), Ok(Some(_))));
    let mut east = Some(east);
    let (mut forces, mut ticks, mut waited) = (Vec::new(), 0, 0);
    for seq in 0..REST + 25 {
        let x = 27.05 + 0.2 * seq.saturating_sub(REST) as f32;
        let height = if seq == 0 { 1.0 } else { -0.5 };
        let hip = GridPoint::new([0, 10, 0], Vec3::new(x, 0.5, height));
        assert!(matches!(
            haptics.accept(Command::Hip(HipCommand { seq, hip })),
            Ok(None)
        ));
        loop {
            ticks += 1;
            let outcome = haptics.tick(&GuardInputs::default(), true);
            if outcome.answered_seq == Some(seq) {
                forces.push(outcome.sample.force_n);
                break;
            }
            waited += u32::from(outcome.sample.missing_tile == Some(TileIndex::new(1, 0)));
            if waited > late
                && let Some(east) = east.take()
            {
                assert!(matches!(haptics.accept(Command::Tile(east)), Ok(Some(_))));
            }
            assert!(ticks < 300, "no answer for {hip:?}");
        }
    }
    (forces, ticks)
}

#[test]
fn late_tile_does_not_change_textured_forces() {
    let (early, ticks) = rendered(0);
    let (late, more) = rendered(20);
    assert_eq!(more, ticks + 20);
    assert_eq!(early, late);
    // All of them at a speed at which the texture is partly rendered.
    let textured = early
        .iter()
        .skip(REST as usize)
        .filter(|force| force.x.abs() > 1e-3);
    assert!(textured.count() > 10, "{early:?}");
}
