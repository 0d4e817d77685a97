//! The whole tick, from encoder counts to currents, with each effect: all in turn, in one run.

use std::hint::black_box;

use super::arm::{Arm, Driven, NotMeasured, Way};
use super::effect::Effect;
use super::replay;
use super::row::Time;
use crate::clock::Stopwatch;
use crate::compare::Effort;
use crate::grid::Grid;
use crate::stats::{interleave, timing};

pub(super) fn measure(grid: &Grid, effort: Effort) -> Result<Vec<Time>, NotMeasured> {
    let arm = Arm::over(grid);
    let mut times = along(&arm, &arm.slide(effort.ticks)?, effort)?;
    times.extend(along(&arm, &arm.tap(effort.ticks)?, effort)?);
    Ok(times)
}

fn along(arm: &Arm<'_>, way: &Way, effort: Effort) -> Result<Vec<Time>, NotMeasured> {
    let mut tiles = Effect::ALL.map(|_| replay::tiles());
    let begun = Effect::ALL.iter().zip(&mut tiles);
    let begun = begun.map(|(effect, tiles)| Driven::begin(arm, effect.params(), way, tiles));
    let mut driven = begun.collect::<Result<Vec<_>, _>>()?;
    let times = interleave(driven.len(), effort.rounds, |index| {
        round(&mut driven[index], way)
    });
    driven.iter().try_for_each(Driven::is_armed)?;
    // The first has no effect.
    let rows = Effect::ALL.iter().zip(&times).map(|(effect, own)| {
        let (ns, ratio) = timing(own, &times[0]);
        Time {
            terrain: arm.grid.name.clone(),
            path: way.name,
            effect: effect.name(),
            ns,
            ratio,
        }
    });
    Ok(rows.collect())
}

/// Returns nanoseconds a tick over the ground, without the approach and the departure.
fn round(driven: &mut Driven<'_>, way: &Way) -> f64 {
    for place in &way.down {
        driven.tick(place);
    }
    let watch = Stopwatch::start();
    for place in &way.there {
        black_box(driven.tick(black_box(place)));
    }
    let elapsed = watch.elapsed();
    for place in way.down.iter().rev() {
        driven.tick(place);
    }
    elapsed.as_secs_f64() * 1e9 / way.there.len().max(1) as f64
}
