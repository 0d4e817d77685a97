//! The paper's algorithm as published (§4.3), as simply as possible: Newton's method in two
//! variables, the bounded point over edges and vertices, averaged normals, the candidate patch by
//! the lowest height of the whole segment.
//!
//! `hapterra-lab replay --contact paper` renders it, and the speed tables compare with it ("×
//! plain"). No device implements it. Two properties are the paper's own: the first candidate may
//! not be the first patch hit, and a fast HIP passes through thin terrain.

mod line;
mod real;

use num_traits::clamp;

pub use line::Line;
pub use real::Real;

/// The heights of a field, cells.
pub trait Heights {
    /// Returns true if the patch exists.
    fn has(&self, cell: [i32; 2]) -> bool;

    /// Returns the corners of a patch that exists: south-west, south-east, north-west, north-east.
    fn corners(&self, cell: [i32; 2]) -> [f32; 4];
}

impl<H: Heights + ?Sized> Heights for &H {
    #[inline]
    fn has(&self, cell: [i32; 2]) -> bool {
        (**self).has(cell)
    }

    #[inline]
    fn corners(&self, cell: [i32; 2]) -> [f32; 4] {
        (**self).corners(cell)
    }
}

/// Start of Newton's iteration in the patch with the last closest point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Always in the middle of the patch.
    Centre,
    /// At the last closest point.
    LastPoint,
}

/// Max patches in one tick.
const PATCHES: u32 = 1024;

/// eq. 1-5 on the unit grid: z = d + b·u + c·v + a·u·v
#[derive(Clone, Copy, Debug)]
struct Patch<R> {
    a: R,
    b: R,
    c: R,
    d: R,
}

/// A point in a patch.
#[derive(Clone, Copy, Debug)]
struct PatchPoint<R> {
    cell: [i32; 2],
    u: R,
    v: R,
    /// Vector from the HIP to this point.
    displacement: [R; 3],
    squared: R,
    /// Sides of the patch on whose border the point lies: -1, 0 or 1 east and north.
    border: [i32; 2],
}

/// The algorithm, in the arithmetic of `R`.
pub struct Paper<H, R> {
    heights: H,
    start: Start,
    iterations: u32,
    last_hip: Option<[R; 3]>,
    contact: Option<PatchPoint<R>>,
}

impl<H: Heights, R: Real> Paper<H, R> {
    /// Creates the algorithm with at most `iterations` Newton steps for each patch, from `start`.
    #[must_use]
    pub const fn new(heights: H, start: Start, iterations: u32) -> Self {
        Self {
            heights,
            start,
            iterations,
            last_hip: None,
            contact: None,
        }
    }

    /// Forgets the last tick.
    pub const fn forget(&mut self) {
        self.last_hip = None;
        self.contact = None;
    }

    /// Computes one tick: returns the displacement from the HIP to the proxy in contact, cells. The
    /// HIP is relative to the origin.
    #[inline]
    pub fn step(&mut self, hip: [R; 3]) -> Option<[R; 3]> {
        match self.last_hip.replace(hip) {
            Some(last) if last != hip => self.follow_hip(last, hip),
            _ => {}
        }
        self.contact.as_ref().map(|place| place.displacement)
    }

    #[inline]
    fn follow_hip(&mut self, last: [R; 3], hip: [R; 3]) {
        let middle = (R::HALF, R::HALF);
        let start = match (&self.contact, self.start) {
            (Some(place), Start::LastPoint) => Some((place.cell, (place.u, place.v))),
            (Some(place), Start::Centre) => Some((place.cell, middle)),
            (None, _) => self.candidate(&last, &hip).map(|cell| (cell, middle)),
        };
        self.contact = start
            .map(|(cell, start)| self.closest(cell, &hip, start))
            .filter(|place| self.is_inside(place));
    }

    #[inline]
    fn patch(&self, cell: [i32; 2]) -> Patch<R> {
        Patch::new(self.heights.corners(cell).map(R::of))
    }

    /// Finds the candidate patch: step 1 from free space.
    #[inline]
    fn candidate(&self, from: &[R; 3], to: &[R; 3]) -> Option<[i32; 2]> {
        let low = if from[2] < to[2] { from[2] } else { to[2] };
        Line::new([from[0], from[1]], [to[0], to[1]])
            .filter(|cell| self.heights.has(*cell))
            .find(|cell| {
                let [sw, se, nw, ne] = self.heights.corners(*cell);
                R::of(sw.max(se).max(nw.max(ne))) > low
            })
    }

    /// Finds the closest point in one patch: step 2.
    #[inline]
    fn closest_in(&self, cell: [i32; 2], hip: &[R; 3], start: (R, R)) -> PatchPoint<R> {
        let [x, y] = cell.map(R::from_whole);
        let local = [hip[0] - x, hip[1] - y, hip[2]];
        self.patch(cell)
            .closest(cell, &local, start, self.iterations)
    }

    /// Finds the closest point across patches: step 2.
    #[inline]
    fn closest(&self, cell: [i32; 2], hip: &[R; 3], start: (R, R)) -> PatchPoint<R> {
        let mut here = self.closest_in(cell, hip, start);
        let middle = (R::HALF, R::HALF);
        for _ in 0..PATCHES {
            if here.border == [0, 0] {
                break;
            }
            let mut best = here;
            for cell in around(&here).filter(|cell| self.heights.has(*cell)) {
                let there = self.closest_in(cell, hip, middle);
                if there.squared < best.squared {
                    best = there;
                }
            }
            if best.cell == here.cell {
                break;
            }
            here = best;
        }
        here
    }

