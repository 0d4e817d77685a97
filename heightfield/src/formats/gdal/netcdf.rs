//! NetCDF conventions (CF) for heights and places that GDAL does not apply itself.

use std::path::Path;

use heightfield_gdal::{Axis, Band, Dataset, Library};

use super::fault;
use crate::crs::Unit;
use crate::decoded::Decoded;
use crate::geometry::metres_in;
use crate::{RasterError, ReferenceSystem};

/// Usual names of the variable with the heights.
pub(super) const HEIGHT_NAMES: &str = "z elevation elev topo topography height altitude dem relief \
                                       bedrock surface band1";

/// Metadata of a file about its heights and axes.
#[derive(Default)]
pub(super) struct Conventions {
    /// The `standard_name` of the variable.
    name: String,
    /// The `positive` of the variable.
    positive: String,
    /// The `missing_value` of the variable.
    missing: Option<String>,
    /// Metres in a unit of the axes.
    axes_m: Option<f64>,
    /// True if a row of the raster runs from north to south.
    pub(super) is_turned: bool,
}

/// Returns the variable of the first band, for a file without parts.
pub(super) fn variable(dataset: &Dataset) -> Option<String> {
    dataset.band(1).ok()?.metadata("NETCDF_VARNAME").ok()?
}

impl Conventions {
    /// Reads a NetCDF variable's attributes; empty for a file of another format.
    pub(super) fn of(
        library: &Library,
        path: &Path,
        dataset: &Dataset,
        band: &Band<'_>,
    ) -> Result<Self, RasterError> {
        let mut found = Self::default();
        if dataset.driver() != "netCDF" {
            return Ok(found);
        }
        let text = |name: &str| band.metadata(name).map_err(fault);
        found.name = text("standard_name")?.unwrap_or_default();
        found.positive = text("positive")?.unwrap_or_default().to_lowercase();
        found.missing = text("missing_value")?;
        if let Some(variable) = text("NETCDF_VARNAME")? {
            found.is_turned = library.last_axis(path, &variable) == Axis::Y;
        }
        let units = dataset.metadata_items("#units");
        let of_axes = dataset.metadata_items("#standard_name");
        let x = of_axes
            .iter()
            .find(|(_, name)| name == "projection_x_coordinate");
        let unit = x.and_then(|(axis, _)| units.iter().find(|(own, _)| own == axis));
        found.axes_m = unit.and_then(|(_, unit)| metres_in(unit));
        Ok(found)
    }

    /// Returns the place of the samples, from axes in the unit of the reference system.
    pub(super) fn placed(
        &self,
        map: Option<[f64; 6]>,
        system: Option<&ReferenceSystem>,
    ) -> Option<[f64; 6]> {
        let [x, x_column, x_row, y, y_column, y_row] = map?;
        let map = match self.is_turned {
            true => [y, y_row, y_column, x, x_row, x_column],
            false => [x, x_column, x_row, y, y_column, y_row],
        };
        let times = match (system.map(ReferenceSystem::unit), self.axes_m) {
            (Some(Unit::Length(Some(of_system))), Some(of_axes)) => of_axes / of_system,
            _ => 1.0,
        };
        Some(map.map(|number| number * times))
    }

    /// Turns depths into heights, and adds remarks on ignored metadata.
    pub(super) fn describe(&self, decoded: &mut Decoded) {
        let is_depth = self.name == "depth" || self.name.contains("floor_depth");
        match self.positive.as_str() {
            "down" => decoded.turn_depths_into_heights("positive is down"),
            "up" if is_depth => decoded.remarks.push(format!(
                "its standard_name {} is a depth, and its attribute positive is up: heights are \
                 rendered as they are",
                self.name
            )),
            _ if is_depth => decoded.turn_depths_into_heights(&self.name),
            _ => {}
        }
        let Some(missing) = &self.missing else {
            return;
        };
        let values = missing.trim_matches(['{', '}']).split(',');
        let numbers = values.filter_map(|value| value.trim().parse::<f64>().ok());
        let heights: Vec<_> = (numbers.filter(|value| decoded.no_data != Some(*value)))
            .filter(|value| !value.is_nan())
            .map(|value| value.to_string())
            .collect();
        if !heights.is_empty() {
            decoded.remarks.push(format!(
                "its missing_value {} is read as a height: GDAL supports one no-data value (--input no-data=VALUE)",
                heights.join(", ")
            ));
        }
    }
}
