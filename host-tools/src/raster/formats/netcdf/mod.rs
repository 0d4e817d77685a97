//! NetCDF grids, classic and NetCDF-4, as GMT and the climate conventions (COARDS,
//! CF) write them.

mod attributes;
mod axes;
mod filters;
mod grid_mapping;

use std::sync::Arc;

use netcdf_reader::masked::MaskParams;
use netcdf_reader::unpack::SignParams;
use netcdf_reader::{
    BytesStorage, DynStorage, FileStorage, NcFile, NcOpenOptions, NcReadable, NcType, NcVariable,
};

use super::height_name;
use crate::raster::decoded::{Decoded, sides};
use crate::raster::format::{Claim, Format, Parts, starts_with_any};
use crate::raster::geometry::metres_in;
use crate::raster::input::{Data, FileBytes};
use crate::raster::samples::{HoleMask, SampleValue, with_samples};
use crate::raster::{BadRaster, ReferenceSystem, SampleType, Samples};
use attributes::{number, text};

/// NetCDF 3 (three variants) and NetCDF-4, which is HDF5.
pub(super) const FORMAT: Format = Format {
    name: "NetCDF",
    begins: |head| {
        let signatures: [&[u8]; 4] = [b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF\r\n\x1a\n"];
        starts_with_any(head, &signatures)
    },
    extensions: &[("nc", Claim::Promises), ("grd", Claim::Suggests)],
    parts: Parts::Variables,
    decode: |input, options| decode(input, options.variable.as_deref()),
};

/// What people call the variable with the heights.
const HEIGHT_NAMES: &str = "z elevation elev topo topography height altitude dem relief bedrock \
                            surface band1";

/// Reads the grid's height variable.
fn decode(input: &FileBytes, asked: Option<&str>) -> Result<Decoded, BadRaster> {
    let options = NcOpenOptions {
        filter_registry: Some(filters::with_zstd()),
        ..NcOpenOptions::default()
    };
    let file = NcFile::from_storage_with_options(storage(input)?, options)
        .map_err(|error| fault(&error))?;
    let variables = file.variables().map_err(|error| fault(&error))?;
    let heights = choose(variables, asked)?;
    let mut size = size(heights)?;
    let sample = sample_type(heights)
        .ok_or_else(|| BadRaster::NotAHeightField(format!("{} is no number", heights.name())))?;
    input.check_holds(size.0, size.1, sample.bytes())?;
    let mut samples: Samples = with_samples!(sample.none(), none => {
        read_values(none, &file, heights)?.into()
    });
    if SignParams::from_variable(heights).is_some() {
        samples = of_the_other_sign(samples);
    }
    let axes = axes::names(&file, heights)?;
    if axes.x_first {
        samples = with_samples!(&samples, values => transposed(values, size.0).into());
        size = (size.1, size.0);
    }
    let format = format!(
        "NetCDF, variable {}, {}",
        heights.name(),
        samples.type_name()
    );
    let mut decoded = Decoded::new(format, size, samples);
    mark_missing(&mut decoded, heights);
    decoded.scale = number(heights, "scale_factor").unwrap_or(1.0);
    decoded.offset = number(heights, "add_offset").unwrap_or(0.0);
    decoded.metres_per_vertical_unit = text(heights, "units").and_then(|unit| metres_in(&unit));
    if text(heights, "positive").is_some_and(|way| way.eq_ignore_ascii_case("down")) {
        decoded.turn_depths_into_heights("positive = down");
    }
    reference_system(&file, heights, &axes, &mut decoded);
    axes::place(&file, &axes, &mut decoded);
    Ok(decoded)
}

/// The reference system of the grid mapping: by its text, else by its attributes.
fn reference_system(
    file: &NcFile,
    heights: &NcVariable,
    axes: &axes::Names,
    decoded: &mut Decoded,
) {
    let mapping = text(heights, "grid_mapping").and_then(|name| {
        // `crs: x y` maps those coordinates.
        let name = name.split([':', ' ']).next()?.to_owned();
        file.variable(&name).ok()
    });
    let Some(mapping) = mapping else {
        return;
    };
    let names = ["crs_wkt", "spatial_ref", "esri_pe_string"];
    let wkt = names.iter().find_map(|name| text(mapping, name));
    let (system, vertical) = wkt.map_or((None, None), |wkt| ReferenceSystem::from_wkt(&wkt));
    decoded.system = system.or_else(|| grid_mapping::system(mapping, axes::metres(file, axes)));
    if vertical.is_some() {
        let stated = decoded.metres_per_vertical_unit;
        decoded.set_vertical(vertical, stated);
    }
}

/// The bytes as a store that can be read anywhere.
fn storage(input: &FileBytes) -> Result<DynStorage, BadRaster> {
    Ok(match input.data() {
        Data::File(file, _) => {
            let file = file.try_clone().map_err(BadRaster::Unreadable)?;
            let storage = FileStorage::from_file(file);
            Arc::new(storage.map_err(|error| BadRaster::Unreadable(std::io::Error::other(error)))?)
        }
        Data::Memory(bytes) => Arc::new(BytesStorage::from_owner(bytes.clone())),
        Data::Remote(..) => Arc::new(BytesStorage::from_owner(input.all()?)),
    })
}

/// The height variable: two-dimensional but for leading dimensions of length
/// one, by its name or because there is no other.
fn choose<'v>(
    variables: &'v [NcVariable],
    asked: Option<&str>,
) -> Result<&'v NcVariable, BadRaster> {
    let grids: Vec<&NcVariable> = variables
        .iter()
        .filter(|variable| size(variable).is_ok() && sample_type(variable).is_some())
        .collect();
    let names: Vec<&str> = grids.iter().map(|variable| variable.name()).collect();
    Ok(grids[height_name::choose("variable", &names, HEIGHT_NAMES, asked)?])
}

