//! Detects overviews that average heights with no-data values: if they were made before the values
//! were declared, they have pits or peaks along the rim of no-data, unlike the full image.

use crate::RasterError;
use crate::blocks::{BlockImage, BlockReader, Part, stored_parts};

/// Number of blocks of the coarsest overview that are checked.
const MAX_PARTS: usize = 16;
/// Max samples of the full image that are compared with one of an overview.
const MAX_COMPARED: u64 = 1 << 22;
/// Lossy compression may change stored values by this difference ...
const TOLERANCE: f64 = 1.0;
/// ... or by this share of the value.
const RELATIVE_TOLERANCE: f64 = 1e-3;

/// Compares the extremes of the coarsest overview with the full image around them, if a no-data
/// value is declared. Returns a remark if the overview is unreliable.
///
/// # Errors
/// A file at a URL that cannot be read at present.
pub(super) fn blended(
    blocks: &impl BlockReader,
    no_data: f64,
) -> Result<Option<String>, RasterError> {
    let images = blocks.images();
    let (Some(full), Some(coarsest)) = (images.first(), images.len().checked_sub(1)) else {
        return Ok(None);
    };
    if coarsest == 0 {
        return Ok(None);
    }
    for (value, place) in outermost(blocks, coarsest, no_data)? {
        let area_below = area_below(&images[coarsest], full, place);
        if u64::from(area_below.columns) * u64::from(area_below.rows) > MAX_COMPARED {
            continue;
        }
        let [lowest, highest] = range(blocks, 0, &area_below, no_data)?;
        let slack = (highest - lowest)
            .max(RELATIVE_TOLERANCE * lowest.abs().max(highest.abs()))
            .max(TOLERANCE);
        if lowest > highest {
            continue;
        }
        if value < lowest - slack || value > highest + slack {
            return Ok(Some(format!(
                "its overviews were made before its no-data value was declared, and mix it with heights ({value} where the full image has {lowest} to {highest}): they are not used; make them again: gdaladdo -clean FILE, then gdaladdo -r average FILE 2 4 8 16"
            )));
        }
    }
    Ok(None)
}

/// Returns the lowest and the highest value of an image, if towards the no-data value, with their
/// positions.
fn outermost(
    blocks: &impl BlockReader,
    image: usize,
    no_data: f64,
) -> Result<Vec<(f64, [u32; 2])>, RasterError> {
    let parts = stored_parts(&blocks.images()[image], |part| {
        blocks.is_stored(image, part)
    });
    let step = parts.len().div_ceil(MAX_PARTS).max(1);
    let mut lowest = (f64::INFINITY, [0; 2]);
    let mut highest = (f64::NEG_INFINITY, [0; 2]);
    for part in parts.iter().step_by(step) {
        for_each(blocks, image, part, no_data, |value, place| {
            if value < lowest.0 {
                lowest = (value, place);
            }
            if value > highest.0 {
                highest = (value, place);
            }
        })?;
    }
    let mut found = Vec::new();
    if lowest.0 <= highest.0 {
        found.extend((no_data < highest.0).then_some(lowest));
        found.extend((no_data > lowest.0).then_some(highest));
    }
    Ok(found)
}

/// Returns the part of the full image under a sample of an overview and its neighbours.
fn area_below(coarse: &BlockImage, full: &BlockImage, [column, row]: [u32; 2]) -> Part {
    let along = |at: u32, coarse: u32, full: u32| {
        let times = f64::from(full) / f64::from(coarse);
        let first = ((f64::from(at) - 1.0) * times).floor().max(0.0) as u32;
        let end = (((f64::from(at) + 2.0) * times).ceil() as u32).min(full);
        (first, end.saturating_sub(first))
    };
    let (column, columns) = along(column, coarse.columns, full.columns);
    let (row, rows) = along(row, coarse.rows, full.rows);
    Part {
        column,
        row,
        columns,
        rows,
    }
}

fn range(
    blocks: &impl BlockReader,
    image: usize,
    part: &Part,
    no_data: f64,
) -> Result<[f64; 2], RasterError> {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for_each(blocks, image, part, no_data, |value, _| {
        range = [range[0].min(value), range[1].max(value)];
    })?;
    Ok(range)
}

/// Visits the samples of a part that have data.
fn for_each(
    blocks: &impl BlockReader,
    image: usize,
    part: &Part,
    no_data: f64,
    mut visit: impl FnMut(f64, [u32; 2]),
) -> Result<(), RasterError> {
    let block = blocks.read(image, part)?;
    for index in 0..part.columns * part.rows {
        let value = block.stored(index as usize);
        if let Some(value) = value.filter(|value| *value != no_data && value.is_finite()) {
            let place = [
                part.column + index % part.columns,
                part.row + index / part.columns,
            ];
            visit(value, place);
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "blended_overviews_tests.rs"]
mod tests;
