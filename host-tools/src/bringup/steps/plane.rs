//! A flat plane for the arm, without a terrain file.

use glam::{DVec3, Vec3};
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::phantom::{Calibration, to_terrain_frame};
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::terrain::FieldSize;
use hapterra_core::wire::status::Status;

use crate::calibrate::Arm;

/// Size of a cell, mm.
const CELL_MM: f32 = 8.0;
/// Cells along a side: half a metre, centred below the arm's zero pose.
const CELLS: i32 = 64;

/// Lowest stiffness that can be rendered, N/mm, and maximum force of the plane, N.
pub(super) const SOFT: SurfaceParams = SurfaceParams {
    stiffness_n_per_mm: 0.05,
    max_force_n: 0.5,
    ..SurfaceParams::PREMIUM
};

/// Returns a plane `below_mm` under the tip's present position.
pub(super) fn below_tip(record: &Calibration, status: &Status, below_mm: f32) -> Scene {
    let tip_mm = tip_mm(record, status) - Arm::of(record).tip_mm(DVec3::ZERO);
    let up_mm = to_terrain_frame(tip_mm.as_vec3()).z;
    let middle = CELLS / 2;
    Scene {
        // The epoch must differ from the last scene's.
        epoch: status.ticks.run | 1,
        level: 0,
        size: FieldSize::new(CELLS, CELLS),
        top: 1,
        fallback: None,
        cell_mm: CELL_MM,
        home: GridPoint::new(
            [middle, middle, 0],
            Vec3::Z * ((below_mm - up_mm) / CELL_MM),
        ),
        params: SOFT,
        source: Source::Encoders,
        hold_clock: false,
        materials: None,
    }
}

/// Returns the tip's position by the encoders, mm, device frame.
pub(super) fn tip_mm(record: &Calibration, status: &Status) -> DVec3 {
    Arm::of(record).tip_mm(status.health.angles_rad.as_dvec3())
}

/// Returns the position of the HIP over the plane, mm, terrain frame.
pub(super) fn hip_mm(sample: &TickRecord) -> DVec3 {
    let (cell, fraction) = (sample.hip.cell(), sample.hip.frac());
    (DVec3::from(cell.map(f64::from)) + fraction.as_dvec3()) * f64::from(CELL_MM)
}

/// Returns the depth of the HIP below the proxy, mm.
pub(super) fn depth_mm(sample: &TickRecord) -> f32 {
    let up = |point: GridPoint| point.cell()[2] as f32 + point.frac().z;
    (up(sample.proxy) - up(sample.hip)) * CELL_MM
}
