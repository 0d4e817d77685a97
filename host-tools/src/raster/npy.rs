//! NumPy arrays, alone or in an `.npz`. `npyz` reads the header; the samples are
//! read into their own type.

use std::io::{Cursor, Read, Seek};

use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};
use zip::ZipArchive;

use super::archive::unpack_entry;
use super::input::{Input, ReadSeek};
use super::raw::read_samples;
use super::samples::with_samples;
use super::{CellSize, Decoded, Endian, Fault, RawSample, Samples};

/// What people call the array with the heights.
const HEIGHT_NAMES: [&str; 8] = [
    "elevation",
    "elev",
    "z",
    "dem",
    "height",
    "heights",
    "topo",
    "arr_0",
];

/// Bytes a header may have; real ones have 128.
const LONGEST_HEADER: u64 = 1 << 16;

/// One array of heights.
pub(super) fn decode_npy(input: &Input) -> Result<Decoded, Fault> {
    read_array(&mut *input.reader()?, input.len())?.into_heights("NumPy array")
}

/// The height array of an `.npz`, with the cell size from scalars `dx` and `dy`
/// beside it, where there are such.
pub(super) fn decode_npz<R: ReadSeek>(
    archive: &mut ZipArchive<R>,
    names: &[String],
) -> Result<Decoded, Fault> {
    let mut arrays = Vec::new();
    for name in names {
        let Some(stem) = name.strip_suffix(".npy") else {
            continue;
        };
        let bytes = unpack_entry(archive, name)?;
        let len = bytes.len() as u64;
        // Names, dates and other things that are no numbers may lie beside it.
        if let Ok(array) = read_array(&mut Cursor::new(bytes), len) {
            arrays.push((stem.to_lowercase(), array));
        }
    }
    let scalar = |name: &str| {
        let (_, array) = arrays.iter().find(|(stem, _)| stem == name)?;
        array.scalar()
    };
    let (dx, dy) = (scalar("dx"), scalar("dy"));
    let corner = scalar("xmin").zip(scalar("ymin"));
    arrays.retain(|(_, array)| array.shape.len() == 2);
    let place = HEIGHT_NAMES
        .iter()
        .find_map(|wanted| arrays.iter().position(|(name, _)| name == wanted))
        .or((arrays.len() == 1).then_some(0))
        .ok_or_else(|| {
            let names: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
            Fault::NotAHeightField(format!(
                "of its two-dimensional arrays ({}) none is named as heights are",
                names.join(", ")
            ))
        })?;
    let (name, array) = arrays.swap_remove(place);
    let mut decoded = array.into_heights(&format!("NumPy archive, array {name}"))?;
    if let Some((east, north)) = dx.zip(dy) {
        let (east, north) = (east.abs(), north.abs());
        let extent = (
            east * f64::from(decoded.columns),
            north * f64::from(decoded.rows),
        );
        decoded.cell = Some(CellSize::guessed((east, north), corner, extent));
    }
    Ok(decoded)
}

struct Array {
    shape: Vec<u64>,
    samples: Samples,
    column_major: bool,
}

fn read_array<R: Read + Seek + ?Sized>(reader: &mut R, len: u64) -> Result<Array, Fault> {
    check_header_length(reader)?;
    let header = NpyHeader::from_reader(&mut *reader)
        .map_err(|error| Fault::from_io(error, "the array's header"))?;
    let (sample, endian) = sample_type(&header.dtype())?;
    let shape = header.shape().to_vec();
    let data_start = reader.stream_position().map_err(Fault::Unreadable)?;
    let data = len.saturating_sub(data_start);
    let count = shape
        .iter()
        .try_fold(1_u64, |count, &side| count.checked_mul(side))
        .ok_or_else(|| Fault::AbsurdSize(format!("an array of {shape:?} samples")))?;
    if count
        .checked_mul(sample.bytes())
        .is_none_or(|bytes| bytes > data)
    {
        return Err(Fault::Truncated(format!(
            "an array of {shape:?} samples of {} bytes does not fit into {data} bytes",
            sample.bytes()
        )));
    }
    let mut source = reader.take(data);
    Ok(Array {
        samples: read_samples(&mut source, count, sample, endian)?,
        shape,
        column_major: header.order() == Order::Fortran,
    })
}

