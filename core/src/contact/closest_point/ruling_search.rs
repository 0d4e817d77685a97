//! Search for the ruling of a patch with the point closest to the HIP.
//!
//! F(v), the squared distance to the ruling at v, is continuously differentiable. From the first
//! ruling, F falls toward one end of the patch. A minimum lies between two rulings if F falls at
//! the first and, at the second, rises or is higher. Newton steps from either, or bisection, bring
//! them together.
//!
//! Newton's method may pass a crest and end lower beyond it. So the rulings between the first and
//! the last are checked at the end; if F exceeds its start at one of them, the search restarts with
//! that ruling as the far one. The checks are at even angles. As a patch twists, the height of a
//! ruling's line over the HIP along its normal is a sine of the angle. So a crest is about as wide
//! as an angle, even if it is narrow in v.

use super::on_ruling::Ruling;
use crate::contact::straight_path::StraightPath;
use crate::contact::surface::patch::Patch;
use crate::contact::tolerance::{DOUBTFUL_STEP, MIN_STEP, RESOLUTION};
use crate::scalar::{larger, smaller};

/// Maximum number of evaluated rulings in one patch; the search then ends with the best one. Ten
/// million random searches never reached it.
pub const MAX_EVALUATIONS: u32 = 40;
/// Number of parts of either half of the angle between two rulings that are checked for a crest.
const PARTS_PER_HALF: u8 = 4;

/// A patch with a HIP in its coordinates, and the count of its evaluated rulings.
pub(super) struct Rulings<'p> {
    pub(super) patch: &'p Patch,
    pub(super) hip: (f32, f32),
    /// Number of evaluated rulings.
    pub(super) evaluated: u32,
    /// Maximum number of evaluated rulings.
    pub(super) max_evaluations: u32,
}

/// The far side of a minimum.
enum FarSide {
    /// An end of the patch, not evaluated yet.
    End(f32),
    /// A ruling at which F rises, or is higher than at the near one.
    Ruling(Ruling),
}

impl FarSide {
    const fn v(&self) -> f32 {
        match self {
            Self::End(v) => *v,
            Self::Ruling(ruling) => ruling.v,
        }
    }
}

impl Rulings<'_> {
    /// Returns the closest ruling that can be reached from the one at `v` over rulings no farther
    /// from the HIP than it.
    pub(super) fn closest_to(&mut self, v: f32) -> Ruling {
        let first = self.evaluate(v);
        let end = if first.slope < 0.0 { 1.0 } else { 0.0 };
        let mut closest = self.minimum(first, FarSide::End(end));
        while !self.is_plainly_downhill(&first, &closest) {
            match self.crest(&first, &closest) {
                Some(crest) => closest = self.minimum(first, FarSide::Ruling(crest)),
                None => break,
            }
        }
        closest
    }

    /// Returns true if the maximum number of rulings is evaluated.
    pub(super) const fn is_spent(&self) -> bool {
        self.evaluated >= self.max_evaluations
    }

    fn evaluate(&mut self, v: f32) -> Ruling {
        self.evaluated += 1;
        Ruling::at(self.patch, self.hip, v)
    }

    /// Returns the minimum between a ruling, from which F falls, and the far side.
    fn minimum(&mut self, mut near: Ruling, mut far: FarSide) -> Ruling {
        let toward = far.v() - near.v;
        let (mut newest, mut steps) = (near, [f32::INFINITY; 2]);
        while !self.is_converged(&newest) {
            let Some(v) = next(&near, &far, steps[1]).filter(|_| !self.is_spent()) else {
                return match far {
                    FarSide::Ruling(far) if far.gain_on(&near) > 0.0 => far,
                    _ => near,
                };
            };
            newest = self.evaluate(v);
            steps = [(v - near.v).abs(), steps[0]];
            if newest.slope * toward < 0.0 && !self.is_farther(&newest, &near) {
                near = newest;
            } else {
                far = FarSide::Ruling(newest);
            }
        }
        newest
    }

    /// Returns true if F has its minimum on a ruling, within rounding.
    fn is_converged(&self, ruling: &Ruling) -> bool {
        let step = ruling.slope / ruling.curvature;
        ruling.curvature > 0.0
            && step.abs() < DOUBTFUL_STEP
            && (step.abs() < MIN_STEP
                || ruling.slope.abs() <= ruling.noise(self.patch, self.hip.0).slope)
    }

    /// Returns true if a ruling is surely farther from the HIP than another.
    fn is_farther(&self, ruling: &Ruling, other: &Ruling) -> bool {
        let more = other.gain_on(ruling);
        more > 0.0 && {
            let noise = |ruling: &Ruling| ruling.noise(self.patch, self.hip.0).f;
            more > noise(ruling) + noise(other)
        }
    }

    /// Returns true if the straight path between the closest points of two rulings is surely
    /// nowhere farther from the HIP than at its start. A patch without twist has no crest.
    fn is_plainly_downhill(&self, from: &Ruling, to: &Ruling) -> bool {
        let offset = (to.u - from.u, to.v - from.v);
        self.patch.a == 0.0
            || offset == (0.0, 0.0)
            || StraightPath::new(self.patch, self.hip, (from.u, from.v), offset)
                .never_rises_above_start(0.0)
    }

    /// Returns the first ruling between two that is farther from the HIP than `from`: a crest lies
    /// between.
    #[inline(never)]
    fn crest(&mut self, from: &Ruling, to: &Ruling) -> Option<Ruling> {
        let cos = |ruling: &Ruling| 1.0 / libm::sqrtf(1.0 + ruling.along * ruling.along);
        let (first, last) = (cos(from), cos(to));
        // The direction half way between two angles is the sum of their unit vectors.
        let sum = 2.0 + 2.0 * (1.0 + from.along * to.along) * first * last;
        let middle = (first + last) / libm::sqrtf(larger(sum, f32::EPSILON));
        let between = from.v + (to.v - from.v) * (last / (first + last));
        let halves = [
            (from.v, first, between, middle),
            (between, middle, to.v, last),
        ];
        (1..2 * PARTS_PER_HALF).find_map(|index| {
            let (start, first, end, last) = halves[usize::from(index > PARTS_PER_HALF)];
            let part = f32::from(index - PARTS_PER_HALF * u8::from(index > PARTS_PER_HALF));
            let (before, after) = ((f32::from(PARTS_PER_HALF) - part) * first, part * last);
            let v = start + (end - start) * (after / (before + after));
            let ruling = (!self.is_spent()).then(|| self.evaluate(v))?;
            self.is_farther(&ruling, from).then_some(ruling)
        })
    }
}

/// Returns the next ruling between two to evaluate; `None` if there is none.
///
/// A Newton step that is not less than half the last step but one is replaced by bisection.
fn next(near: &Ruling, far: &FarSide, before: f32) -> Option<f32> {
    let remaining = far.v() - near.v;
    if remaining.abs() < RESOLUTION {
        return None;
    }
    let newton = |ruling: &Ruling| match ruling.curvature > 0.0 {
        true => -ruling.slope / ruling.curvature,
        false => f32::INFINITY,
    };
    let step = newton(near);
    if step.abs() < smaller(remaining.abs(), 0.5 * before) {
        return Some(near.v + step);
    }
    let far = match far {
        FarSide::End(end) => return Some(*end),
        FarSide::Ruling(far) => far,
    };
    let middle = near.v + 0.5 * remaining;
    let back = newton(far);
    let v = far.v + back;
    let is_between = (v - near.v) * (far.v - v) > 0.0 && back.abs() < 0.5 * before;
    let v = if is_between { v } else { middle };
    (v != near.v && v != far.v).then_some(v)
}
