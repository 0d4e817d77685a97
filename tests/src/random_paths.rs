//! Random trajectories that wander about a surface.

use hapterra::terrain::Terrain;

use crate::random::Random;

/// Returns a random path over a terrain in millimetres, mostly near the surface: pressing, sliding,
/// jumping, lifting, holding still. It starts above everything.
#[must_use]
pub fn wander(terrain: &Terrain<'_>, seed: u64, rows: usize, margin_cells: f64) -> Vec<[f64; 3]> {
    let cell = terrain.scale().cell_mm();
    let size = terrain.size_mm();
    let mut random = Random::new(seed);
    let start = [0.5 * size[0], 0.5 * size[1]];
    let mut at = [start[0], start[1], (f64::from(terrain.top()) + 2.0) * cell];
    let mut path = vec![at];
    while path.len() < rows {
        let stride = [0.01, 0.1, 0.5, 3.0][random.below(4)] * cell;
        let steps = 1 + random.below(12);
        let heading = random.between(0.0, std::f64::consts::TAU);
        let depth = random.between(-1.5, 0.6) * cell;
        for _ in 0..steps {
            at[0] += stride * heading.cos();
            at[1] += stride * heading.sin();
            for axis in 0..2 {
                let margin = margin_cells * cell;
                at[axis] = at[axis].clamp(margin, size[axis] - margin);
            }
            if let Some(ground) = terrain.height_mm(at[0], at[1]) {
                at[2] = ground + depth;
            }
            path.push(at);
        }
        if random.below(8) == 0 {
            path.push(at); // unmoved
        }
    }
    path.truncate(rows);
    path
}
