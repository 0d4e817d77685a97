//! Invariants of a single tick.

use hapterra_core::contact::ContactState;
use hapterra_core::grid::MAX_CELL;

use super::Invariant;
use super::observed_tick::{CELLS_MM, ObservedTick, PARAMS};
use super::oracle::{TickOracle, Verdict};
use super::surface::distance;

/// Tolerance of a force, as a fraction: the clamp stays eight units in the last place below its
/// limit.
const FORCE_ERROR: f64 = 2e-6;

impl TickOracle<'_> {
    pub(super) fn check_finite(&self, observed: &ObservedTick) -> Verdict {
        let output = &observed.output;
        let (cell, frac) = (output.proxy.cell(), output.proxy.frac());
        let valid = cell.iter().all(|c| c.abs() <= MAX_CELL)
            && frac.to_array().iter().all(|f| (0.0..1.0).contains(f));
        if !output.displacement.is_finite() || !valid {
            return self.fail(Invariant::Finite, format!("{output:?}"));
        }
        Ok(())
    }

    pub(super) fn check_work(&self, observed: &ObservedTick) -> Verdict {
        if observed.output.work > self.work {
            return self.fail(Invariant::Work, format!("{:?}", observed.output));
        }
        Ok(())
    }

    /// Checks that there is no force without contact, that a free proxy is at the HIP, and that the
    /// displacement of a contact is a fraction of the vector to the proxy.
    pub(super) fn check_consistent(&self, observed: &ObservedTick) -> Verdict {
        let output = &observed.output;
        let none = output.displacement.to_array() == [0.0; 3];
        let free_at_hip = !observed.is_free() || observed.proxy == observed.hip;
        let may_press = observed.is_touching() || output.state == ContactState::Releasing;
        let is_part = !observed.is_touching() || is_shortened(observed);
        if (!may_press && !none) || !free_at_hip || !is_part {
            return self.fail(Invariant::Consistent, format!("{observed:?}"));
        }
        Ok(())
    }

    /// Checks that the force is the spring's, limited by the clamp.
    pub(super) fn check_clamp(&self, observed: &ObservedTick) -> Verdict {
        let displacement = observed.output.displacement.as_dvec3().to_array();
        let max = f64::from(PARAMS.max_force_n);
        for (cell_mm, force) in CELLS_MM.iter().zip(observed.force_n) {
            let rate = f64::from(PARAMS.stiffness_n_per_mm) * f64::from(*cell_mm);
            let spring = displacement.map(|s| s * rate);
            let part = (max / length(spring)).min(1.0);
            let off = distance(force, spring.map(|f| f * part));
            // The length itself may be off by half a unit in the last place.
            let is_long = length(force) > max * (1.0 + 1e-7);
            let error = FORCE_ERROR * length(spring).min(max) + f64::from(f32::MIN_POSITIVE);
            let is_off = !(0.0..=error).contains(&off);
            if is_long || is_off {
                let detail = format!("{force:?} N at {cell_mm} mm a cell from {displacement:?}");
                return self.fail(Invariant::Clamp, detail);
            }
        }
        Ok(())
    }
}

fn length(v: [f64; 3]) -> f64 {
    distance(v, [0.0; 3])
}

/// Returns true if the displacement is the vector from the HIP to the proxy, times an edge fade in
/// `[0, 1]`.
fn is_shortened(observed: &ObservedTick) -> bool {
    let displacement = [0, 1, 2].map(|i| observed.proxy[i] - observed.hip[i]);
    let output = observed.output.displacement.as_dvec3().to_array();
    let whole = length(displacement);
    let part = if whole > 0.0 {
        (length(output) / whole).min(1.0)
    } else {
        0.0
    };
    distance(output, displacement.map(|c| c * part)) <= observed.allowed()
}
