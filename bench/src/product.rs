//! The product's own contact over a window that holds the whole field.

use hapterra_core::contact::{Contact, Pace, Rule, State};
use hapterra_core::terrain::{TILE_CELLS, Tile, TileKey, Window};

use crate::grid::Grid;
use crate::haptics::{Answer, Hand, Haptics};

/// Tiles along the window's side: enough for [`crate::grid::LARGEST_SIDE`], so
/// that no variant ever waits for terrain.
pub const SIDE: usize = 128;

/// Buffers for the tiles of a `D × D` window, and one to fill next.
#[must_use]
pub fn buffers<const D: usize>() -> Vec<Tile> {
    vec![Tile::VACANT; D * D + 1]
}

/// A window that holds all of `grid`.
///
/// # Panics
/// When there are fewer buffers than [`buffers`] makes, or the field is too
/// large.
#[must_use]
pub fn window<'t, const D: usize>(grid: &Grid, buffers: &'t mut [Tile]) -> Box<Window<'t, D>> {
    let mut buffers = buffers.iter_mut();
    let mut next = || buffers.next().expect("a buffer for every slot");
    let mut spare = next();
    let mut window = Box::new(Window::new(std::array::from_fn(|_| {
        std::array::from_fn(|_| next())
    })));
    let size = [grid.columns as i32, grid.rows as i32];
    window.reset(0, size, grid.top().floor() as i32 + 1);
    for row in 0..grid.rows.div_ceil(TILE_CELLS) {
        for col in 0..grid.columns.div_ceil(TILE_CELLS) {
            let key = TileKey {
                level: 0,
                col: col as i32,
                row: row as i32,
            };
            fill(grid, key, spare);
            spare = window.install(spare);
            assert!(spare.key().is_none(), "the field fits the window");
        }
    }
    window
}

/// Fills a tile of `grid`.
///
/// # Panics
/// When the tile lies west or south of the field.
pub fn fill(grid: &Grid, key: TileKey, tile: &mut Tile) {
    let [col, row] = [key.col, key.row].map(|n| usize::try_from(n).expect("in the field"));
    let height = |x: usize, y: usize| {
        let (x, y) = (col * TILE_CELLS + x, row * TILE_CELLS + y);
        if x > grid.columns || y > grid.rows {
            return f32::NAN;
        }
        grid.post(x, y)
    };
    tile.fill(key, 0, height).expect("base 0 is in range");
}

/// One of the product's rules.
pub struct Product<'w, 't, const D: usize> {
    window: &'w Window<'t, D>,
    contact: Contact,
    rule: Rule,
}

impl<'w, 't, const D: usize> Product<'w, 't, D> {
    /// The contact by `rule` on a held field.
    #[must_use]
    pub fn new(window: &'w Window<'t, D>, rule: Rule) -> Self {
        Self {
            window,
            contact: Contact::new(),
            rule,
        }
    }
}

impl<const D: usize> Haptics for Product<'_, '_, D> {
    fn forget(&mut self) {
        self.contact = Contact::new();
    }

    #[inline]
    fn tick(&mut self, hand: &Hand) -> Answer {
        let felt = self
            .contact
            .step(self.window, &hand.grid, self.rule, Pace::RealTime);
        Answer {
            touching: felt.state == State::Touching,
            settled: felt.settled,
            stretch: felt.stretch.to_array(),
        }
    }

    /// To be judged: the proxy itself, before any fading.
    fn answers(&mut self, path: &[Hand]) -> Vec<Answer> {
        self.forget();
        let feel = |hand: &Hand| {
            let felt = self
                .contact
                .step(self.window, &hand.grid, self.rule, Pace::RealTime);
            let touching = felt.state == State::Touching;
            let stretch = if touching {
                hand.grid.to(&felt.proxy)
            } else {
                felt.stretch
            };
            Answer {
                touching,
                settled: felt.settled,
                stretch: stretch.to_array(),
            }
        };
        path.iter().map(feel).collect()
    }
}

/// The least that a tick can do: see that the hand has not moved, and give the
/// last answer again. Right for a hand that rests and for nothing else.
#[derive(Default)]
pub struct Copy {
    last: Option<(Hand, Answer)>,
}

impl Haptics for Copy {
    fn forget(&mut self) {
        self.last = None;
    }

    #[inline]
    fn tick(&mut self, hand: &Hand) -> Answer {
        match &self.last {
            Some((known, answer)) if known.grid == hand.grid => *answer,
            _ => {
                self.last = Some((*hand, Answer::touching([0.0, 0.0, 0.1])));
                Answer::FREE
            }
        }
    }
}