/// `npyz` makes room for as long a header as the file says.
fn check_header_length<R: Read + Seek + ?Sized>(reader: &mut R) -> Result<(), Fault> {
    let start = reader.stream_position().map_err(Fault::Unreadable)?;
    let mut head = [0; 12];
    reader
        .read_exact(&mut head)
        .map_err(|error| Fault::from_io(error, "the array's header"))?;
    let long = u64::from(u32::from_le_bytes([head[8], head[9], head[10], head[11]]));
    if head[6] > 1 && long > LONGEST_HEADER {
        return Err(Fault::AbsurdSize(format!(
            "an array header of {long} bytes"
        )));
    }
    reader
        .seek(std::io::SeekFrom::Start(start))
        .map_err(Fault::Unreadable)?;
    Ok(())
}

fn sample_type(dtype: &DType) -> Result<(RawSample, Endian), Fault> {
    let unsupported = || Fault::NotAHeightField(format!("an array of {}", dtype.descr()));
    let DType::Plain(plain) = dtype else {
        return Err(unsupported());
    };
    let endian = match plain.endianness() {
        Endianness::Big => Endian::Big,
        _ => Endian::Little,
    };
    let sample = match (plain.type_char(), plain.size_field()) {
        (TypeChar::Int, 1) => RawSample::I8,
        (TypeChar::Int, 2) => RawSample::I16,
        (TypeChar::Int, 4) => RawSample::I32,
        (TypeChar::Uint, 1) => RawSample::U8,
        (TypeChar::Uint, 2) => RawSample::U16,
        (TypeChar::Uint, 4) => RawSample::U32,
        (TypeChar::Float, 4) => RawSample::F32,
        (TypeChar::Float, 8) => RawSample::F64,
        _ => return Err(unsupported()),
    };
    Ok((sample, endian))
}

impl Array {
    /// The array as heights, its first row the northernmost.
    fn into_heights(self, format: &str) -> Result<Decoded, Fault> {
        let &[rows, columns] = self.shape.as_slice() else {
            return Err(Fault::NotAHeightField(format!(
                "an array of {} dimensions; heights have two",
                self.shape.len()
            )));
        };
        let side = |length: u64| {
            u32::try_from(length)
                .map_err(|_| Fault::AbsurdSize(format!("{columns} × {rows} samples")))
        };
        let (columns, rows) = (side(columns)?, side(rows)?);
        let samples = if self.column_major {
            transposed(&self.samples, rows as usize, columns as usize)
        } else {
            self.samples
        };
        let format = format!("{format}, {}", samples.type_name());
        Ok(Decoded::new(format, columns, rows, samples))
    }

    fn scalar(&self) -> Option<f64> {
        use super::samples::Widen;
        with_samples!(&self.samples, values => match values.as_slice() {
            [value] => Some(value.widen()),
            _ => None,
        })
    }
}

/// Row-major samples of a column-major array.
fn transposed(samples: &Samples, rows: usize, columns: usize) -> Samples {
    fn turned<T: Copy>(values: &[T], rows: usize, columns: usize) -> Vec<T> {
        let place = |row: usize| (0..columns).map(move |column| column * rows + row);
        (0..rows)
            .flat_map(place)
            .map(|index| values[index])
            .collect()
    }
    match samples {
        Samples::U8(values) => Samples::U8(turned(values, rows, columns)),
        Samples::I8(values) => Samples::I8(turned(values, rows, columns)),
        Samples::U16(values) => Samples::U16(turned(values, rows, columns)),
        Samples::I16(values) => Samples::I16(turned(values, rows, columns)),
        Samples::U32(values) => Samples::U32(turned(values, rows, columns)),
        Samples::I32(values) => Samples::I32(turned(values, rows, columns)),
        Samples::F32(values) => Samples::F32(turned(values, rows, columns)),
        Samples::F64(values) => Samples::F64(turned(values, rows, columns)),
    }
}
