//! The surface between fallback and tiles, against a separate model in f64.

use std::boxed::Box;
use std::collections::BTreeMap;
use std::vec::Vec;

use glam::Vec3;

use super::*;
use crate::cases::cases;
use crate::contact::{Contact, ContactSettings, ContactState, Friction};
use crate::grid::GridPoint;
use crate::terrain::index::TileKey;
use crate::terrain::testing::buffers;
use crate::terrain::{CellBox, CoarseTile, FieldSize};

const SIZE: FieldSize = FieldSize::new(640, 640);
/// Under tiles 2 to 9 in each direction.
const WIDE: CoarseTile = CoarseTile {
    first: Cell::new(64, 64),
    shift: 3,
};
/// Its border crosses tiles.
const NEAR: CoarseTile = CoarseTile {
    first: Cell::new(112, 104),
    shift: 2,
};
const FALLBACK: Fallback = Fallback {
    wide: WIDE,
    near: Some(NEAR),
};
/// Base of the tiles' heights; those of the fallback have a lower base.
const BASE: i32 = 10;

/// Hills of some cells with a rough part.
fn hills(x: i32, y: i32) -> f64 {
    let hash = (x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663)) as u32;
    let rough = f64::from(hash.wrapping_mul(2_654_435_761) >> 20) / 4096.0;
    let (u, v) = (f64::from(x) / 19.0, f64::from(y) / 23.0);
    20.0 + 6.0 * (u.sin() + v.cos()) + rough
}

/// Returns the coarse fallback's height at a sample of the field.
fn coarse(x: i32, y: i32) -> Option<f64> {
    let hills = |x, y| f64::from(hills(x, y) as f32);
    through(NEAR, x, y, &near_sample).or_else(|| through(WIDE, x, y, &hills))
}

/// The samples of the near tile: on its border, those of the wide one.
fn near_sample(x: i32, y: i32) -> f64 {
    let last = NEAR.first.offset(32 * NEAR.spacing(), 32 * NEAR.spacing());
    match [NEAR.first.x, last.x].contains(&x) || [NEAR.first.y, last.y].contains(&y) {
        true => through(WIDE, x, y, &hills).expect("within it"),
        false => hills(x, y),
    }
}

/// Returns a coarse tile's height at a sample of the field.
fn through(tile: CoarseTile, x: i32, y: i32, sample: &dyn Fn(i32, i32) -> f64) -> Option<f64> {
    let side = f64::from(tile.spacing());
    let along = |at: i32, first: i32| {
        let place = f64::from(at - first) / side;
        (0.0..=32.0).contains(&place).then_some(place)
    };
    let (u, v) = (along(x, tile.first.x)?, along(y, tile.first.y)?);
    let at = |col: f64, row: f64| {
        let cell = |index: f64, first: i32| first + (index * side) as i32;
        sample(cell(col, tile.first.x), cell(row, tile.first.y))
    };
    let (col, row) = (u.floor().min(31.0), v.floor().min(31.0));
    let (s, t) = (u - col, v - row);
    let south = at(col, row) * (1.0 - s) + at(col + 1.0, row) * s;
    let north = at(col, row + 1.0) * (1.0 - s) + at(col + 1.0, row + 1.0) * s;
    Some(south * (1.0 - t) + north * t)
}

/// A window over the hills, and the model's distance of each arrived tile from the fallback.
struct Bed<'t> {
    window: Window<'t, 4>,
    spare: Vec<&'t mut Tile>,
    allowed: BTreeMap<(i32, i32), f64>,
}

fn room() -> Vec<Tile> {
    buffers::<4>()
}

impl<'t> Bed<'t> {
    fn new(room: &'t mut [Tile]) -> Self {
        let mut spare: Vec<_> = room.iter_mut().collect();
        let mut next = || spare.pop().expect("a buffer for every slot");
        let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
        let mut window = Window::new(slots);
        window.reset(0, SIZE, 1 << 28);
        window.lay(Some(FALLBACK));
        Self {
            window,
            spare,
            allowed: BTreeMap::new(),
        }
    }

