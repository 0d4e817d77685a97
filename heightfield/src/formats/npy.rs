//! NumPy arrays, alone or in an `.npz`. `npyz` reads the header; the samples are
//! read into their own type.

use std::io::{Read, Seek};

use npyz::{DType, Endianness, NpyHeader, Order, TypeChar};

use super::height_name;
use crate::archive::Zip;
use crate::decoded::{Decoded, sides};
use crate::format::{Claim, Format, Parts};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::plain::Plain;
use crate::read::Stored;
use crate::samples::{SampleValue, with_samples};
use crate::{BadRaster, CellSize, Endian, OpenOptions, SampleType};

/// A NumPy array in a file of its own.
pub(super) const FORMAT: Format = Format {
    name: "NumPy",
    begins: |head| head.starts_with(b"\x93NUMPY"),
    extensions: &[("npy", Claim::Suggests)],
    parts: Parts::One,
    decode: |input, options| Array::in_file(input)?.heights(input, options, "NumPy array"),
};

/// What people call the array with the heights.
const HEIGHT_NAMES: &str = "elevation elev z dem height heights topo arr_0";

/// Bytes a header may have; real ones have 128.
const LONGEST_HEADER: u64 = 1 << 16;
/// Brackets that a header opens, at most: the dictionary and the shape, and a few of a record.
const MOST_BRACKETS: usize = 12;

/// The height array of an `.npz`, with the cell size from scalars `dx` and `dy`
/// beside it, where there are such.
pub(crate) fn decode_npz(zip: &mut Zip<'_>, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    let asked = options.variable.as_deref();
    let mut arrays = Vec::new();
    for name in zip.names.clone() {
        let Some(stem) = name.strip_suffix(".npy") else {
            continue;
        };
        let bytes = FileBytes::unpacked(&name, zip.unpack(&name)?);
        // Names, dates and other things that are no numbers may lie beside it.
        if let Ok(array) = Array::in_file(&bytes) {
            arrays.push((stem.to_owned(), bytes, array));
        }
    }
    let scalar = |name: &str| {
        let (_, bytes, array) = arrays
            .iter()
            .find(|(stem, ..)| stem.eq_ignore_ascii_case(name))?;
        array.scalar(bytes)
    };
    let (dx, dy) = (scalar("dx"), scalar("dy"));
    let corner = scalar("xmin").zip(scalar("ymin"));
    arrays.retain(|(.., array)| array.shape.len() == 2);
    let names: Vec<&str> = arrays.iter().map(|(name, ..)| name.as_str()).collect();
    let place = height_name::choose("array", &names, HEIGHT_NAMES, asked)?;
    let (name, bytes, array) = arrays.swap_remove(place);
    let format = format!("NumPy archive, array {name}");
    let mut decoded = array.heights(&bytes, options, &format)?;
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

/// Where an array's samples are.
struct Array {
    shape: Vec<u64>,
    stored: Stored,
    endian: Endian,
    column_major: bool,
    /// The first of them, bytes.
    first: u64,
}

/// `npyz` makes room for as long a header as the file says, and the time that it takes doubles
/// with each level of nesting.
fn check_header<R: Read + Seek + ?Sized>(reader: &mut R) -> Result<(), BadRaster> {
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
    let (begins, long) = match head[6] > 1 {
        true => (12, long),
        false => (10, u64::from(u16::from_le_bytes([head[8], head[9]]))),
    };
    let mut seek = |to| reader.seek(std::io::SeekFrom::Start(to));
    seek(start + begins).map_err(BadRaster::Unreadable)?;
    let mut header = Vec::new();
    (reader.take(long).read_to_end(&mut header)).map_err(BadRaster::Unreadable)?;
    let opened = header.iter().filter(|byte| b"{[(".contains(byte)).count();
    if opened > MOST_BRACKETS {
        return Err(BadRaster::NotAHeightField(format!(
            "an array whose header opens {opened} brackets; one of plain numbers opens 2"
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
    /// Reads an array's header; the file holds its samples.
    fn in_file(input: &FileBytes) -> Result<Self, BadRaster> {
        let reader = &mut *input.reader()?;
        check_header(reader)?;
        let header = NpyHeader::from_reader(&mut *reader)
            .map_err(|error| BadRaster::from_io(error, "the array's header"))?;
        let (stored, endian) = sample_type(&header.dtype())?;
        let shape = header.shape().to_vec();
        let first = reader.stream_position().map_err(BadRaster::Unreadable)?;
        let data = input.len().saturating_sub(first);
        let count = shape
            .iter()
            .try_fold(1_u64, |count, &side| count.checked_mul(side))
            .ok_or_else(|| BadRaster::AbsurdSize(format!("an array of {shape:?} samples")))?;
        if count
            .checked_mul(stored.bytes())
            .is_none_or(|bytes| bytes > data)
        {
            return Err(BadRaster::Truncated(format!(
                "an array of {shape:?} samples of {} bytes does not fit into {data} bytes",
                stored.bytes()
            )));
        }
        Ok(Self {
            shape,
            stored,
            endian,
            column_major: header.order() == Order::Fortran,
            first,
        })
    }

    /// The array as heights, its first row the northernmost.
    fn heights(
        &self,
        input: &FileBytes,
        options: &OpenOptions,
        format: &str,
    ) -> Result<Decoded, BadRaster> {
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
        let (columns, rows) = sides(columns, rows)?;
        let packed = |size| Plain::packed(size, self.stored, self.endian, self.first);
        let plain = match self.column_major {
            true => packed((rows, columns)).turned(),
            false => packed((columns, rows)),
        };
        let format = format!("{format}, {}", self.stored.held().none().type_name());
        let storage = plain.storage(input, options)?;
        Ok(Decoded::new(format, (columns, rows), storage))
    }

    /// The one sample of an array without sides.
    fn scalar(&self, input: &FileBytes) -> Option<f64> {
        let is_one = self.shape.iter().all(|side| *side == 1);
        let bytes = input.read_at(self.first, self.stored.bytes()).ok()?;
        let mut samples = self.stored.room(1).ok()?;
        (self.stored).append(&mut samples, &bytes, bytes.len(), self.endian);
        with_samples!(&samples, values => {
            values.first().filter(|_| is_one).map(|value| value.widen())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Samples;

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
        let decoded = (FORMAT.decode)(&npy(descr, bytes), &crate::OpenOptions::default())?;
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

    #[test]
    fn header_that_nests_deep_is_refused_at_once() {
        for deep in ["{".repeat(30), "{\"}\":".repeat(30)] {
            let fault = samples(&format!("', 'x': {deep}"), &[]).expect_err("deep");
            assert!(matches!(fault, BadRaster::NotAHeightField(_)), "{fault}");
        }
    }
}
