//! Cost and error of each effect of a surface.
//!
//! - [`Effect`]: the compared effects;
//! - `time`: the whole tick from encoder counts to currents, all effects in turn;
//! - `friction`, `shading`, `texture`, `damping`, `energy`, `combined`: one oracle each, in f64, by
//!   the formulas of docs/explanation/effects.md. No oracle calls the code that it checks;
//! - `effect_tick`, `replay`, `arm`: the record of a tick, and its sources: points in lock-step,
//!   and an armed arm.
//!
//! Cells are a millimetre in the hand here.

mod arm;
mod combined;
mod damping;
mod effect;
mod effect_tick;
mod energy;
mod foaw;
mod friction;
mod relief;
mod replay;
mod row;
mod shading;
mod texture;
mod time;
mod vector;

use crate::compare::Effort;
use crate::grid::Grid;

pub use arm::MeasureError;
pub use effect::Effect;
pub use row::{Error, Measured, Spread, Time};

/// Cells along the side of the rendered part of a terrain: the size of a device's window, and more
/// than the arm reaches.
pub const SIDE: usize = 256;
/// Fewest cells along the side of a terrain with room for the paths.
pub const MIN_SIDE: usize = 48;

/// Returns times and errors on the middle of one terrain.
///
/// # Errors
/// If the terrain is too small, or the arm cannot reach the surface.
pub fn measure(grid: &Grid, effort: Effort) -> Result<Measured, MeasureError> {
    let errors = errors(grid, effort)?;
    let times = time::measure(&grid.middle(SIDE), effort)?;
    Ok(Measured { times, errors })
}

/// Returns the errors alone: the same figures in every run.
///
/// # Errors
/// If the terrain is too small, or the arm cannot reach the surface.
pub fn errors(grid: &Grid, effort: Effort) -> Result<Vec<Error>, MeasureError> {
    let size = [grid.columns, grid.rows];
    if size.iter().any(|side| *side < MIN_SIDE) {
        let [columns, rows] = size;
        let has = format!("{columns} × {rows} cells; the paths need {MIN_SIDE} in each direction");
        return Err(MeasureError(has));
    }
    let grid = &grid.middle(SIDE);
    let mut errors = friction::measure(grid, effort);
    errors.extend(shading::measure(grid, effort));
    errors.extend(texture::measure(grid, effort));
    errors.extend(damping::measure(grid, effort)?);
    errors.extend(energy::measure(grid)?);
    errors.extend(combined::measure(grid, effort)?);
    Ok(errors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tick_states;

    #[test]
    fn terrain_too_small_or_too_high_is_refused() {
        let small = Grid::from_fn("small", [200, 47], |_, _| 0.0);
        let why = errors(&small, Effort::QUICK).expect_err("too small");
        assert!(why.to_string().starts_with("200 × 47 cells"), "{why}");
        let wall = |x: usize, _| if x > 90 { 900.0 } else { 0.0 };
        let high = Grid::from_fn("high", [150, 150], wall);
        assert!(measure(&high, Effort::QUICK).is_err());
    }

    #[test]
    fn errors_are_below_their_documented_bounds() {
        let errors = errors(&tick_states::terrain(), Effort::QUICK).expect("in reach");
        assert!(errors.iter().all(|error| error.compared > 0));
        let is_above = |error: &&Error| error.bound.is_some_and(|max| error.spread.worst > max);
        let wrong: Vec<_> = errors.iter().filter(is_above).collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
        let compared = |effect: &Effect| errors.iter().any(|error| error.effect == effect.name());
        let all = &Effect::ALL[1..];
        assert!(all.iter().all(compared));
    }
}