    fn with_fallback(room: &'t mut [Tile]) -> Self {
        let mut bed = Self::new(room);
        bed.lays();
        bed
    }

    fn lays(&mut self) {
        self.lays_part(WIDE, 3, &hills);
        self.lays_part(NEAR, -2, &near_sample);
    }

    fn lays_part(&mut self, part: CoarseTile, base: i32, sample: &dyn Fn(i32, i32) -> f64) {
        let tile = self.spare.pop().expect("a buffer");
        let side = part.spacing();
        let height = |col: usize, row: usize| {
            let (x, y) = (col as i32 * side, row as i32 * side);
            (sample(part.first.x + x, part.first.y + y) - f64::from(base)) as f32
        };
        tile.fill(part.key(0), base, height).expect("in range");
        let spent = self.window.take(tile, [Cell::new(0, 0); 2]);
        self.spare.extend(spent);
    }

    /// Delivers a tile while the HIP is in a cell.
    fn comes(&mut self, col: i32, row: i32, rendered: Cell) {
        let key = TileKey::new(0, col, row);
        let tile = self.spare.pop().expect("a buffer");
        let height = |x, y| (hills(x, y) - f64::from(BASE)) as f32;
        tile.fill_from(key, BASE, SIZE, height).expect("in range");
        if let Some(spent) = self.window.take(tile, [rendered; 2]) {
            if let Some(key) = spent.key() {
                self.allowed.remove(&(key.index.col, key.index.row));
            }
            self.spare.push(spent);
        }
        let at = TileIndex::holding(rendered);
        let apart = (at.col - col).abs().max((at.row - row).abs());
        let beside_one = self.allowed.get(&(at.col, at.row)) != Some(&f64::INFINITY);
        let settles = apart == 0 || (apart == 1 && beside_one);
        let before = self.allowed.get(&(col, row)).copied();
        let now = if settles { 0.0 } else { f64::INFINITY };
        self.allowed.insert((col, row), before.unwrap_or(now));
    }

    fn settles(&mut self, step: f32) {
        self.window.settle(step);
        for (&(col, row), allowed) in &mut self.allowed {
            *allowed += f64::from(step);
            if self.window.is_settled(Cell::new(col * 32, row * 32)) {
                *allowed = f64::INFINITY;
            }
        }
    }

    /// The model's height at a sample.
    fn rendered(&self, x: i32, y: i32) -> Option<f64> {
        let sharing =
            [(0, 0), (-1, 0), (0, -1), (-1, -1)].map(|(i, j)| ((x + i) >> 5, (y + j) >> 5));
        let allowed = sharing.iter().filter_map(|tile| self.allowed.get(tile));
        let most = allowed.fold(None, |most: Option<f64>, a| {
            Some(most.unwrap_or(*a).max(*a))
        });
        let fine = f64::from((hills(x, y) - f64::from(BASE)) as f32) + f64::from(BASE);
        match (most, coarse(x, y)) {
            (None, coarse) => coarse,
            (Some(_), None) => Some(fine),
            (Some(most), Some(coarse)) => Some(coarse + (fine - coarse).clamp(-most, most)),
        }
    }

    /// Compares every patch in a box of tiles with the model.
    fn judge(&self, tiles: core::ops::Range<i32>) -> usize {
        let mut patches = 0;
        for x in tiles.start * 32..tiles.end * 32 {
            for y in tiles.start * 32..tiles.end * 32 {
                let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let model = corners.map(|(i, j)| self.rendered(x + i, y + j));
                match self.window.ground(Cell::new(x, y)) {
                    CellContent::Patch(Corners { base, heights }) => {
                        for (height, model) in heights.iter().zip(model) {
                            let height = f64::from(base) + f64::from(*height);
                            let model = model.expect("the model has it, too");
                            assert!((height - model).abs() < 2e-5, "{x} {y}: {height} {model}");
                        }
                        patches += 1;
                    }
                    CellContent::Missing => assert!(model.contains(&None), "{x} {y}"),
                    CellContent::NoData => panic!("{x} {y}: there is none"),
                }
            }
        }
        patches
    }
}