/// Columns and rows.
fn size(variable: &NcVariable) -> Result<(u32, u32), BadRaster> {
    match variable.shape().split_last_chunk() {
        Some((leading, &[rows, columns])) if leading.iter().all(|&length| length == 1) => {
            sides(columns, rows)
        }
        _ => Err(BadRaster::NotAHeightField(format!(
            "{} has no two dimensions",
            variable.name()
        ))),
    }
}

fn sample_type(variable: &NcVariable) -> Option<SampleType> {
    Some(match variable.dtype() {
        NcType::Byte => SampleType::I8,
        NcType::UByte => SampleType::U8,
        NcType::Short => SampleType::I16,
        NcType::UShort => SampleType::U16,
        NcType::Int => SampleType::I32,
        NcType::UInt => SampleType::U32,
        NcType::Float => SampleType::F32,
        NcType::Double => SampleType::F64,
        _ => return None,
    })
}

/// Reads a variable's values, of the type that `_none` has.
fn read_values<T: NcReadable>(
    _none: Vec<T>,
    file: &NcFile,
    variable: &NcVariable,
) -> Result<Vec<T>, BadRaster> {
    let array = file.read_variable::<T>(variable.name());
    match array
        .map_err(|error| fault(&error))?
        .into_raw_vec_and_offset()
    {
        (values, None | Some(0)) => Ok(values),
        _ => Err(BadRaster::damaged(
            "the variable does not start with its first sample",
        )),
    }
}

/// Integers whose `_Unsigned` attribute says the other sign than their stored type.
fn of_the_other_sign(samples: Samples) -> Samples {
    fn all<T, U>(values: Vec<T>, convert: impl Fn(T) -> U) -> Samples
    where
        Samples: From<Vec<U>>,
    {
        values.into_iter().map(convert).collect::<Vec<U>>().into()
    }
    match samples {
        Samples::I8(values) => all(values, |value| value as u8),
        Samples::U8(values) => all(values, |value| value as i8),
        Samples::I16(values) => all(values, |value| value as u16),
        Samples::U16(values) => all(values, |value| value as i16),
        Samples::I32(values) => all(values, |value| value as u32),
        Samples::U32(values) => all(values, |value| value as i32),
        others => others,
    }
}

/// Rows for columns: `along` values a stored row.
fn transposed<T: Copy>(values: &[T], along: u32) -> Vec<T> {
    let along = along as usize;
    let column = |first: usize| values.iter().skip(first).step_by(along);
    (0..along).flat_map(column).copied().collect()
}

/// `_FillValue`, else `missing_value`, else what the format writes where nothing was
/// written, is no data; so is every other missing value, and what is out of the valid
/// range.
fn mark_missing(decoded: &mut Decoded, variable: &NcVariable) {
    let default = match decoded.storage.sample_type() {
        SampleType::I16 => Some(-32767.0),
        SampleType::I32 => Some(-2_147_483_647.0),
        SampleType::F32 | SampleType::F64 => Some(9.969_209_968_386_869e36),
        _ => None,
    };
    let Some(stated) = MaskParams::from_variable(variable) else {
        decoded.no_data = default;
        return;
    };
    let missing = stated.missing_values.first().copied();
    decoded.no_data = stated.fill_value.or(missing).or(default);
    let Some(samples) = decoded.storage.held() else {
        return;
    };
    let others = stated.missing_values.iter();
    let others = others.filter_map(|value| samples.comparable_no_data(*value));
    let others: Vec<f64> = others.collect();
    let valid = stated.valid_min.unwrap_or(f64::MIN)..=stated.valid_max.unwrap_or(f64::MAX);
    let mut mask = HoleMask::with_capacity(samples.len());
    with_samples!(samples, values => {
        for (index, value) in values.iter().enumerate() {
            let value = value.widen();
            if others.contains(&value) || !(value.is_nan() || valid.contains(&value)) {
                mask.insert(index);
            }
        }
    });
    decoded.storage.set_holes(Some(mask));
}

fn fault(error: &netcdf_reader::Error) -> BadRaster {
    use hdf5_reader::error::Error::UnsupportedFilter;
    use netcdf_reader::Error::{Hdf5, UnsupportedFeature};
    if let Hdf5(inner) = error
        && let UnsupportedFilter(filter) = cause(inner)
    {
        return BadRaster::Unsupported {
            format: "NetCDF",
            feature: format!("compression by {filter} of HDF5's registry"),
        };
    }
    if let UnsupportedFeature(feature) = error {
        return BadRaster::Unsupported {
            format: "NetCDF",
            feature: feature.clone(),
        };
    }
    BadRaster::Damaged(format!("NetCDF: {error}"))
}

/// What is behind an error that names the objects around it.
fn cause(error: &hdf5_reader::error::Error) -> &hdf5_reader::error::Error {
    match error {
        hdf5_reader::error::Error::Context { source, .. } => cause(source),
        error => error,
    }
}

#[cfg(test)]
mod tests;
