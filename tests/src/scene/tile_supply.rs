//! The product's window over a terrain: stored whole, or pulled tile by tile.

use hapterra_core::contact::{Contact, ContactOutput};
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::{
    FieldSize, IN_FLIGHT, RequestHint, TILE_CELLS, Tile, TileKey, TileRequester, Window,
};

use super::terrain::Terrain;

/// Tiles along the side of the usual window, and of the largest.
pub const SIDE: usize = 8;
const CELLS: i32 = TILE_CELLS as i32;

/// Reusable memory for a window.
pub struct Buffers(Vec<Tile>);

impl Buffers {
    /// Allocates windows of up to `side × side` tiles.
    #[must_use]
    pub fn new(side: usize) -> Self {
        Self(vec![Tile::VACANT; side * side + IN_FLIGHT])
    }

    /// Returns all tiles.
    pub(super) fn tiles(&mut self) -> &mut [Tile] {
        &mut self.0
    }
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new(SIDE)
    }
}

/// Supply of the tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Supply {
    /// All tiles are stored from the start.
    Preloaded,
    /// Tiles are requested, and arrive later.
    OnDemand {
        /// Ticks from the request to the tile.
        latency: u32,
    },
}

/// A window over a terrain that lies `shift` cells east, north and up.
pub struct SuppliedWindow<'t, 'g, const D: usize> {
    /// The window.
    pub window: Window<'t, D>,
    terrain: &'g Terrain,
    shift: [i32; 3],
    supply: Supply,
    requester: TileRequester<D>,
    spare: Vec<&'t mut Tile>,
    requested: Vec<(u32, TileKey)>,
    /// Tiles put into the window since this list was last emptied, in order.
    pub installed: Vec<TileKey>,
}

impl<'t, 'g, const D: usize> SuppliedWindow<'t, 'g, D> {
    /// Creates the window over a terrain.
    ///
    /// # Panics
    /// If a terrain to be stored whole is larger than the window, or the window than the buffers.
    pub fn new(
        buffers: &'t mut Buffers,
        terrain: &'g Terrain,
        shift: [i32; 3],
        supply: Supply,
    ) -> Self {
        let mut tiles = buffers.0.iter_mut();
        let mut next = || tiles.next().expect("there is one for every slot");
        let slots = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let mut window = Window::new(slots);
        let [columns, rows] = terrain.size;
        let size = FieldSize::new(columns + shift[0], rows + shift[1]);
        window.reset(0, size, terrain.top() + shift[2]);
        let mut requester = TileRequester::new();
        requester.reset(0, size);
        let mut supplied = Self {
            window,
            terrain,
            shift,
            supply,
            requester,
            spare: tiles.collect(),
            requested: Vec::new(),
            installed: Vec::new(),
        };
        if supply == Supply::Preloaded {
            supplied.hold_all();
        }
        supplied
    }

    fn hold_all(&mut self) {
        let tiles = |axis: usize| {
            let first = self.shift[axis] >> 5;
            first..=(self.shift[axis] + self.terrain.size[axis] - 1) >> 5
        };
        let (cols, rows) = (tiles(0), tiles(1));
        assert!(cols.clone().count() <= D && rows.clone().count() <= D);
        for row in rows {
            for col in cols.clone() {
                self.install(TileKey::new(0, col, row));
            }
        }
    }

    fn install(&mut self, key: TileKey) {
        let tile = self.spare.pop().expect("as many spares as requests");
        let [dx, dy, dz] = self.shift;
        let terrain = self.terrain;
        tile.fill(key, dz, |col, row| {
            terrain.post(
                key.index.col * CELLS + col as i32 - dx,
                key.index.row * CELLS + row as i32 - dy,
            )
        })
        .expect("the base is in range");
        self.spare.push(self.window.install(tile));
        self.installed.push(key);
    }

    /// Requests the tiles that the tick needs, and stores those that are due.
    pub fn supply(&mut self, now: u32, contact: &Contact, output: &ContactOutput, hip: &GridPoint) {
        let Supply::OnDemand { latency } = self.supply else {
            return;
        };
        let focus = RequestHint {
            missing_tile: output.missing_tile,
            proxy: output.proxy.column(),
            hip: hip.column(),
            velocity: [0.0; 2],
        };
        while let Some(key) = self.requester.next_request(now, &focus) {
            self.requested.push((now + latency, key));
        }
        let mut arrived = Vec::new();
        self.requested.retain(|(due, key)| {
            let here = *due <= now;
            if here {
                arrived.push(*key);
            }
            !here
        });
        for key in arrived {
            self.take(key, contact);
        }
    }

    /// As in the loop, a tile does not replace the one under the proxy.
    fn take(&mut self, key: TileKey, contact: &Contact) {
        let under_proxy = contact.patch().map(|cell| TileKey::containing(0, cell));
        let occupant = self.window.occupant(key);
        self.requester.received(key);
        if under_proxy.is_some() && under_proxy != Some(key) && occupant == under_proxy {
            return self.requester.lost(key);
        }
        self.install(key);
    }
}
