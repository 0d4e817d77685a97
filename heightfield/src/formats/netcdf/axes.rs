//! Cell size and orientation of a grid, from its coordinate variables.

use netcdf_reader::cf::{CfAxisType, identify_axis};
use netcdf_reader::{NcFile, NcSliceInfo, NcSliceInfoElem, NcVariable};

use super::attributes::text;
use crate::decoded::Decoded;
use crate::geometry::metres_in;
use crate::ground_map::GroundMap;
use crate::placed::GroundUnit;
use crate::{BadRaster, Certainty};

/// The dimensions of a grid.
pub(super) struct Names {
    x: String,
    y: String,
    /// The variable is stored column by column: (lon, lat).
    pub(super) x_first: bool,
}

/// Which dimension is which: the last two, y first, unless their coordinates say that
/// it is the other way round (CF conventions §4).
pub(super) fn names(file: &NcFile, heights: &NcVariable) -> Result<Names, BadRaster> {
    let [first, second] = heights
        .dimensions()
        .last_chunk()
        .ok_or_else(|| BadRaster::NotAHeightField("it has no two dimensions".into()))?;
    let role = |name: &str| file.variable(name).map(identify_axis).ok();
    let x_first =
        role(&first.name) == Some(CfAxisType::X) && role(&second.name) == Some(CfAxisType::Y);
    let (y, x) = if x_first {
        (second, first)
    } else {
        (first, second)
    };
    Ok(Names {
        x: x.name.clone(),
        y: y.name.clone(),
        x_first,
    })
}

/// Metres in a unit of the coordinates, where they are lengths that state it.
pub(super) fn metres(file: &NcFile, names: &Names) -> Option<f64> {
    metres_in(&text(file.variable(&names.x).ok()?, "units")?)
}

/// Cell size and orientation from the coordinate variables.
pub(super) fn place(file: &NcFile, names: &Names, decoded: &mut Decoded) {
    // A GMT grid with pixels for samples runs from north to south all the same:
    // only the coordinates tell the order of rows.
    let (Some(north), Some(east)) = (
        axis(file, &names.y, decoded.rows),
        axis(file, &names.x, decoded.columns),
    ) else {
        decoded
            .remarks
            .push("no coordinates: its first row is taken to be the northernmost".into());
        return;
    };
    for axis in [&north, &east] {
        if axis.uneven {
            decoded.remarks.push(format!(
                "coordinates {} are not evenly spaced: they are taken to be",
                axis.name
            ));
        }
    }
    let unit = match (east.unit.as_deref(), north.unit.as_deref()) {
        (Some(east), Some(_)) if east.to_lowercase().starts_with("degree") => {
            Some(GroundUnit::DEGREE)
        }
        (Some(east), Some(_)) => {
            metres_in(east).map(|metres| GroundUnit::length(metres, Certainty::Stated))
        }
        _ => None,
    };
    let map = GroundMap::from_centre([east.first, east.step, 0.0], [north.first, 0.0, north.step]);
    if let Some(map) = map {
        decoded.lay_out(map, unit);
    }
}

struct Axis {
    name: String,
    step: f64,
    /// Coordinate of the first sample's centre.
    first: f64,
    uneven: bool,
    unit: Option<String>,
}

/// Coordinates that are read at once.
const AT_ONCE: u64 = 1 << 16;
/// Of more coordinates than this only so many in a row, all over the axis, are looked at.
const ALL: u64 = 1 << 22;

fn axis(file: &NcFile, name: &str, samples: u32) -> Option<Axis> {
    let variable = file.variable(name).ok()?;
    let count = u64::from(samples);
    if variable.shape() != [count] {
        return None;
    }
    let (first, last) = (
        values(file, name, 0, 1)?[0],
        values(file, name, count - 1, 1)?[0],
    );
    let step = (last - first) / f64::from(samples.max(2) - 1);
    if !step.is_finite() || step == 0.0 {
        return None;
    }
    let apart = AT_ONCE * count.div_ceil(ALL);
    let mut uneven = false;
    for start in (0..count).step_by(usize::try_from(apart).ok()?) {
        // One more: the step from the last to the next.
        let some = values(file, name, start, (AT_ONCE + 1).min(count - start))?;
        let is_off = |pair: &[f64]| ((pair[1] - pair[0]) / step - 1.0).abs() > 0.01;
        uneven |= some.windows(2).any(is_off);
    }
    Some(Axis {
        name: name.to_owned(),
        step,
        first,
        uneven,
        unit: text(variable, "units"),
    })
}

/// So many coordinates from a place of an axis on, which is no longer than it says.
fn values(file: &NcFile, name: &str, start: u64, count: u64) -> Option<Vec<f64>> {
    let selections = vec![NcSliceInfoElem::Slice {
        start,
        end: start + count,
        step: 1,
    }];
    let read = file.read_variable_slice_as_f64(name, &NcSliceInfo { selections });
    let (values, _) = read.ok()?.into_raw_vec_and_offset();
    (values.len() as u64 == count).then_some(values)
}
