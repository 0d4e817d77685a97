//! Row of one variant on one ground and one path of the HIP.

use crate::compare::Label;
use crate::stats::{part, quantiles};
use crate::variant::ContactResult;

/// Motion of the HIP in a tick, cells.
pub const STEP: f64 = 0.01;
/// Depth of the HIP below the surface, cells.
pub const DEPTH: f64 = 0.1;
/// Tiles along the side of the product's window.
pub(super) const SIDE: usize = 8;

/// One variant on one ground.
#[derive(Clone, Debug)]
pub struct Row {
    /// Ground under the HIP.
    pub ground: &'static str,
    /// The variant.
    pub label: Label,
    /// Largest change of the displacement in a tick, cells.
    pub max_change: f64,
    /// 99th percentile of this change, cells.
    pub p99: f64,
    /// Share of the ticks without a force.
    pub missed: f64,
}

impl Row {
    /// Returns the row of successive ticks, in parts.
    pub(super) fn of(ground: &'static str, label: Label, parts: &[&[ContactResult]]) -> Self {
        let changes: Vec<f64> = parts
            .iter()
            .flat_map(|results| results.windows(2).map(|pair| pair[0].change(&pair[1])))
            .collect();
        let rendered = parts.iter().flat_map(|results| results.iter());
        let [p99, max_change] = quantiles(changes, [0.99, 1.0]);
        Self {
            ground,
            label,
            max_change,
            p99,
            missed: part(rendered.map(|result| !result.touching)),
        }
    }
}
