//! Which ruling of a patch has the point closest to the HIP.
//!
//! F(v), the squared distance to the ruling at v, is continuously differentiable. From the
//! first ruling F falls toward one end of the patch. A minimum lies between two rulings of which
//! F falls from the one and rises at the other, or is higher there: Newton steps from either,
//! or the middle, bring them together.
//!
//! Newton's method may pass a crest on its way and come down lower. So the rulings from the
//! first to the last are looked at in the end; where F is above its start there, the search
//! begins again with that ruling as the far one. Looks are taken at even angles: as a patch
//! twists, the height of a ruling's line over the HIP along its normal is a sine of the angle,
//! so a crest is about as wide as an angle, however narrow it is in v.

use super::on_ruling::Ruling;
use crate::contact::straight_path::StraightWay;
use crate::contact::surface::patch::Patch;
use crate::contact::tolerance::{DOUBTFUL_STEP, LEAST_STEP, RESOLUTION};
use crate::scalar::{larger, smaller};

/// Rulings looked at in one patch before a search ends with the best one, at most. None of ten
/// million random searches needed as many.
pub const MAX_EVALUATIONS: u32 = 40;
/// Of the angle from one ruling to another, parts of either half that are looked at for a crest.
const HALF: u8 = 4;

/// A patch with a HIP in its coordinates, and the rulings of it that have been looked at.
pub(super) struct Rulings<'p> {
    pub(super) patch: &'p Patch,
    pub(super) hip: (f32, f32),
    /// The number.
    pub(super) looked: u32,
    /// Their largest number.
    pub(super) most: u32,
}

/// The far side of a minimum.
enum Far {
    /// An end of the patch, not looked at yet.
    End(f32),
    /// A ruling at which F rises, or is higher than at the near one.
    Ruling(Ruling),
}

impl Far {
    const fn v(&self) -> f32 {
        match self {
            Self::End(v) => *v,
            Self::Ruling(ruling) => ruling.v,
        }
    }
}

impl Rulings<'_> {
    /// The closest ruling of those that are joined with the one at `v` by rulings no farther than
    /// it.
    pub(super) fn closest_to(&mut self, v: f32) -> Ruling {
        let first = self.look_at(v);
        let end = if first.slope < 0.0 { 1.0 } else { 0.0 };
        let mut closest = self.minimum(first, Far::End(end));
        while !self.is_plainly_downhill(&first, &closest) {
            match self.crest(&first, &closest) {
                Some(crest) => closest = self.minimum(first, Far::Ruling(crest)),
                None => break,
            }
        }
        closest
    }

    /// Returns true if as many were looked at as there may be.
    pub(super) const fn is_spent(&self) -> bool {
        self.looked >= self.most
    }

    fn look_at(&mut self, v: f32) -> Ruling {
        self.looked += 1;
        Ruling::at(self.patch, self.hip, v)
    }

    /// The minimum between a ruling, from which F falls, and the far side.
    fn minimum(&mut self, mut near: Ruling, mut far: Far) -> Ruling {
        let toward = far.v() - near.v;
        let (mut newest, mut steps) = (near, [f32::INFINITY; 2]);
        while !self.is_settled(&newest) {
            let Some(v) = next(&near, &far, steps[1]).filter(|_| !self.is_spent()) else {
                return match far {
                    Far::Ruling(far) if far.gain_on(&near) > 0.0 => far,
                    _ => near,
                };
            };
            newest = self.look_at(v);
            steps = [(v - near.v).abs(), steps[0]];
            if newest.slope * toward < 0.0 && !self.is_farther(&newest, &near) {
                near = newest;
            } else {
                far = Far::Ruling(newest);
            }
        }
        newest
    }

    /// Returns true if F has its minimum on a ruling, within rounding.
    fn is_settled(&self, ruling: &Ruling) -> bool {
        let step = ruling.slope / ruling.curvature;
        ruling.curvature > 0.0
            && step.abs() < DOUBTFUL_STEP
            && (step.abs() < LEAST_STEP
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

    /// Returns true if the straight way between the closest points of two rulings is surely nowhere
    /// farther from the HIP than its start. A patch that is not twisted has no crest.
    fn is_plainly_downhill(&self, from: &Ruling, to: &Ruling) -> bool {
        let way = (to.u - from.u, to.v - from.v);
        self.patch.a == 0.0
            || way == (0.0, 0.0)
            || StraightWay::new(self.patch, self.hip, (from.u, from.v), way)
                .never_rises_above_start(0.0)
    }

    /// The first ruling on the way from one to another that is farther from the HIP than the
    /// first: in between is a crest.
    #[inline(never)]
    fn crest(&mut self, from: &Ruling, to: &Ruling) -> Option<Ruling> {
        let cos = |ruling: &Ruling| 1.0 / libm::sqrtf(1.0 + ruling.along * ruling.along);
        let (first, last) = (cos(from), cos(to));
        // Half way between two angles is the sum of their unit vectors.
        let sum = 2.0 + 2.0 * (1.0 + from.along * to.along) * first * last;
        let middle = (first + last) / libm::sqrtf(larger(sum, f32::EPSILON));
        let between = from.v + (to.v - from.v) * (last / (first + last));
        let halves = [
            (from.v, first, between, middle),
            (between, middle, to.v, last),
        ];
        (1..2 * HALF).find_map(|look| {
            let (start, first, end, last) = halves[usize::from(look > HALF)];
            let gone = f32::from(look - HALF * u8::from(look > HALF));
            let (before, after) = ((f32::from(HALF) - gone) * first, gone * last);
            let v = start + (end - start) * (after / (before + after));
            let ruling = (!self.is_spent()).then(|| self.look_at(v))?;
            self.is_farther(&ruling, from).then_some(ruling)
        })
    }
}

/// The next ruling between two to look at; `None` where there is none.
///
/// A Newton step that does not halve the last but one is not taken: the middle is.
fn next(near: &Ruling, far: &Far, before: f32) -> Option<f32> {
    let room = far.v() - near.v;
    if room.abs() < RESOLUTION {
        return None;
    }
    let newton = |ruling: &Ruling| match ruling.curvature > 0.0 {
        true => -ruling.slope / ruling.curvature,
        false => f32::INFINITY,
    };
    let step = newton(near);
    if step.abs() < smaller(room.abs(), 0.5 * before) {
        return Some(near.v + step);
    }
    let far = match far {
        Far::End(end) => return Some(*end),
        Far::Ruling(far) => far,
    };
    let middle = near.v + 0.5 * room;
    let back = newton(far);
    let v = far.v + back;
    let is_between = (v - near.v) * (far.v - v) > 0.0 && back.abs() < 0.5 * before;
    let v = if is_between { v } else { middle };
    (v != near.v && v != far.v).then_some(v)
}
