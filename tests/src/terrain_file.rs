//! Terrain files made by formula.

use std::path::Path;

use hapterra::synth::{Grid, Kind, Synth, write};

/// Writes a square terrain as `hapterra-lab synth KIND -o PATH --size SIDE --seed SEED` does.
///
/// # Panics
/// If it cannot be written.
pub fn terrain_file(path: &Path, kind: Kind, side: u32, seed: u64) {
    let grid = Grid {
        columns: side,
        rows: side,
        cell_m: 10.0,
    };
    let synth = Synth::new(kind, seed, kind.default_amplitude_cells() * grid.cell_m);
    write(path, &synth, &grid, &mut || true).expect("written");
}
