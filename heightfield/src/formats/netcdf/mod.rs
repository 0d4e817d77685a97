//! NetCDF grids, classic and NetCDF-4, as GMT and the climate conventions (COARDS,
//! CF) write them, in memory or, where they are large, read when they are touched: chunk by
//! chunk (`chunks`), or where samples lie plainly (`classic`).

mod access;
mod attributes;
mod axes;
mod chunks;
mod classic;
mod filters;
mod grid_mapping;
mod missing;

use netcdf_reader::unpack::SignParams;
use netcdf_reader::{NcFile, NcReadable, NcType, NcVariable};

use super::height_name;
use crate::decoded::{Decoded, sides};
use crate::format::{Claim, Format, Parts, starts_with_any};
use crate::geometry::metres_in;
use crate::input::FileBytes;
use crate::plain::PlainBlocks;
use crate::samples::with_samples;
use crate::storage::Storage;
use crate::{BadRaster, OpenOptions, ReferenceSystem, SampleType, Samples};
use access::Access;
use attributes::{number, text};
use chunks::{Chunks, Layout};
use missing::{Missing, WithHoles};

/// NetCDF 3 (three variants) and NetCDF-4, which is HDF5.
pub(super) const FORMAT: Format = Format {
    name: "NetCDF",
    begins: |head| {
        let signatures: [&[u8]; 4] = [b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF\r\n\x1a\n"];
        starts_with_any(head, &signatures)
    },
    extensions: &[("nc", Claim::Promises), ("grd", Claim::Suggests)],
    parts: Parts::Variables,
    decode,
};

/// What people call the variable with the heights.
const HEIGHT_NAMES: &str = "z elevation elev topo topography height altitude dem relief bedrock \
                            surface band1";

/// A file at a URL whose samples take no more than this is fetched as a whole.
const FEW_BYTES: u64 = 1 << 20;
/// More samples than this are not held in memory, however well the file packs them.
const MOST_BYTES: u64 = 16 << 30;
/// No grid has more samples each way.
const LARGEST_SIDE: u32 = i32::MAX as u32;

/// Reads the grid's height variable, or lets it stay in the file.
fn decode(input: &FileBytes, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    let access = Access::in_parts(input)?;
    let decoded = access.file().and_then(|file| {
        let heights = Heights::find(&file, options.variable.as_deref())?;
        heights.decode(input, options)
    });
    // What did not come looks like what is damaged or not there.
    access.check_came()?;
    decoded
}

/// The height variable of a file.
struct Heights<'f> {
    file: &'f NcFile,
    variable: &'f NcVariable,
    axes: axes::Names,
    layout: Layout,
}

impl<'f> Heights<'f> {
    fn find(file: &'f NcFile, asked: Option<&str>) -> Result<Self, BadRaster> {
        let variables = file.variables().map_err(|error| fault(&error))?;
        let variable = choose(variables, asked)?;
        let axes = axes::names(file, variable)?;
        let (columns, rows) = size(variable)?;
        if columns.max(rows) > LARGEST_SIDE {
            return Err(BadRaster::AbsurdSize(format!("{columns} × {rows} samples")));
        }
        let stored = sample_type(variable).ok_or_else(|| {
            BadRaster::NotAHeightField(format!("{} is no number", variable.name()))
        })?;
        let layout = Layout {
            size: match axes.x_first {
                true => [rows, columns],
                false => [columns, rows],
            },
            stored,
            other_sign: SignParams::from_variable(variable).is_some(),
            x_first: axes.x_first,
        };
        Ok(Self {
            file,
            variable,
            axes,
            layout,
        })
    }

