//! Which ruling of a patch has the point closest to the HIP.
//!
//! F(v), the squared distance to the ruling at v, is continuously differentiable.
//! A zero of F′ is found by Newton steps inside a shrinking bracket. Each point
//! accepted is no farther from the HIP than the one before, so the search goes
//! downhill from where it begins and cannot jump into a worse basin.

use super::on_ruling::Ruling;
use crate::contact::surface::patch::Patch;
use crate::contact::tolerance::{DOUBTFUL_STEP, LEAST_STEP, RESOLUTION};

/// Rulings looked at, at most. Reached only on patches steeper than about 10⁶; the
/// best point so far is then the answer.
pub const MAX_EVALUATIONS: u32 = 32;

/// Steps downhill after which the end of the patch is tried, where halving the
/// way to it would take as many as a place has bits.
const DOWNHILL: u32 = 2;
/// Newton steps taken at once where single ones gain little; each time again so
/// many times as many.
const STRIDE: f32 = 8.0;

/// A search under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct RulingSearch {
    /// The closest ruling so far.
    pub(super) best: Ruling,
    pub(super) evaluations: u32,
    /// How far the side of `best` reaches on which a minimum lies.
    wall: f32,
    /// Whether the wall is an end of the patch not yet evaluated.
    wall_is_end: bool,
    /// Newton steps in a row that did not halve the slope.
    lazy: u32,
    /// Newton steps to take at once next.
    stride: f32,
    /// Steps that led on downhill, without a turn.
    downhill: u32,
    /// Newton's step back from the wall, where that has not just been tried; not
    /// a number otherwise.
    back: f32,
}

impl RulingSearch {
    /// A search downhill from the ruling at `v`, for a HIP at `hip` in patch
    /// coordinates.
    pub(super) fn from(patch: &Patch, hip: (f32, f32), v: f32) -> Self {
        let best = Ruling::at(patch, hip, v);
        Self {
            best,
            evaluations: 1,
            wall: if best.slope < 0.0 { 1.0 } else { 0.0 },
            wall_is_end: true,
            lazy: 0,
            stride: STRIDE,
            downhill: 0,
            back: f32::NAN,
        }
    }

    /// Which ruling to look at next; `None` when the best one is as good as it
    /// gets.
    pub(super) fn next(&self, patch: &Patch, hip: (f32, f32)) -> Option<f32> {
        let best = &self.best;
        let room = self.wall - best.v;
        if room.abs() < RESOLUTION || self.evaluations >= MAX_EVALUATIONS {
            return None; // at a wall, most often an end of the patch
        }
        if best.curvature > 0.0 {
            let step = -best.slope / best.curvature;
            if step.abs() < DOUBTFUL_STEP {
                let noise = best.noise(patch, hip.0).slope;
                if best.slope.abs() <= noise || step.abs() < LEAST_STEP {
                    return None;
                }
            }
            let inside = step.abs() < room.abs();
            if inside && self.lazy < 2 {
                return Some(best.v + step);
            }
            if !inside && self.wall_is_end {
                return Some(self.wall);
            }
            // Not to the middle, which may lie beyond a hill.
            let stride = self.stride * step;
            if self.wall_is_end && stride.abs() < 0.5 * room.abs() {
                return Some(best.v + stride);
            }
        }
        if self.wall_is_end && self.downhill >= DOWNHILL {
            return Some(self.wall);
        }
        // Where the eliminated variable reaches its limit F bends sharply, and
        // only the far side knows how much.
        let (behind, before) = (self.back - best.v, self.wall - self.back);
        if behind * before > 0.0 && before.abs() <= behind.abs() {
            return Some(self.back);
        }
        let middle = best.v + 0.5 * room;
        (middle != best.v && middle != self.wall).then_some(middle)
    }

    /// Looks at the ruling at `v`: takes it as the best one if it is no farther
    /// from the HIP, else as the new wall.
    pub(super) fn look_at(&mut self, patch: &Patch, hip: (f32, f32), v: f32) {
        let trial = Ruling::at(patch, hip, v);
        self.evaluations += 1;
        if !self.is_nearer(&trial, patch, hip) {
            self.wall = trial.v;
            self.wall_is_end = false;
            self.lazy = 2; // not that Newton step again
            let known = trial.curvature > 0.0 && self.back.is_nan();
            self.back = if known {
                trial.v - trial.slope / trial.curvature
            } else {
                f32::NAN
            };
            return;
        }
        self.count_progress(&trial);
        let turned = (trial.slope < 0.0) != (self.best.slope < 0.0);
        if turned {
            self.wall = self.best.v;
            self.wall_is_end = false;
        }
        self.best = trial;
    }

    /// Where rounding hides which is nearer, the slope still tells.
    fn is_nearer(&self, trial: &Ruling, patch: &Patch, hip: (f32, f32)) -> bool {
        let best = &self.best;
        let onward = trial.slope * best.slope > 0.0;
        let better = onward || trial.slope.abs() <= best.slope.abs();
        let gain = trial.gain_on(best);
        if (gain > 0.0) == better {
            return better;
        }
        let noise = 2.0 * trial.noise(patch, hip.0).f;
        gain > noise || (better && gain >= -noise)
    }

    /// Counts how fast the slope falls, for the steps to come.
    fn count_progress(&mut self, trial: &Ruling) {
        self.back = f32::NAN;
        self.downhill += 1;
        if trial.slope.abs() <= 0.5 * self.best.slope.abs() {
            (self.lazy, self.stride) = (0, STRIDE);
            return;
        }
        self.lazy += 1;
        if self.lazy > 2 {
            self.lazy = 0; // the middle has been tried, or a stride
            self.stride *= STRIDE;
        }
    }
}
