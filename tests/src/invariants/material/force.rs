//! The force of an active material, by docs/explanation/effects.md, in f64.

use glam::DVec3;
use hapterra_core::grid::GridPoint;

use super::active_material::ActiveMaterial;

/// Rounding, as a fraction of a force.
const ROUNDING: f64 = 1e-5;
/// Forces below this, N, count as zero.
const MIN_N: f64 = 1e-12;

/// Conditions of a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickConditions<'p> {
    /// Vector from the HIP to the proxy, cells.
    pub(super) displacement: DVec3,
    /// Its error bound, cells.
    pub(super) allowed: f64,
    /// The proxy, for textures.
    pub(super) proxy: &'p GridPoint,
    /// The HIP's velocity, mm/s.
    pub(super) velocity_mm_s: DVec3,
    /// The scene's largest force, N.
    pub(super) max_n: f64,
    /// Millimetres a cell.
    pub(super) cell_mm: f64,
}

/// An expected force and its error bound.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExpectedForce {
    /// The force.
    pub(super) force_n: DVec3,
    /// Its error bound, N.
    pub(super) allowed_n: f64,
}

impl TickConditions<'_> {
    /// Returns the force without shading and edge fade.
    pub(super) fn force(&self, material: &ActiveMaterial) -> ExpectedForce {
        let (mut stretch, mut allowed) = (
            self.displacement,
            self.allowed + ROUNDING * self.displacement.length(),
        );
        if self.displacement.length() > MIN_N
            && let Some((oracle, share)) = material.texture()
        {
            let added = oracle.adds(self.displacement, self.proxy, share);
            stretch += added.expected * share;
            // The relief turns with the displacement, and at most doubles the slope.
            allowed += added.allowed + 2.0 * self.allowed;
        }
        let newtons = material.stiffness() * self.cell_mm;
        let spring = shortened(stretch * newtons, self.max_n);
        let uncertainty = material.stiffness_uncertainty() * self.cell_mm * stretch.length();
        let allowed = 2.0 * allowed * newtons + uncertainty;
        self.damped(material, spring, allowed)
    }

    /// Returns the spring's force, damped along its direction.
    fn damped(&self, material: &ActiveMaterial, spring: DVec3, allowed: f64) -> ExpectedForce {
        let (size, damping) = (spring.length(), 1e-3 * material.damping());
        let fast_mm_s = self.velocity_mm_s.length();
        let uncertainty = (1e-3 * material.damping_uncertainty() * fast_mm_s).min(size);
        let rounding = allowed + ROUNDING * size + uncertainty + MIN_N;
        if damping == 0.0 || size <= MIN_N {
            let (force_n, allowed_n) = (spring, rounding.min(2.0 * self.max_n));
            return ExpectedForce { force_n, allowed_n };
        }
        let along = spring / size;
        let against = (damping * self.velocity_mm_s.dot(along)).clamp(-size, size);
        let force = shortened(spring - along * against, self.max_n);
        // An error of the spring's direction is also one of the speed along it, and of the force.
        let fast = damping * fast_mm_s;
        let turned = (rounding / size).min(2.0);
        let allowed = (rounding + 2.0 * fast * (turned + ROUNDING)).min(3.0 * (size + rounding));
        ExpectedForce {
            force_n: force,
            allowed_n: (rounding + allowed).min(2.0 * self.max_n),
        }
    }

    /// Returns the smallest and largest size of a force turned by shading; the smallest is zero if
    /// it fades.
    pub(super) fn sizes(&self, material: &ActiveMaterial, fades: bool) -> [f64; 2] {
        let depth = self.displacement.length();
        let off = self.allowed + ROUNDING * depth;
        let (mut min, mut max) = (depth - off, depth + off);
        if depth > MIN_N
            && let Some((oracle, share)) = material.texture()
        {
            let added = oracle.adds(self.displacement, self.proxy, share);
            let relief = oracle.relief(self.proxy, depth);
            let (rise, slope) = (share * relief.rise, share * relief.along);
            let allowed = added.allowed + off;
            min += rise - allowed;
            max = (depth + rise.max(if fades { relief.amplitude } else { rise })).hypot(slope)
                + off
                + allowed;
        }
        let newtons = material.stiffness() * self.cell_mm;
        let uncertainty = material.stiffness_uncertainty() * self.cell_mm;
        let spring = |stretch: f64, newtons: f64| (stretch.max(0.0) * newtons).min(self.max_n);
        let (min, max) = (
            spring(min, newtons - uncertainty),
            spring(max, newtons + uncertainty),
        );
        let damping = material.damping() + material.damping_uncertainty();
        // Damping of a fast HIP cancels nearly all force: a difference of two rounded values.
        let fast = 1e-3 * damping * self.velocity_mm_s.length() * (1.0 + ROUNDING);
        let min = if fades { 0.0 } else { (min - fast).max(0.0) };
        let max = (max + fast.min(max)).min(self.max_n);
        [
            min * (1.0 - ROUNDING) - MIN_N,
            max * (1.0 + ROUNDING) + MIN_N,
        ]
    }
}

/// Returns a vector, shortened to a length of `max` if it is longer.
fn shortened(vector: DVec3, max: f64) -> DVec3 {
    let length = vector.length();
    match length > max {
        true => vector * (max / length),
        false => vector,
    }
}
