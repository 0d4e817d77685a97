//! A field of patches, stored whole by the product's own window.

use hapterra_core::Vec3;
use hapterra_core::contact::{Contact, ContactOutput, ContactSettings};
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::{FieldSize, TILE_CELLS, Tile, TileKey, Window};

/// Tiles along the side of the window: fields up to 256 × 256 patches.
const SIDE: usize = 8;

/// A proxy over a field defined by a function of the sample.
pub struct FieldContact {
    window: Window<'static, SIDE>,
    contact: Contact,
}

impl FieldContact {
    /// Creates `size × size` patches; NaN is no-data.
    ///
    /// # Panics
    /// If the field is larger than the window.
    #[must_use]
    pub fn new(size: i32, height: impl Fn(i32, i32) -> f32) -> Self {
        let tile = || -> &'static mut Tile { Box::leak(Box::new(Tile::VACANT)) };
        let mut window = Window::new(std::array::from_fn(|_| std::array::from_fn(|_| tile())));
        window.reset(0, FieldSize::new(size, size), 1 << 28);
        let cells = TILE_CELLS as i32;
        let tiles = (size + cells - 1) / cells;
        assert!(tiles <= SIDE as i32, "the field is larger than the window");
        for (col, row) in (0..tiles).flat_map(|c| (0..tiles).map(move |r| (c, r))) {
            let filled = tile();
            let sample = |c: usize, r: usize| (col * cells + c as i32, row * cells + r as i32);
            filled
                .fill(TileKey::new(0, col, row), 0, |c, r| {
                    let (x, y) = sample(c, r);
                    if x > size || y > size {
                        f32::NAN
                    } else {
                        height(x, y)
                    }
                })
                .expect("a base of zero is in range");
            let _ = window.install(filled);
        }
        Self {
            window,
            contact: Contact::new(ContactSettings::AT_1_KHZ),
        }
    }

    /// Moves the HIP, and returns the result when it has converged.
    ///
    /// # Panics
    /// If that needs more than 10,000 ticks.
    pub fn step(&mut self, hip: [f64; 3]) -> ContactOutput {
        let hip = point(hip);
        for _ in 0..10_000 {
            let output = *self.contact.step(&self.window, &hip);
            if output.converged {
                return output;
            }
        }
        panic!("{hip:?} never settles");
    }
}

/// Converts a position in cells to the core's form.
#[must_use]
pub fn point(p: [f64; 3]) -> GridPoint {
    let cell = p.map(|c| c.floor() as i32);
    let frac = [0, 1, 2].map(|i| (p[i] - p[i].floor()) as f32);
    GridPoint::new(cell, Vec3::from_array(frac))
}

/// Converts a position of the core to cells.
#[must_use]
pub fn position(p: &GridPoint) -> [f64; 3] {
    let (cell, frac) = (p.cell(), p.frac());
    [0, 1, 2].map(|i| f64::from(cell[i]) + f64::from(frac[i]))
}