const HERE: Cell = Cell::new(140, 140);

#[test]
fn window_matches_the_f64_model_after_every_tile_and_blend() {
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    assert_eq!(bed.judge(3..6), 96 * 96, "the fallback alone");
    let tiles = [
        (4, 4),
        (5, 4),
        (3, 4),
        (4, 5),
        (5, 5),
        (4, 3),
        (8, 4),
        (4, 4),
    ];
    for (come, (col, row)) in tiles.into_iter().enumerate() {
        bed.comes(col, row, HERE);
        for step in [0.0, 0.02, 0.3, if come % 3 == 2 { 40.0 } else { 0.1 }] {
            bed.settles(step);
            bed.judge(3..7);
        }
    }
    assert!(bed.window.is_settled(Cell::new(5 * 32, 5 * 32)));
}

/// Cells on either side of the near tile's border are included.
#[test]
fn cells_that_share_samples_of_the_fallback_agree_to_the_bit() {
    let mut room = room();
    let bed = Bed::with_fallback(&mut room);
    let heights = |x: i32, y: i32| match bed.window.ground(Cell::new(x, y)) {
        CellContent::Patch(corners) => corners.heights.map(f32::to_bits),
        ground => panic!("{x} {y}: {ground:?}"),
    };
    for x in 64..319 {
        for y in 64..319 {
            let ([_, se, nw, ne], east, north) =
                (heights(x, y), heights(x + 1, y), heights(x, y + 1));
            assert_eq!([se, ne], [east[0], east[2]], "{x} {y}");
            assert_eq!([nw, ne], [north[0], north[1]], "{x} {y}");
        }
    }
}

#[test]
fn blended_samples_keep_their_speed_and_end_at_the_tile() {
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    let heights = |bed: &Bed<'_>| {
        let mut all = Vec::new();
        for x in 126..162 {
            for y in 126..162 {
                let CellContent::Patch(Corners { base, heights }) =
                    bed.window.ground(Cell::new(x, y))
                else {
                    panic!("{x} {y}: no patch");
                };
                all.extend(heights.map(|height| f64::from(base) + f64::from(height)));
            }
        }
        all
    };
    let mut last = heights(&bed);
    bed.comes(4, 4, HERE);
    bed.comes(5, 4, HERE);
    let mut ticks = 0;
    while !(bed.window.is_settled(HERE) && bed.window.is_settled(Cell::new(161, 140))) {
        let now = heights(&bed);
        for (now, last) in now.iter().zip(&last) {
            assert!(
                (now - last).abs() < 0.05 + 2e-5,
                "tick {ticks}: {last} {now}"
            );
        }
        last = now;
        bed.settles(0.05);
        ticks += 1;
        assert!(ticks < 1000);
    }
    assert!(ticks > 20, "{ticks}");
    for (now, last) in heights(&bed).iter().zip(&last) {
        assert!((now - last).abs() < 0.05 + 2e-5);
    }
    let CellContent::Patch(corners) = bed.window.ground(HERE) else {
        panic!("a patch");
    };
    assert_eq!(corners.base, BASE);
    assert_eq!(
        corners.heights[0],
        (hills(140, 140) - f64::from(BASE)) as f32
    );
    // Patches of the tile from before its blend must not be used any more.
    let low = Altitude::new(40, 0.0);
    assert!(
        bed.window
            .is_clear(CellBox::around(HERE, HERE.offset(9, 9)), low)
    );
}

#[test]
fn untouched_tile_is_the_surface_at_once() {
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    bed.comes(6, 4, HERE);
    assert!(bed.window.is_settled(Cell::new(6 * 32, 140)));
    // Beside the hand's tile, which is still the fallback: it would bend at once.
    bed.comes(5, 4, HERE);
    assert!(!bed.window.is_settled(Cell::new(5 * 32, 140)));
    bed.judge(3..7);
    bed.settles(100.0);
    bed.comes(4, 4, HERE);
    bed.settles(100.0);
    // The hand's tile is now the surface: nothing bends any more.
    bed.comes(3, 4, HERE);
    assert!(bed.window.is_settled(Cell::new(3 * 32, 140)));
    bed.judge(3..7);
}

