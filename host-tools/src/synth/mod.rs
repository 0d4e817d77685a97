//! Terrains made by formula, for trials and tests: any size, seeded, and bit for bit the same on
//! every machine.

mod format;
mod hash;
mod kinds;
mod room;
mod rows;
mod write;

pub use room::NoRoom;
pub use rows::{Grid, Interrupted};
pub use write::{WriteError, WriteFault, write};

use heightfield::{Raster, RasterError};

/// Shape of a terrain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// Mountains: eight octaves of smooth noise
    Fractal,
    /// A slope: twice as steep to the east as to the north, the same for every seed
    Plane,
    /// Sharp parallel ridges and valleys
    Ridge,
    /// A flat field with needles one sample thin
    Spikes,
    /// Flat blocks with cliffs between them
    Steps,
    /// Bowls with raised rims
    Crater,
}

/// A terrain without borders: a height for every column and row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Synth {
    kind: Kind,
    seed: u64,
    amplitude: f64,
}

impl Synth {
    /// Creates a terrain with heights from 0 to `amplitude` (a [`Kind::Plane`] rises by that much
    /// in 50 cells to the east and in 100 to the north). The caller chooses the unit.
    pub fn new(kind: Kind, seed: u64, amplitude: f64) -> Self {
        Self {
            kind,
            seed,
            amplitude,
        }
    }

    /// Returns the height at a sample; row 0 is the southernmost.
    ///
    /// It uses only additions, multiplications, divisions and square roots, which IEEE arithmetic
    /// rounds equally on every machine.
    pub fn height(&self, column: u32, row: u32) -> f32 {
        let (x, y) = (f64::from(column), f64::from(row));
        let height = match self.kind {
            Kind::Fractal => kinds::fractal(self.seed, x, y),
            Kind::Plane => (2.0 * x + y) / 100.0,
            Kind::Ridge => kinds::ridge(self.seed, x, y),
            Kind::Spikes => kinds::spikes(self.seed, column, row),
            Kind::Steps => kinds::steps(self.seed, column, row),
            Kind::Crater => kinds::crater(self.seed, column, row),
        };
        (height * self.amplitude) as f32
    }

    /// Returns the rise of a plane of `columns` × `rows` samples between its lowest and highest
    /// corners.
    pub fn rise(&self, columns: u32, rows: u32) -> f64 {
        f64::from(self.height(columns - 1, rows - 1)) - f64::from(self.height(0, 0))
    }

    /// Returns a raster of this terrain in memory, with cells of 1 m and heights in metres.
    ///
    /// # Errors
    /// When there are fewer than 2 × 2 samples or the amplitude is not finite.
    pub fn raster(&self, columns: u32, rows: u32) -> Result<Raster, RasterError> {
        Raster::from_fn(columns, rows, |column, row| self.height(column, row))
    }
}

impl Kind {
    /// Returns an amplitude that suits the shape, in cells.
    pub fn default_amplitude_cells(self) -> f64 {
        match self {
            Self::Fractal => 60.0,
            Self::Plane => 10.0,
            Self::Ridge => 16.0,
            Self::Spikes => 6.0,
            Self::Steps => 8.0,
            Self::Crater => 20.0,
        }
    }
}

#[cfg(test)]
mod tests;
