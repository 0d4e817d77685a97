//! The product's own contact over a window that stores the whole field.

use hapterra_core::contact::{Contact, ContactSettings, ContactState};
use hapterra_core::terrain::{FieldSize, TILE_CELLS, Tile, TileKey, Window};

use crate::grid::Grid;
use crate::variant::{ContactResult, Haptics, Hip};

/// Tiles along the window's side: enough for [`crate::grid::MAX_SIDE`], so that no variant waits
/// for terrain.
pub const SIDE: usize = 128;

/// Allocates the tiles of a `D × D` window, and one for the next tile.
#[must_use]
pub fn buffers<const D: usize>() -> Vec<Tile> {
    vec![Tile::VACANT; D * D + 1]
}

/// Returns an empty window over `grid`, and the first free buffer.
///
/// # Panics
/// If there are fewer buffers than [`buffers`] allocates.
#[must_use]
pub fn empty<'t, const D: usize>(
    grid: &Grid,
    buffers: &'t mut [Tile],
) -> (Box<Window<'t, D>>, &'t mut Tile) {
    let mut buffers = buffers.iter_mut();
    let mut next = || buffers.next().expect("a buffer for every slot");
    let spare = next();
    let slots = std::array::from_fn(|_| std::array::from_fn(|_| next()));
    let mut window = Box::new(Window::new(slots));
    let size = FieldSize::new(grid.columns as i32, grid.rows as i32);
    window.reset(0, size, grid.top().floor() as i32 + 1);
    (window, spare)
}

/// Returns a window that stores all of `grid`.
///
/// # Panics
/// If there are fewer buffers than [`buffers`] allocates, or the field is too large.
#[must_use]
pub fn window<'t, const D: usize>(grid: &Grid, buffers: &'t mut [Tile]) -> Box<Window<'t, D>> {
    let (mut window, mut spare) = empty(grid, buffers);
    for row in 0..grid.rows.div_ceil(TILE_CELLS) {
        for col in 0..grid.columns.div_ceil(TILE_CELLS) {
            let key = TileKey::new(0, col as i32, row as i32);
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
/// If the tile lies west or south of the field.
pub fn fill(grid: &Grid, key: TileKey, tile: &mut Tile) {
    let [col, row] =
        [key.index.col, key.index.row].map(|n| usize::try_from(n).expect("in the field"));
    let height = |x: usize, y: usize| {
        let (x, y) = (col * TILE_CELLS + x, row * TILE_CELLS + y);
        if x > grid.columns || y > grid.rows {
            return f32::NAN;
        }
        grid.post(x, y)
    };
    tile.fill(key, 0, height).expect("base 0 is in range");
}

/// The product.
pub struct Product<'w, 't, const D: usize> {
    window: &'w Window<'t, D>,
    contact: Contact,
}

impl<'w, 't, const D: usize> Product<'w, 't, D> {
    /// Creates the contact on a stored field.
    #[must_use]
    pub fn new(window: &'w Window<'t, D>) -> Self {
        Self {
            window,
            contact: Contact::new(ContactSettings::AT_1_KHZ),
        }
    }
}

impl<const D: usize> Haptics for Product<'_, '_, D> {
    fn reset(&mut self) {
        self.contact = Contact::new(ContactSettings::AT_1_KHZ);
    }

    #[inline]
    fn tick(&mut self, hip: &Hip) -> ContactResult {
        let output = self.contact.step(self.window, &hip.grid);
        ContactResult {
            touching: output.state == ContactState::Touching,
            converged: output.converged,
            displacement: output.displacement.to_array(),
        }
    }

    /// For the oracle: the proxy itself, before any fade.
    fn results(&mut self, path: &[Hip]) -> Vec<ContactResult> {
        self.reset();
        let step = |hip: &Hip| {
            let output = self.contact.step(self.window, &hip.grid);
            let touching = output.state == ContactState::Touching;
            let displacement = if touching {
                hip.grid.to(&output.proxy)
            } else {
                output.displacement
            };
            ContactResult {
                touching,
                converged: output.converged,
                displacement: displacement.to_array(),
            }
        };
        path.iter().map(step).collect()
    }
}

/// The least work of a tick: detect that the HIP has not moved, and return the last result. Correct
/// only for a HIP at rest.
#[derive(Default)]
pub struct Copy {
    last: Option<(Hip, ContactResult)>,
}

impl Haptics for Copy {
    fn reset(&mut self) {
        self.last = None;
    }

    #[inline]
    fn tick(&mut self, hip: &Hip) -> ContactResult {
        match &self.last {
            Some((known, result)) if known.grid == hip.grid => *result,
            _ => {
                self.last = Some((*hip, ContactResult::touching([0.0, 0.0, 0.1])));
                ContactResult::FREE
            }
        }
    }
}