#[test]
fn tile_arriving_before_its_fallback_is_not_blended() {
    let mut room = room();
    let mut bed = Bed::new(&mut room);
    assert_eq!(bed.window.ground(HERE), CellContent::Missing);
    bed.comes(4, 4, HERE);
    assert!(bed.window.is_settled(HERE));
    let before = bed.window.ground(HERE);
    bed.lays();
    assert_eq!(bed.window.ground(HERE), before);
    bed.allowed.insert((4, 4), f64::INFINITY);
    bed.judge(3..6);
}

#[test]
fn no_data_of_a_tile_takes_effect_without_blending() {
    let mut room = room();
    let mut bed = Bed::new(&mut room);
    bed.window.lay(Some(Fallback {
        wide: WIDE,
        near: None,
    }));
    let one = |x, y| if (x, y) == (144, 144) { f64::NAN } else { 1.0 };
    bed.lays_part(WIDE, 0, &one);
    let ground = |bed: &Bed<'_>, x, y| bed.window.ground(Cell::new(x, y));
    assert_eq!(ground(&bed, 140, 140), CellContent::Missing);
    assert!(matches!(ground(&bed, 130, 140), CellContent::Patch(_)));
    let tile = bed.spare.pop().expect("a buffer");
    let height = |x, y| if (x, y) == (131, 141) { f32::NAN } else { 2.0 };
    let key = TileKey::new(0, 4, 4);
    tile.fill_from(key, 0, SIZE, height).expect("in range");
    let _ = bed.window.take(tile, [HERE; 2]);
    bed.window.settle(0.25);
    assert_eq!(ground(&bed, 130, 140), CellContent::NoData);
    let patch = |height| {
        CellContent::Patch(Corners {
            base: 0,
            heights: [height; 4],
        })
    };
    assert_eq!(ground(&bed, 135, 150), patch(1.25), "it settles");
    assert_eq!(
        ground(&bed, 140, 140),
        patch(2.0),
        "nothing was rendered there"
    );
}

#[test]
fn fallback_is_rendered_once_all_of_it_is_here() {
    for near_first in [false, true] {
        let mut room = room();
        let mut bed = Bed::new(&mut room);
        let lays = |bed: &mut Bed<'_>, near: bool| match near {
            true => bed.lays_part(NEAR, -2, &near_sample),
            false => bed.lays_part(WIDE, 3, &hills),
        };
        lays(&mut bed, near_first);
        assert_eq!(bed.window.ground(HERE), CellContent::Missing);
        assert!(!bed.window.settle(0.0) || bed.window.ground(HERE) == CellContent::Missing);
        lays(&mut bed, !near_first);
        assert!(bed.window.settle(0.0), "another surface");
        assert_eq!(bed.judge(2..9), 224 * 224);
    }
}

#[test]
fn cell_is_missing_if_only_the_near_fallback_has_no_data() {
    let mut room = room();
    let mut bed = Bed::new(&mut room);
    bed.lays_part(WIDE, 3, &hills);
    let holed = |x, y| match (x, y) == (144, 144) {
        true => f64::NAN,
        false => near_sample(x, y),
    };
    bed.lays_part(NEAR, -2, &holed);
    assert_eq!(bed.window.ground(Cell::new(141, 146)), CellContent::Missing);
    let low = Altitude::new(60, 0.0);
    let at = Cell::new(144, 144);
    assert!(!bed.window.box_is_clear(CellBox::around(at, at), low));
    assert!(matches!(
        bed.window.ground(Cell::new(100, 100)),
        CellContent::Patch(_)
    ));
}

