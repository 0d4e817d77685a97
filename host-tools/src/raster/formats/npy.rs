//! NumPy arrays, alone or in an `.npz`. `npyz` reads the header; the samples are
//! read into their own type.

use std::io::{Cursor, Read, Seek};

use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};

use super::height_name;
use crate::raster::archive::Zip;
use crate::raster::decoded::{Decoded, sides};
use crate::raster::format::{Claim, Format, Parts};
use crate::raster::ground_map::GroundMap;
use crate::raster::read::{Stored, read_samples};
use crate::raster::samples::{SampleValue, with_samples};
use crate::raster::{BadRaster, CellSize, Endian, SampleType, Samples};

/// A NumPy array in a file of its own.
pub(super) const FORMAT: Format = Format {
    name: "NumPy",
    begins: |head| head.starts_with(b"\x93NUMPY"),
    extensions: &[("npy", Claim::Suggests)],
    parts: Parts::One,
    decode: |input, _| read_array(&mut *input.reader()?, input.len())?.into_heights("NumPy array"),
};

/// What people call the array with the heights.
const HEIGHT_NAMES: &str = "elevation elev z dem height heights topo arr_0";

/// Bytes a header may have; real ones have 128.
const LONGEST_HEADER: u64 = 1 << 16;

/// The height array of an `.npz`, with the cell size from scalars `dx` and `dy`
/// beside it, where there are such.
pub(in crate::raster) fn decode_npz(
    zip: &mut Zip<'_>,
    asked: Option<&str>,
) -> Result<Decoded, BadRaster> {
    let mut arrays = Vec::new();
    for name in zip.names.clone() {
        let Some(stem) = name.strip_suffix(".npy") else {
            continue;
        };
        let bytes = zip.unpack(&name)?;
        let len = bytes.len() as u64;
        // Names, dates and other things that are no numbers may lie beside it.
        if let Ok(array) = read_array(&mut Cursor::new(bytes), len) {
            arrays.push((stem.to_owned(), array));
        }
    }
    let scalar = |name: &str| {
        let (_, array) = arrays
            .iter()
            .find(|(stem, _)| stem.eq_ignore_ascii_case(name))?;
        array.scalar()
    };
    let (dx, dy) = (scalar("dx"), scalar("dy"));
    let corner = scalar("xmin").zip(scalar("ymin"));
    arrays.retain(|(_, array)| array.shape.len() == 2);
    let names: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
    let place = height_name::choose("array", &names, HEIGHT_NAMES, asked)?;
    let (name, array) = arrays.swap_remove(place);
    let mut decoded = array.into_heights(&format!("NumPy archive, array {name}"))?;
    if let Some((east, north)) = dx.zip(dy) {
        let (east, north) = (east.abs(), north.abs());
        let size = (f64::from(decoded.columns), f64::from(decoded.rows));
        let extent = (east * size.0, north * size.1);
        let map = corner
            .and_then(|corner| GroundMap::from_south_west(corner, (east, north), decoded.rows));
        match map {
            Some(map) => decoded.lay_out(map, None),
            None => decoded.cell = Some(CellSize::guessed((east, north), None, extent)),
        }
    }
    Ok(decoded)
}

struct Array {
    shape: Vec<u64>,
    samples: Samples,
    column_major: bool,
}

