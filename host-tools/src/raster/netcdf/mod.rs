//! NetCDF grids, classic and NetCDF-4, as GMT and the climate conventions (COARDS,
//! CF) write them.

mod axes;

use netcdf_reader::{NcFile, NcType, NcVariable};

use super::archive::DEFLATE_RATIO;
use super::geometry::metres_in;
use super::input::Input;
use super::samples::{HoleMask, Widen, with_samples};
use super::{Decoded, Fault, Samples};

/// What people call the variable with the heights.
const HEIGHT_NAMES: [&str; 12] = [
    "z",
    "elevation",
    "elev",
    "topo",
    "topography",
    "height",
    "altitude",
    "dem",
    "relief",
    "bedrock",
    "surface",
    "band1",
];

/// Reads the grid's height variable.
pub(super) fn decode(input: &Input) -> Result<Decoded, Fault> {
    let file = NcFile::from_storage(input.storage()?).map_err(|error| fault(&error))?;
    let variables = file.variables().map_err(|error| fault(&error))?;
    let heights = choose(variables)?;
    let (rows, columns) = sides(heights)?;
    check_size(heights, rows, columns, input.len())?;
    let samples = read_samples(&file, heights)?;
    let format = format!(
        "NetCDF, variable {}, {}",
        heights.name(),
        samples.type_name()
    );
    let mut decoded = Decoded::new(format, columns, rows, samples);
    mark_missing(&mut decoded, heights);
    decoded.scale = number(heights, "scale_factor").unwrap_or(1.0);
    decoded.offset = number(heights, "add_offset").unwrap_or(0.0);
    decoded.metres_per_vertical_unit = text(heights, "units").and_then(|unit| metres_in(&unit));
    axes::place(&file, heights, &mut decoded)?;
    Ok(decoded)
}

/// The height variable: two-dimensional but for leading dimensions of length
/// one, by its name or because there is no other.
fn choose(variables: &[NcVariable]) -> Result<&NcVariable, Fault> {
    let grids: Vec<&NcVariable> = variables
        .iter()
        .filter(|variable| sides(variable).is_ok() && sample_type(variable).is_some())
        .collect();
    let named = HEIGHT_NAMES.iter().find_map(|wanted| {
        grids
            .iter()
            .find(|variable| variable.name().eq_ignore_ascii_case(wanted))
    });
    match (named, grids.as_slice()) {
        (Some(variable), _) | (None, [variable]) => Ok(variable),
        (None, []) => Err(Fault::NotAHeightField(
            "it has no two-dimensional variable of numbers".into(),
        )),
        (None, several) => {
            let names: Vec<&str> = several.iter().map(|variable| variable.name()).collect();
            Err(Fault::NotAHeightField(format!(
                "of its two-dimensional variables ({}) none is named as heights are",
                names.join(", ")
            )))
        }
    }
}

/// Rows and columns.
fn sides(variable: &NcVariable) -> Result<(u32, u32), Fault> {
    let shape = variable.shape();
    let (leading, [rows, columns]) = shape.split_last_chunk().ok_or_else(|| {
        Fault::NotAHeightField(format!("{} has no two dimensions", variable.name()))
    })?;
    if leading.iter().any(|&length| length != 1) {
        return Err(Fault::NotAHeightField(format!(
            "{} has {} dimensions",
            variable.name(),
            shape.len()
        )));
    }
    match (u32::try_from(*rows), u32::try_from(*columns)) {
        (Ok(rows), Ok(columns)) => Ok((rows, columns)),
        _ => Err(Fault::AbsurdSize(format!("{columns} × {rows} samples"))),
    }
}

fn check_size(
    variable: &NcVariable,
    rows: u32,
    columns: u32,
    file_bytes: u64,
) -> Result<(), Fault> {
    let sample_bytes = variable.dtype().size().unwrap_or(8) as u64;
    let bytes = u64::from(rows) * u64::from(columns) * sample_bytes.max(1);
    if bytes > file_bytes.saturating_mul(DEFLATE_RATIO) {
        return Err(Fault::AbsurdSize(format!(
            "{columns} × {rows} samples in a file of {file_bytes} bytes"
        )));
    }
    Ok(())
}

#[derive(Clone, Copy)]
enum SampleType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
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

fn read_samples(file: &NcFile, variable: &NcVariable) -> Result<Samples, Fault> {
    macro_rules! read_as {
        ($variant:ident, $type:ty) => {{
            let array = file
                .read_variable::<$type>(variable.name())
                .map_err(|error| fault(&error))?;
            let (values, start) = array.into_raw_vec_and_offset();
            if start.unwrap_or(0) != 0 {
                return Err(Fault::damaged(
                    "the variable does not start with its first sample",
                ));
            }
            Samples::$variant(values)
        }};
    }
    let sample = sample_type(variable)
        .ok_or_else(|| Fault::NotAHeightField(format!("{} is no number", variable.name())))?;
    Ok(match sample {
        SampleType::I8 => read_as!(I8, i8),
        SampleType::U8 => read_as!(U8, u8),
        SampleType::I16 => read_as!(I16, i16),
        SampleType::U16 => read_as!(U16, u16),
        SampleType::I32 => read_as!(I32, i32),
        SampleType::U32 => read_as!(U32, u32),
        SampleType::F32 => read_as!(F32, f32),
        SampleType::F64 => read_as!(F64, f64),
    })
}

/// `_FillValue`, else `missing_value`, else what the format writes where nothing
/// was written; both where they differ.
fn mark_missing(decoded: &mut Decoded, variable: &NcVariable) {
    let fill = number(variable, "_FillValue");
    let missing = number(variable, "missing_value");
    let default = match decoded.samples {
        Samples::I16(_) => Some(-32767.0),
        Samples::I32(_) => Some(-2_147_483_647.0),
        Samples::F32(_) | Samples::F64(_) => Some(9.969_209_968_386_869e36),
        _ => None,
    };
    decoded.no_data = fill.or(missing).or(default);
    let second = missing.and_then(|value| decoded.samples.comparable_no_data(value));
    if let Some(second) = second.filter(|_| fill.is_some() && fill != missing) {
        let mut mask = HoleMask::new(decoded.samples.len());
        with_samples!(&decoded.samples, values => {
            for (index, value) in values.iter().enumerate() {
                if value.widen() == second {
                    mask.set(index);
                }
            }
        });
        decoded.mask = Some(mask);
    }
}

fn number(variable: &NcVariable, attribute: &str) -> Option<f64> {
    variable.attribute(attribute)?.value.as_f64()
}

fn text(variable: &NcVariable, attribute: &str) -> Option<String> {
    variable.attribute(attribute)?.value.as_string()
}

fn fault(error: &netcdf_reader::Error) -> Fault {
    Fault::Damaged(format!("NetCDF: {error}"))
}
