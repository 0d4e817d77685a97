//! Oracle in f64 of proxies on the bilinear surface, which shares no code
//! with the product.

use hapterra::terrain::Terrain;
use hapterra_core::contact::ContactState;
use hapterra_core::scene::TickRecord;

use crate::dense_search::Oracle;
use crate::whole_field::position;

/// Largest distance of a proxy in contact from the surface, perpendicular to it, cells:
/// [`crate::invariants`]' bound and four units in the last place of a tile's largest
/// height above its base, in single precision.
pub const OFF_SURFACE: f64 = 2e-6 + 4.0 * 64.0 * f32::EPSILON as f64;

/// Returns the distance of a proxy in contact from the surface, cells.
///
/// # Errors
/// If it is above [`OFF_SURFACE`].
pub fn check(terrain: &Terrain<'_>, sample: &TickRecord) -> Result<f64, String> {
    if sample.state != ContactState::Touching {
        return Ok(0.0);
    }
    let off = off_surface(terrain, position(&sample.proxy));
    match off <= OFF_SURFACE {
        true => Ok(off),
        false => Err(format!(
            "a proxy is {off:.3e} cells off the surface: {sample:?}"
        )),
    }
}

fn off_surface(terrain: &Terrain<'_>, [x, y, z]: [f64; 3]) -> f64 {
    let (raster, scale) = (terrain.raster(), terrain.scale());
    let cells = scale.height_mm_per_unit() / scale.cell_mm();
    let height = |x: i64, y: i64| match (u32::try_from(x), u32::try_from(y)) {
        (Ok(x), Ok(y)) => raster.height(x, y) * cells,
        _ => f64::NAN,
    };
    let size = [raster.columns(), raster.rows()].map(|n| i64::from(n) - 1);
    let oracle = Oracle::new(size, &height);
    let Some(surface) = oracle.surface(x, y) else {
        return f64::INFINITY;
    };
    // Along the steeper side of an edge the surface is nearer to the proxy than vertically.
    let near = |dx: f64, dy: f64| {
        let there = oracle.surface(x + dx, y + dy);
        there.map_or(0.0, |there| ((there - surface) / 1e-3).abs())
    };
    let east = near(1e-3, 0.0).max(near(-1e-3, 0.0));
    let north = near(0.0, 1e-3).max(near(0.0, -1e-3));
    (z - surface).abs() / libm::sqrt(1.0 + east * east + north * north)
}
