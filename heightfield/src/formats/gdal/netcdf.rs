//! What NetCDF's conventions (CF) say of heights and places, where GDAL leaves it to its callers.

use heightfield_gdal::{Band, Dataset};

use super::fault;
use crate::crs::Unit;
use crate::decoded::Decoded;
use crate::geometry::metres_in;
use crate::{BadRaster, ReferenceSystem};

/// What people call the variable with the heights.
pub(super) const HEIGHT_NAMES: &str = "z elevation elev topo topography height altitude dem relief \
                                       bedrock surface band1";

/// What a file says of its heights and axes.
pub(super) struct Conventions {
    /// The `standard_name` of the variable.
    name: String,
    /// Its `positive`.
    positive: String,
    /// Its `missing_value`.
    missing: Option<String>,
    /// Metres in a unit of the axes.
    axes_m: Option<f64>,
    /// Whether both latitudes and longitudes are axes.
    is_in_degrees: bool,
}

/// The name of the variable that the first band of a file without parts is of.
pub(super) fn variable(dataset: &Dataset) -> Option<String> {
    dataset.band(1).ok()?.metadata("NETCDF_VARNAME").ok()?
}

impl Conventions {
    /// What the attributes of a NetCDF variable say; nothing in a file of another format.
    pub(super) fn of(dataset: &Dataset, band: &Band<'_>) -> Result<Self, BadRaster> {
        let is_netcdf = dataset.driver() == "netCDF";
        let of_band = |name: &str| match is_netcdf {
            true => band.metadata(name).map_err(fault),
            false => Ok(None),
        };
        let of_axis = |name: &str| match is_netcdf {
            true => dataset.metadata_items(name),
            false => Vec::new(),
        };
        let units = of_axis("#units");
        let is_in = |unit: &str| units.iter().any(|(_, own)| own.starts_with(unit));
        let lengths = of_axis("#standard_name")
            .into_iter()
            .filter_map(|(axis, name)| {
                let unit = units.iter().find(|(own, _)| *own == axis)?;
                (name == "projection_x_coordinate").then(|| metres_in(&unit.1))?
            });
        let axes_m = lengths.into_iter().next();
        Ok(Self {
            name: of_band("standard_name")?.unwrap_or_default(),
            positive: of_band("positive")?.unwrap_or_default().to_lowercase(),
            missing: of_band("missing_value")?,
            axes_m,
            is_in_degrees: is_in("degrees_north") && is_in("degrees_east"),
        })
    }

    /// Where the samples lie: by axes in the unit of the reference system, and not with latitudes
    /// for longitudes.
    pub(super) fn placed(
        &self,
        map: Option<[f64; 6]>,
        system: Option<&ReferenceSystem>,
    ) -> Option<[f64; 6]> {
        let map = map?;
        if self.is_in_degrees && system.is_none() {
            // GDAL takes a variable's last dimension for longitude, and finds no system where it
            // is not.
            let [x, x_column, x_row, y, y_column, y_row] = map;
            return Some([y, y_column, y_row, x, x_column, x_row]);
        }
        let of_system = match system.map(ReferenceSystem::unit) {
            Some(Unit::Length(Some(metres))) => metres,
            _ => return Some(map),
        };
        let times = self.axes_m.map_or(1.0, |metres| metres / of_system);
        Some(map.map(|number| number * times))
    }

    /// Turns depths into heights, and says what is left out.
    pub(super) fn describe(&self, decoded: &mut Decoded) {
        let is_depth = self.name == "depth" || self.name.contains("floor_depth");
        match self.positive.as_str() {
            "down" => decoded.turn_depths_into_heights("positive is down"),
            "up" if is_depth => decoded.remarks.push(format!(
                "its standard_name {} is a depth, and its attribute positive says up: heights are \
                 felt as they are",
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
        let felt: Vec<_> = (numbers.filter(|value| decoded.no_data != Some(*value)))
            .filter(|value| !value.is_nan())
            .map(|value| value.to_string())
            .collect();
        if !felt.is_empty() {
            decoded.remarks.push(format!(
                "its missing_value {} is felt as a height: GDAL knows one no-data value (--no-data)",
                felt.join(", ")
            ));
        }
    }
}