fn read_array<R: Read + Seek + ?Sized>(reader: &mut R, len: u64) -> Result<Array, BadRaster> {
    check_header_length(reader)?;
    let header = NpyHeader::from_reader(&mut *reader)
        .map_err(|error| BadRaster::from_io(error, "the array's header"))?;
    let (sample, endian) = sample_type(&header.dtype())?;
    let shape = header.shape().to_vec();
    let data_start = reader.stream_position().map_err(BadRaster::Unreadable)?;
    let data = len.saturating_sub(data_start);
    let count = shape
        .iter()
        .try_fold(1_u64, |count, &side| count.checked_mul(side))
        .ok_or_else(|| BadRaster::AbsurdSize(format!("an array of {shape:?} samples")))?;
    if count
        .checked_mul(sample.bytes())
        .is_none_or(|bytes| bytes > data)
    {
        return Err(BadRaster::Truncated(format!(
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
fn check_header_length<R: Read + Seek + ?Sized>(reader: &mut R) -> Result<(), BadRaster> {
    let start = reader.stream_position().map_err(BadRaster::Unreadable)?;
    let mut head = [0; 12];
    reader
        .read_exact(&mut head)
        .map_err(|error| BadRaster::from_io(error, "the array's header"))?;
    let long = u64::from(u32::from_le_bytes([head[8], head[9], head[10], head[11]]));
    if head[6] > 1 && long > LONGEST_HEADER {
        return Err(BadRaster::AbsurdSize(format!(
            "an array header of {long} bytes"
        )));
    }
    reader
        .seek(std::io::SeekFrom::Start(start))
        .map_err(BadRaster::Unreadable)?;
    Ok(())
}

fn sample_type(dtype: &DType) -> Result<(Stored, Endian), BadRaster> {
    let what = || format!("an array of {}", dtype.descr());
    let unsupported = || BadRaster::NotAHeightField(what());
    let DType::Plain(plain) = dtype else {
        return Err(BadRaster::NoNumbers(what()));
    };
    let endian = match plain.endianness() {
        Endianness::Big => Endian::Big,
        _ => Endian::Little,
    };
    let held = match (plain.type_char(), plain.size_field()) {
        (TypeChar::Int, 8) => return Ok((Stored::I64, endian)),
        (TypeChar::Uint, 8) => return Ok((Stored::U64, endian)),
        (TypeChar::Float, 2) => return Ok((Stored::F16, endian)),
        (TypeChar::Int, 1) => SampleType::I8,
        (TypeChar::Int, 2) => SampleType::I16,
        (TypeChar::Int, 4) => SampleType::I32,
        (TypeChar::Uint, 1) => SampleType::U8,
        (TypeChar::Uint, 2) => SampleType::U16,
        (TypeChar::Uint, 4) => SampleType::U32,
        (TypeChar::Float, 4) => SampleType::F32,
        (TypeChar::Float, 8) => SampleType::F64,
        (TypeChar::Object | TypeChar::ByteStr | TypeChar::UnicodeStr, _) => {
            return Err(BadRaster::NoNumbers(what()));
        }
        _ => return Err(unsupported()),
    };
    Ok((Stored::Held(held), endian))
}

impl Array {
    /// The array as heights, its first row the northernmost.
    fn into_heights(self, format: &str) -> Result<Decoded, BadRaster> {
        let &[rows, columns] = self.shape.as_slice() else {
            let what = format!(
                "an array of {} dimensions; heights have two",
                self.shape.len()
            );
            return Err(match self.shape.len() {
                0 | 1 => BadRaster::NoNumbers(what),
                _ => BadRaster::NotAHeightField(what),
            });
        };
        let size = sides(columns, rows)?;
        let samples = if self.column_major {
            transposed(&self.samples, rows as usize, columns as usize)
        } else {
            self.samples
        };
        let format = format!("{format}, {}", samples.type_name());
        Ok(Decoded::new(format, size, samples))
    }

    fn scalar(&self) -> Option<f64> {
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
    with_samples!(samples, values => turned(values, rows, columns).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::input::FileBytes;

    /// A 2 × 3 array as numpy writes it.
    fn npy(descr: &str, samples: &[u8]) -> FileBytes {
        let mut header =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': (2, 3), }}");
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(samples);
        FileBytes::unpacked("test.npy", bytes)
    }

    fn samples(descr: &str, bytes: &[u8]) -> Result<Samples, BadRaster> {
        let decoded = (FORMAT.decode)(&npy(descr, bytes), &crate::raster::OpenOptions::default())?;
        Ok(decoded.storage.held().expect("in memory").clone())
    }

    #[test]
    fn integers_of_64_bits_and_halves_are_read() {
        let numbers = [1_i64, -2, 8848, 1 << 40, -(1 << 53), 0];
        let wanted = Samples::F64(numbers.map(|number| number as f64).to_vec());
        let little: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        assert_eq!(samples("<i8", &little).expect("int64"), wanted);
        let big: Vec<u8> = numbers.iter().flat_map(|n| n.to_be_bytes()).collect();
        assert_eq!(samples(">i8", &big).expect("int64"), wanted);
        let large = u64::MAX.to_le_bytes().repeat(6);
        let found = samples("<u8", &large).expect("uint64");
        assert_eq!(found, Samples::F64(vec![u64::MAX as f64; 6]));
        let halves = [0.5_f32, -1.25, 2048.0, 65504.0, 0.0, -0.0].map(half::f16::from_f32);
        for (descr, bytes) in [
            ("<f2", halves.map(half::f16::to_le_bytes).concat()),
            (">f2", halves.map(half::f16::to_be_bytes).concat()),
        ] {
            let found = samples(descr, &bytes).expect("float16");
            assert_eq!(found, Samples::F32(halves.map(half::f16::to_f32).to_vec()));
        }
    }

    #[test]
    fn an_array_that_the_file_does_not_hold_is_refused() {
        let fault = samples("<i8", &[0; 47]).expect_err("too short");
        assert!(matches!(fault, BadRaster::Truncated(_)), "{fault}");
        let fault = samples("<c8", &[0; 48]).expect_err("complex numbers");
        assert!(matches!(fault, BadRaster::NotAHeightField(_)), "{fault}");
    }
}