#[test]
fn near_tile_counts_for_clearance_and_blend_distance() {
    let mut room = room();
    let mut bed = Bed::new(&mut room);
    bed.lays_part(WIDE, 0, &|_, _| 0.0);
    let bump = |x, y| if (x, y) == (144, 144) { 10.0 } else { 0.0 };
    bed.lays_part(NEAR, 0, &bump);
    let at = CellBox::around(Cell::new(144, 144), Cell::new(144, 144));
    assert!(!bed.window.box_is_clear(at, Altitude::new(5, 0.0)));
    assert!(bed.window.box_is_clear(at, Altitude::new(11, 0.0)));
    let tile = bed.spare.pop().expect("a buffer");
    let key = TileKey::new(0, 4, 4);
    tile.fill(key, 0, |_, _| 0.0).expect("in range");
    assert!(bed.window.take(tile, [HERE; 2]).is_some());
    assert!(!bed.window.is_settled(HERE));
    for _ in 0..9 {
        bed.window.settle(1.0);
    }
    let CellContent::Patch(corners) = bed.window.ground(Cell::new(144, 144)) else {
        panic!("a patch");
    };
    assert_eq!(
        corners.heights[0], 1.0,
        "a cell above the tile after nine of ten"
    );
}

#[test]
fn clear_means_clear_over_what_has_not_settled() {
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    let mut seen = [0, 0];
    const EACH: usize = cases(1, 8) as usize;
    for step in (0..3000_i32).step_by(EACH) {
        match step % 300 {
            0 => bed.comes(3 + step / 300 % 4, 3 + step / 1200 % 4, HERE),
            100 | 200 => bed.settles(0.7),
            _ => {}
        }
        let a = Cell::new(96 + (step * 7) % 128, 96 + (step * 13) % 128);
        let b = a.offset(step % 41 - 20, step * 3 % 57 - 28);
        let low = Altitude::new(25 + step % 12, 0.5);
        let span = CellBox::around(a, b);
        let clear = bed.window.is_clear(span, low);
        seen[usize::from(clear)] += 1;
        for (x, y) in (span.from.x..=span.to.x + 1)
            .flat_map(|x| (span.from.y..=span.to.y + 1).map(move |y| (x, y)))
            .filter(|_| clear)
        {
            let rendered = bed.rendered(x, y);
            let is_below =
                rendered.is_some_and(|rendered| rendered < f64::from(25 + step % 12) + 0.5);
            assert!(is_below, "{span:?} {low:?} {x} {y} {rendered:?}");
        }
    }
    assert!(seen[0] > 100 / EACH && seen[1] > 100 / EACH, "{seen:?}");
}

#[test]
fn buffers_are_neither_lost_nor_doubled() {
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    assert_eq!(bed.spare.len(), 2, "the fallback keeps two");
    bed.lays();
    bed.comes(4, 4, HERE);
    bed.comes(8, 4, HERE);
    bed.comes(8, 4, HERE);
    assert_eq!(bed.spare.len(), 2);
    assert!(bed.window.take_spare().is_none(), "they are in use");
    bed.window.lay(Some(FALLBACK));
    assert!(bed.window.take_spare().is_none(), "others are going to be");
    let without_near = Fallback {
        near: None,
        ..FALLBACK
    };
    bed.window.lay(Some(without_near));
    let spare = bed.window.take_spare().expect("no near one any more");
    assert_eq!(spare.key(), None);
    assert!(bed.window.take_spare().is_none(), "the wide one is to be");
    bed.window.reset(0, SIZE, 50);
    assert!(bed.window.take_spare().is_some(), "no fallback any more");
    assert!(bed.window.take_spare().is_none());
}

/// The sample in the middle of the hand's tile that is farthest above or below the fallback.
fn where_it_moves(up: bool) -> (i32, i32) {
    let rise = |&(x, y): &(i32, i32)| {
        let rise = hills(x, y) - coarse(x, y).expect("known");
        if up { rise } else { -rise }
    };
    let all = (130..158).flat_map(|x| (130..158).map(move |y| (x, y)));
    let most = all
        .max_by(|a, b| rise(a).total_cmp(&rise(b)))
        .expect("some");
    assert!(rise(&most) > 0.3, "{}", rise(&most));
    most
}