    /// What the file says, with all samples or a way to them.
    fn decode(&self, input: &FileBytes, options: &OpenOptions) -> Result<Decoded, BadRaster> {
        let heights = self.variable;
        let sample = self.layout.held();
        let missing = Missing::of(heights, sample);
        let storage = match self.in_file(input, options, &missing)? {
            Some(storage) => storage,
            None => {
                let [columns, rows] = self.layout.size;
                check_memory(columns, rows, sample)?;
                input.check_holds(columns, rows, sample.bytes())?;
                match input.is_outline() {
                    true => sample.none().into(),
                    false => self.whole(input, &missing)?,
                }
            }
        };
        let format = format!(
            "NetCDF, variable {}, {}",
            heights.name(),
            sample.none().type_name()
        );
        let [columns, rows] = self.layout.size;
        let mut decoded = Decoded::new(format, (columns, rows), storage);
        decoded.no_data = missing.no_data;
        decoded.scale = number(heights, "scale_factor").unwrap_or(1.0);
        decoded.offset = number(heights, "add_offset").unwrap_or(0.0);
        decoded.metres_per_vertical_unit = text(heights, "units").and_then(|unit| metres_in(&unit));
        if text(heights, "positive").is_some_and(|way| way.eq_ignore_ascii_case("down")) {
            decoded.turn_depths_into_heights("positive = down");
        }
        reference_system(self.file, heights, &self.axes, &mut decoded);
        axes::place(self.file, &self.axes, &mut decoded);
        Ok(decoded)
    }

    /// A way to the samples, where they are too many to be held and can be read in parts.
    fn in_file(
        &self,
        input: &FileBytes,
        options: &OpenOptions,
        missing: &Missing,
    ) -> Result<Option<Storage>, BadRaster> {
        let layout = self.layout;
        let [columns, rows] = layout.size.map(u64::from);
        let most = match input.remote() {
            // What is not touched is not fetched, either.
            Some(_) => options.most_in_memory_bytes.min(FEW_BYTES),
            None => options.most_in_memory_bytes,
        };
        let bytes = (columns * rows).saturating_mul(layout.stored.bytes());
        let Some(own) = input.again()?.filter(|_| bytes > most) else {
            return Ok(None);
        };
        let missing = missing.clone();
        if self.file.as_classic().is_some() {
            let size = size(self.variable)?;
            let plain = classic::plain(self.file, self.variable, layout.held(), size, own.len())?;
            let plain = match layout.x_first {
                true => plain.turned(),
                false => plain,
            };
            let reader = PlainBlocks::new(plain, own);
            return Ok(Some(WithHoles { reader, missing }.into()));
        }
        let access = Access::in_parts(&own)?;
        let dataset = access.dataset(self.variable.name(), &self.variable.shape());
        access.check_came()?;
        let place = (own.name(), own.remote().is_some());
        let Some(reader) = Chunks::new(access, dataset?, layout, place) else {
            return Ok(None);
        };
        if !input.is_outline() {
            reader.check()?;
        }
        Ok(Some(WithHoles { reader, missing }.into()))
    }

    /// All samples.
    fn whole(&self, input: &FileBytes, missing: &Missing) -> Result<Storage, BadRaster> {
        let layout = self.layout;
        let file = Access::whole(input)?.file()?;
        let mut samples: Samples = with_samples!(layout.stored.none(), none => {
            read_values(none, &file, self.variable)?.into()
        });
        if layout.other_sign {
            samples = of_the_other_sign(samples);
        }
        if layout.x_first {
            // Stored columns are as long as the raster has rows.
            let along = layout.size[1];
            samples = with_samples!(&samples, values => transposed(values, along).into());
        }
        let holes = missing.holes(&samples);
        let mut storage = Storage::from(samples);
        storage.set_holes(Some(holes));
        Ok(storage)
    }
}

/// Checks that a machine can hold all samples.
fn check_memory(columns: u32, rows: u32, sample: SampleType) -> Result<(), BadRaster> {
    let (columns, rows) = (u64::from(columns), u64::from(rows));
    match (columns * rows).saturating_mul(sample.bytes()) {
        bytes if bytes > MOST_BYTES => Err(BadRaster::TooLarge {
            columns,
            rows,
            gigabytes: bytes.div_ceil(1_000_000_000),
        }),
        _ => Ok(()),
    }
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