    /// Returns true if (LCP − HIP)·n > 0, with n averaged at edges and vertices: step 3.
    #[inline]
    fn is_inside(&self, place: &PatchPoint<R>) -> bool {
        let normal = self.patch(place.cell).normal(place.u, place.v);
        if place.border == [0, 0] {
            return dot(&place.displacement, &normal) > R::zero();
        }
        let mut sum = unit(normal);
        for cell in around(place).filter(|cell| self.heights.has(*cell)) {
            let across = |x: R, i: usize| {
                if cell[i] == place.cell[i] {
                    x
                } else {
                    R::one() - x
                }
            };
            let (u, v) = (across(place.u, 0), across(place.v, 1));
            let normal = unit(self.patch(cell).normal(u, v));
            sum = [0, 1, 2].map(|i| sum[i] + normal[i]);
        }
        dot(&place.displacement, &sum) > R::zero()
    }
}

/// Returns the one patch that shares the edge, or the three that share the vertex.
#[inline]
fn around<R: Real>(place: &PatchPoint<R>) -> impl Iterator<Item = [i32; 2]> + use<R> {
    let ([x, y], [east, north]) = (place.cell, place.border);
    let corner = east != 0 && north != 0;
    let across = [
        (east != 0).then_some([x + east, y]),
        (north != 0).then_some([x, y + north]),
        corner.then_some([x + east, y + north]),
    ];
    across.into_iter().flatten()
}

impl<R: Real> Patch<R> {
    #[inline]
    fn new([sw, se, nw, ne]: [R; 4]) -> Self {
        Self {
            a: ne - se - nw + sw,
            b: se - sw,
            c: nw - sw,
            d: sw,
        }
    }

    #[inline]
    fn height(&self, u: R, v: R) -> R {
        u * v * self.a + u * self.b + v * self.c + self.d
    }

    #[inline]
    fn normal(&self, u: R, v: R) -> [R; 3] {
        [-(self.b + self.a * v), -(self.c + self.a * u), R::one()]
    }

    /// Returns Newton's point, or the bounded one if that is outside the patch.
    #[inline]
    fn closest(
        &self,
        cell: [i32; 2],
        hip: &[R; 3],
        start: (R, R),
        iterations: u32,
    ) -> PatchPoint<R> {
        let inside = |x: R| x >= R::zero() && x <= R::one();
        match self.newton(hip, start, iterations) {
            Some((u, v)) if inside(u) && inside(v) => self.place(cell, hip, u, v),
            _ => self.bounded(cell, hip),
        }
    }

    /// Iterates eq. 8-11. Returns `None` if the Jacobian is singular.
    #[inline]
    fn newton(&self, [p, q, r]: &[R; 3], start: (R, R), iterations: u32) -> Option<(R, R)> {
        let (mut u, mut v) = start;
        for _ in 0..iterations {
            let (zu, zv) = (self.b + self.a * v, self.c + self.a * u);
            let lift = self.height(u, v) - *r;
            let (fu, fv) = (u - *p + lift * zu, v - *q + lift * zv);
            let (uu, vv) = (R::one() + zu * zu, R::one() + zv * zv);
            let uv = lift * self.a + zu * zv;
            let det = uu * vv - uv * uv;
            if det == R::zero() {
                return None;
            }
            let (du, dv) = ((fu * vv - fv * uv) / det, (fv * uu - fu * uv) / det);
            (u, v) = (u - du, v - dv);
            if du.abs() + dv.abs() < R::LAST_STEP {
                break;
            }
        }
        Some((u, v))
    }

    /// Returns the nearest point on the four edges, vertices included.
    #[inline]
    fn bounded(&self, cell: [i32; 2], hip: &[R; 3]) -> PatchPoint<R> {
        let [p, q, r] = *hip;
        let along_u = |v: R| {
            let (slope, start) = (self.b + self.a * v, self.d + self.c * v);
            let u = (p - (start - r) * slope) / (R::one() + slope * slope);
            self.place(cell, hip, clamp(u, R::zero(), R::one()), v)
        };
        let along_v = |u: R| {
            let (slope, start) = (self.c + self.a * u, self.d + self.b * u);
            let v = (q - (start - r) * slope) / (R::one() + slope * slope);
            self.place(cell, hip, u, clamp(v, R::zero(), R::one()))
        };
        let mut best = along_u(R::zero());
        for other in [along_u(R::one()), along_v(R::zero()), along_v(R::one())] {
            if other.squared < best.squared {
                best = other;
            }
        }
        best
    }

    #[inline]
    fn place(&self, cell: [i32; 2], hip: &[R; 3], u: R, v: R) -> PatchPoint<R> {
        let displacement = [u - hip[0], v - hip[1], self.height(u, v) - hip[2]];
        let side = |x: R| i32::from(x == R::one()) - i32::from(x == R::zero());
        PatchPoint {
            cell,
            u,
            v,
            displacement,
            squared: dot(&displacement, &displacement),
            border: [side(u), side(v)],
        }
    }
}

/// Returns the point that step 2 finds in the unit square from its middle, to compare the solver
/// alone.
#[inline]
pub fn newton<R: Real>(corners: [R; 4], hip: [R; 3], iterations: u32) -> (R, R) {
    let middle = (R::HALF, R::HALF);
    let place = Patch::new(corners).closest([0, 0], &hip, middle, iterations);
    (place.u, place.v)
}

#[inline]
fn dot<R: Real>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn unit<R: Real>(v: [R; 3]) -> [R; 3] {
    let length = dot(&v, &v).sqrt();
    v.map(|x| x / length)
}
