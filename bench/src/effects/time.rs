//! The whole tick, from encoder counts to currents, with each effect: all in turn, in one run.

use std::hint::black_box;

use super::arm::{Arm, Driven, MeasureError, TipPath};
use super::effect::Effect;
use super::replay;
use super::row::Time;
use crate::clock::Stopwatch;
use crate::compare::Effort;
use crate::grid::Grid;
use crate::stats::{interleave, timing};

pub(super) fn measure(grid: &Grid, effort: Effort) -> Result<Vec<Time>, MeasureError> {
    let arm = Arm::over(grid);
    let mut times = measure_path(&arm, &arm.slide(effort.ticks)?, effort)?;
    times.extend(measure_path(&arm, &arm.tap(effort.ticks)?, effort)?);
    Ok(times)
}

fn measure_path(arm: &Arm<'_>, path: &TipPath, effort: Effort) -> Result<Vec<Time>, MeasureError> {
    let mut tiles = Effect::ALL.map(|_| replay::tiles());
    let started = Effect::ALL.iter().zip(&mut tiles);
    let started = started.map(|(effect, tiles)| Driven::begin(arm, effect.params(), path, tiles));
    let mut driven = started.collect::<Result<Vec<_>, _>>()?;
    let times = interleave(driven.len(), effort.rounds, |index| {
        round(&mut driven[index], path)
    });
    driven.iter().try_for_each(Driven::is_armed)?;
    // The first has no effect.
    let rows = Effect::ALL.iter().zip(&times).map(|(effect, own)| {
        let (ns, ratio) = timing(own, &times[0]);
        Time {
            terrain: arm.grid.name.clone(),
            path: path.name,
            effect: effect.name(),
            ns,
            ratio,
        }
    });
    Ok(rows.collect())
}

/// Returns nanoseconds a tick over the ground, without the approach and the departure.
fn round(driven: &mut Driven<'_>, path: &TipPath) -> f64 {
    for place in &path.descent {
        driven.tick(place);
    }
    let stopwatch = Stopwatch::start();
    for place in &path.over_ground {
        black_box(driven.tick(black_box(place)));
    }
    let elapsed = stopwatch.elapsed();
    for place in path.descent.iter().rev() {
        driven.tick(place);
    }
    elapsed.as_secs_f64() * 1e9 / path.over_ground.len().max(1) as f64
}
