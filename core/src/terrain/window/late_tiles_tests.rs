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
struct TestWindow<'t> {
    window: Window<'t, 4>,
    spare: Vec<&'t mut Tile>,
    allowed: BTreeMap<(i32, i32), f64>,
}

fn memory() -> Vec<Tile> {
    buffers::<4>()
}

impl<'t> TestWindow<'t> {
    fn new(memory: &'t mut [Tile]) -> Self {
        let mut spare: Vec<_> = memory.iter_mut().collect();
        let mut next = || spare.pop().expect("a buffer for every slot");
        let slots = core::array::from_fn(|_| core::array::from_fn(|_| next()));
        let mut window = Window::new(slots);
        window.reset(0, SIZE, 1 << 28);
        window.set_fallback(Some(FALLBACK));
        Self {
            window,
            spare,
            allowed: BTreeMap::new(),
        }
    }

    fn with_fallback(memory: &'t mut [Tile]) -> Self {
        let mut test = Self::new(memory);
        test.load_fallback();
        test
    }

    fn load_fallback(&mut self) {
        self.load_part(WIDE, 3, &hills);
        self.load_part(NEAR, -2, &near_sample);
    }

    fn load_part(&mut self, part: CoarseTile, base: i32, sample: &dyn Fn(i32, i32) -> f64) {
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
    fn deliver(&mut self, col: i32, row: i32, rendered: Cell) {
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
        let at = TileIndex::containing(rendered);
        let apart = (at.col - col).abs().max((at.row - row).abs());
        let beside_one = self.allowed.get(&(at.col, at.row)) != Some(&f64::INFINITY);
        let blends = apart == 0 || (apart == 1 && beside_one);
        let before = self.allowed.get(&(col, row)).copied();
        let now = if blends { 0.0 } else { f64::INFINITY };
        self.allowed.insert((col, row), before.unwrap_or(now));
    }

    fn blend(&mut self, step: f32) {
        self.window.blend_tiles(step);
        for (&(col, row), allowed) in &mut self.allowed {
            *allowed += f64::from(step);
            if self.window.is_blended(Cell::new(col * 32, row * 32)) {
                *allowed = f64::INFINITY;
            }
        }
    }

    /// The model's height at a sample.
    fn rendered(&self, x: i32, y: i32) -> Option<f64> {
        let sharing =
            [(0, 0), (-1, 0), (0, -1), (-1, -1)].map(|(i, j)| ((x + i) >> 5, (y + j) >> 5));
        let allowed = sharing.iter().filter_map(|tile| self.allowed.get(tile));
        let max = allowed.fold(None, |max: Option<f64>, a| Some(max.unwrap_or(*a).max(*a)));
        let fine = f64::from((hills(x, y) - f64::from(BASE)) as f32) + f64::from(BASE);
        match (max, coarse(x, y)) {
            (None, coarse) => coarse,
            (Some(_), None) => Some(fine),
            (Some(max), Some(coarse)) => Some(coarse + (fine - coarse).clamp(-max, max)),
        }
    }

    /// Compares every patch in a box of tiles with the model.
    fn compare_with_model(&self, tiles: core::ops::Range<i32>) -> usize {
        let mut patches = 0;
        for x in tiles.start * 32..tiles.end * 32 {
            for y in tiles.start * 32..tiles.end * 32 {
                let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let model = corners.map(|(i, j)| self.rendered(x + i, y + j));
                match self.window.ground(Cell::new(x, y)) {
                    CellContent::Patch(Corners { base, heights }) => {
                        for (height, model) in heights.iter().zip(model) {
                            let height = f64::from(base) + f64::from(*height);
                            let model = model.expect("the model has it");
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
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    assert_eq!(test.compare_with_model(3..6), 96 * 96, "the fallback alone");
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
    for (index, (col, row)) in tiles.into_iter().enumerate() {
        test.deliver(col, row, HERE);
        for step in [0.0, 0.02, 0.3, if index % 3 == 2 { 40.0 } else { 0.1 }] {
            test.blend(step);
            test.compare_with_model(3..7);
        }
    }
    assert!(test.window.is_blended(Cell::new(5 * 32, 5 * 32)));
}

/// Cells on either side of the near tile's border are included.
#[test]
fn fallback_cells_with_shared_samples_agree_to_the_bit() {
    let mut memory = memory();
    let test = TestWindow::with_fallback(&mut memory);
    let heights = |x: i32, y: i32| match test.window.ground(Cell::new(x, y)) {
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
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    let heights = |test: &TestWindow<'_>| {
        let mut all = Vec::new();
        for x in 126..162 {
            for y in 126..162 {
                let CellContent::Patch(Corners { base, heights }) =
                    test.window.ground(Cell::new(x, y))
                else {
                    panic!("{x} {y}: no patch");
                };
                all.extend(heights.map(|height| f64::from(base) + f64::from(height)));
            }
        }
        all
    };
    let mut last = heights(&test);
    test.deliver(4, 4, HERE);
    test.deliver(5, 4, HERE);
    let mut ticks = 0;
    while !(test.window.is_blended(HERE) && test.window.is_blended(Cell::new(161, 140))) {
        let now = heights(&test);
        for (now, last) in now.iter().zip(&last) {
            assert!(
                (now - last).abs() < 0.05 + 2e-5,
                "tick {ticks}: {last} {now}"
            );
        }
        last = now;
        test.blend(0.05);
        ticks += 1;
        assert!(ticks < 1000);
    }
    assert!(ticks > 20, "{ticks}");
    for (now, last) in heights(&test).iter().zip(&last) {
        assert!((now - last).abs() < 0.05 + 2e-5);
    }
    let CellContent::Patch(corners) = test.window.ground(HERE) else {
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
        test.window
            .is_clear(CellBox::around(HERE, HERE.offset(9, 9)), low)
    );
}

#[test]
fn untouched_tile_is_rendered_at_once() {
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    test.deliver(6, 4, HERE);
    assert!(test.window.is_blended(Cell::new(6 * 32, 140)));
    // Beside the hand's tile, which is still the fallback: it would bend at once.
    test.deliver(5, 4, HERE);
    assert!(!test.window.is_blended(Cell::new(5 * 32, 140)));
    test.compare_with_model(3..7);
    test.blend(100.0);
    test.deliver(4, 4, HERE);
    test.blend(100.0);
    // The hand's tile is now the surface: nothing bends any more.
    test.deliver(3, 4, HERE);
    assert!(test.window.is_blended(Cell::new(3 * 32, 140)));
    test.compare_with_model(3..7);
}

#[test]
fn tile_arriving_before_its_fallback_is_not_blended() {
    let mut memory = memory();
    let mut test = TestWindow::new(&mut memory);
    assert_eq!(test.window.ground(HERE), CellContent::Missing);
    test.deliver(4, 4, HERE);
    assert!(test.window.is_blended(HERE));
    let before = test.window.ground(HERE);
    test.load_fallback();
    assert_eq!(test.window.ground(HERE), before);
    test.allowed.insert((4, 4), f64::INFINITY);
    test.compare_with_model(3..6);
}

#[test]
fn no_data_of_a_tile_takes_effect_without_blending() {
    let mut memory = memory();
    let mut test = TestWindow::new(&mut memory);
    test.window.set_fallback(Some(Fallback {
        wide: WIDE,
        near: None,
    }));
    let one = |x, y| if (x, y) == (144, 144) { f64::NAN } else { 1.0 };
    test.load_part(WIDE, 0, &one);
    let ground = |test: &TestWindow<'_>, x, y| test.window.ground(Cell::new(x, y));
    assert_eq!(ground(&test, 140, 140), CellContent::Missing);
    assert!(matches!(ground(&test, 130, 140), CellContent::Patch(_)));
    let tile = test.spare.pop().expect("a buffer");
    let height = |x, y| if (x, y) == (131, 141) { f32::NAN } else { 2.0 };
    let key = TileKey::new(0, 4, 4);
    tile.fill_from(key, 0, SIZE, height).expect("in range");
    let _ = test.window.take(tile, [HERE; 2]);
    test.window.blend_tiles(0.25);
    assert_eq!(ground(&test, 130, 140), CellContent::NoData);
    let patch = |height| {
        CellContent::Patch(Corners {
            base: 0,
            heights: [height; 4],
        })
    };
    assert_eq!(ground(&test, 135, 150), patch(1.25), "the blend ends");
    assert_eq!(
        ground(&test, 140, 140),
        patch(2.0),
        "nothing was rendered there"
    );
}

#[test]
fn fallback_is_rendered_once_all_its_tiles_arrived() {
    for near_first in [false, true] {
        let mut memory = memory();
        let mut test = TestWindow::new(&mut memory);
        let load_fallback = |test: &mut TestWindow<'_>, near: bool| match near {
            true => test.load_part(NEAR, -2, &near_sample),
            false => test.load_part(WIDE, 3, &hills),
        };
        load_fallback(&mut test, near_first);
        assert_eq!(test.window.ground(HERE), CellContent::Missing);
        assert!(!test.window.blend_tiles(0.0) || test.window.ground(HERE) == CellContent::Missing);
        load_fallback(&mut test, !near_first);
        assert!(test.window.blend_tiles(0.0), "another surface");
        assert_eq!(test.compare_with_model(2..9), 224 * 224);
    }
}

#[test]
fn cell_is_missing_if_only_the_near_fallback_has_no_data() {
    let mut memory = memory();
    let mut test = TestWindow::new(&mut memory);
    test.load_part(WIDE, 3, &hills);
    let holed = |x, y| match (x, y) == (144, 144) {
        true => f64::NAN,
        false => near_sample(x, y),
    };
    test.load_part(NEAR, -2, &holed);
    assert_eq!(
        test.window.ground(Cell::new(141, 146)),
        CellContent::Missing
    );
    let low = Altitude::new(60, 0.0);
    let at = Cell::new(144, 144);
    assert!(!test.window.box_is_clear(CellBox::around(at, at), low));
    assert!(matches!(
        test.window.ground(Cell::new(100, 100)),
        CellContent::Patch(_)
    ));
}

#[test]
fn near_tile_counts_for_clearance_and_blend_distance() {
    let mut memory = memory();
    let mut test = TestWindow::new(&mut memory);
    test.load_part(WIDE, 0, &|_, _| 0.0);
    let bump = |x, y| if (x, y) == (144, 144) { 10.0 } else { 0.0 };
    test.load_part(NEAR, 0, &bump);
    let at = CellBox::around(Cell::new(144, 144), Cell::new(144, 144));
    assert!(!test.window.box_is_clear(at, Altitude::new(5, 0.0)));
    assert!(test.window.box_is_clear(at, Altitude::new(11, 0.0)));
    let tile = test.spare.pop().expect("a buffer");
    let key = TileKey::new(0, 4, 4);
    tile.fill(key, 0, |_, _| 0.0).expect("in range");
    assert!(test.window.take(tile, [HERE; 2]).is_some());
    assert!(!test.window.is_blended(HERE));
    for _ in 0..9 {
        test.window.blend_tiles(1.0);
    }
    let CellContent::Patch(corners) = test.window.ground(Cell::new(144, 144)) else {
        panic!("a patch");
    };
    assert_eq!(
        corners.heights[0], 1.0,
        "a cell above the tile after nine of ten"
    );
}

#[test]
fn clear_boxes_are_clear_while_tiles_blend() {
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    let mut counts = [0, 0];
    const EACH: usize = cases(1, 8) as usize;
    for step in (0..3000_i32).step_by(EACH) {
        match step % 300 {
            0 => test.deliver(3 + step / 300 % 4, 3 + step / 1200 % 4, HERE),
            100 | 200 => test.blend(0.7),
            _ => {}
        }
        let a = Cell::new(96 + (step * 7) % 128, 96 + (step * 13) % 128);
        let b = a.offset(step % 41 - 20, step * 3 % 57 - 28);
        let low = Altitude::new(25 + step % 12, 0.5);
        let span = CellBox::around(a, b);
        let clear = test.window.is_clear(span, low);
        counts[usize::from(clear)] += 1;
        for (x, y) in (span.from.x..=span.to.x + 1)
            .flat_map(|x| (span.from.y..=span.to.y + 1).map(move |y| (x, y)))
            .filter(|_| clear)
        {
            let rendered = test.rendered(x, y);
            let is_below =
                rendered.is_some_and(|rendered| rendered < f64::from(25 + step % 12) + 0.5);
            assert!(is_below, "{span:?} {low:?} {x} {y} {rendered:?}");
        }
    }
    assert!(
        counts[0] > 100 / EACH && counts[1] > 100 / EACH,
        "{counts:?}"
    );
}

#[test]
fn no_buffer_is_lost_or_duplicated() {
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    assert_eq!(test.spare.len(), 2, "the fallback keeps two");
    test.load_fallback();
    test.deliver(4, 4, HERE);
    test.deliver(8, 4, HERE);
    test.deliver(8, 4, HERE);
    assert_eq!(test.spare.len(), 2);
    assert!(test.window.take_spare().is_none(), "they are in use");
    test.window.set_fallback(Some(FALLBACK));
    assert!(test.window.take_spare().is_none(), "others are going to be");
    let without_near = Fallback {
        near: None,
        ..FALLBACK
    };
    test.window.set_fallback(Some(without_near));
    let spare = test.window.take_spare().expect("no near one any more");
    assert_eq!(spare.key(), None);
    assert!(test.window.take_spare().is_none(), "the wide one is to be");
    test.window.reset(0, SIZE, 50);
    assert!(test.window.take_spare().is_some(), "no fallback any more");
    assert!(test.window.take_spare().is_none());
}

/// The sample in the middle of the hand's tile that is farthest above or below the fallback.
fn sample_farthest_from_fallback(up: bool) -> (i32, i32) {
    let rise = |&(x, y): &(i32, i32)| {
        let rise = hills(x, y) - coarse(x, y).expect("stored");
        if up { rise } else { -rise }
    };
    let all = (130..158).flat_map(|x| (130..158).map(move |y| (x, y)));
    let max = all
        .max_by(|a, b| rise(a).total_cmp(&rise(b)))
        .expect("some");
    assert!(rise(&max) > 0.3, "{}", rise(&max));
    max
}

/// Depth and state in each tick of a hand that does not move, `above` the fallback, while the tile
/// under it arrives in tick 50.
fn render_under_still_hand(friction: Friction, up: bool, above: f64) -> Vec<(f64, ContactState)> {
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    let settings = ContactSettings::AT_1_KHZ.with_friction(friction);
    let mut contact = Box::new(Contact::new(settings));
    let (x, y) = sample_farthest_from_fallback(up);
    let z = (coarse(x, y).expect("stored") + above) as f32;
    let over = |z| GridPoint::new([x, y, 0], Vec3::new(0.01, 0.02, z));
    contact.step(&test.window, &over(60.0));
    (0..300)
        .map(|tick| {
            if tick == 50 {
                test.deliver(4, 4, HERE);
            }
            if test.window.blend_tiles(STEP) {
                contact.surface_moved(&test.window);
            }
            let output = *contact.step(&test.window, &over(z));
            if output.state == ContactState::Touching {
                assert_on_surface(&test.window, &output.proxy);
            }
            (f64::from(output.displacement.length()), output.state)
        })
        .collect()
}

/// Cells that the surface moves in a tick.
const STEP: f32 = 0.02;

fn assert_on_surface(window: &Window<'_, 4>, proxy: &GridPoint) {
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
        let rendered = render_under_still_hand(friction, up, above);
        let mut max = 0.0_f64;
        for (tick, pair) in rendered.windows(2).enumerate().skip(2) {
            let change = pair[1].0 - pair[0].0;
            let bound = 1.001 * f64::from(STEP) + 1e-5;
            assert!(change < bound, "{mu} {up} {above} {tick}: {pair:?}");
            // A proxy that friction held may slide when the ground under it has turned.
            assert!(mu > 0.0 || change > -bound, "{up} {above} {tick}: {pair:?}");
            max = max.max(change.abs());
        }
        assert!(max > 1e-3, "there was a force: {max}");
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
fn hand_passed_by_the_surface_does_not_fall_through() {
    let (x, y) = sample_farthest_from_fallback(true);
    let mut memory = memory();
    let mut test = TestWindow::with_fallback(&mut memory);
    let mut contact = Box::new(Contact::new(ContactSettings::AT_1_KHZ));
    let z = (coarse(x, y).expect("stored") + 0.1) as f32;
    let hip = GridPoint::new([x, y, 0], Vec3::new(0.01, 0.01, z));
    contact.step(&test.window, &GridPoint::new([x, y, 60], Vec3::ZERO));
    assert_eq!(contact.step(&test.window, &hip).state, ContactState::Free);
    test.deliver(4, 4, HERE);
    for _ in 0..400 {
        if test.window.blend_tiles(0.02) {
            contact.surface_moved(&test.window);
        }
        contact.step(&test.window, &hip);
    }
    assert!(test.window.is_blended(HERE));
    assert_eq!(contact.output().state, ContactState::Touching);
    assert!(contact.output().displacement.length() > 0.1);
}