/// Depth and state in each tick of a hand that does not move, `above` the fallback, while the tile
/// under it arrives in tick 50.
fn held_still(friction: Friction, up: bool, above: f64) -> Vec<(f64, ContactState)> {
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    let settings = ContactSettings::AT_1_KHZ.with_friction(friction);
    let mut contact = Box::new(Contact::new(settings));
    let (x, y) = where_it_moves(up);
    let z = (coarse(x, y).expect("known") + above) as f32;
    let over = |z| GridPoint::new([x, y, 0], Vec3::new(0.01, 0.02, z));
    contact.step(&bed.window, &over(60.0));
    (0..300)
        .map(|tick| {
            if tick == 50 {
                bed.comes(4, 4, HERE);
            }
            if bed.window.settle(STEP) {
                contact.surface_moved(&bed.window);
            }
            let output = *contact.step(&bed.window, &over(z));
            if output.state == ContactState::Touching {
                is_on_the_surface(&bed.window, &output.proxy);
            }
            (f64::from(output.displacement.length()), output.state)
        })
        .collect()
}

/// Cells that the surface moves in a tick.
const STEP: f32 = 0.02;

fn is_on_the_surface(window: &Window<'_, 4>, proxy: &GridPoint) {
    let CellContent::Patch(corners) = window.ground(proxy.column()) else {
        panic!("no patch under {proxy:?}");
    };
    let [sw, se, nw, ne] = corners
        .heights
        .map(|h| f64::from(h) + f64::from(corners.base));
    let (u, v) = (f64::from(proxy.frac().x), f64::from(proxy.frac().y));
    let height = (sw * (1.0 - u) + se * u) * (1.0 - v) + (nw * (1.0 - u) + ne * u) * v;
    let z = f64::from(proxy.cell()[2]) + f64::from(proxy.frac().z);
    assert!((z - height).abs() < 1e-5, "{z} over {height}");
}

#[test]
fn blending_under_a_still_hip_changes_force_smoothly() {
    for (mu, up, above) in [0.0, 0.8].into_iter().flat_map(|mu| {
        [(true, -0.5), (true, 0.2), (false, -0.2), (false, -0.9)].map(|(up, z)| (mu, up, z))
    }) {
        let friction = Friction {
            static_mu: mu,
            dynamic_mu: mu,
            viscous_s: 0.0,
        };
        let rendered = held_still(friction, up, above);
        let mut most = 0.0_f64;
        for (tick, pair) in rendered.windows(2).enumerate().skip(2) {
            let change = pair[1].0 - pair[0].0;
            let bound = 1.001 * f64::from(STEP) + 1e-5;
            assert!(change < bound, "{mu} {up} {above} {tick}: {pair:?}");
            // A proxy that friction held may slide when the ground under it has turned.
            assert!(mu > 0.0 || change > -bound, "{up} {above} {tick}: {pair:?}");
            most = most.max(change.abs());
        }
        assert!(most > 1e-3, "there was a force: {most}");
        let touches = |tick: usize| rendered[tick].1 == ContactState::Touching;
        assert_eq!(touches(49), above < 0.0, "{mu} {up} {above}");
        assert_eq!(
            touches(299),
            up || above < -0.5,
            "{mu} {up} {above} {:?}",
            rendered[299]
        );
    }
}

#[test]
fn a_hand_that_the_surface_passes_does_not_fall_through_it() {
    let (x, y) = where_it_moves(true);
    let mut room = room();
    let mut bed = Bed::with_fallback(&mut room);
    let mut contact = Box::new(Contact::new(ContactSettings::AT_1_KHZ));
    let z = (coarse(x, y).expect("known") + 0.1) as f32;
    let hip = GridPoint::new([x, y, 0], Vec3::new(0.01, 0.01, z));
    contact.step(&bed.window, &GridPoint::new([x, y, 60], Vec3::ZERO));
    assert_eq!(contact.step(&bed.window, &hip).state, ContactState::Free);
    bed.comes(4, 4, HERE);
    for _ in 0..400 {
        if bed.window.settle(0.02) {
            contact.surface_moved(&bed.window);
        }
        contact.step(&bed.window, &hip);
    }
    assert!(bed.window.is_settled(HERE));
    assert_eq!(contact.output().state, ContactState::Touching);
    assert!(contact.output().displacement.length() > 0.1);
}
