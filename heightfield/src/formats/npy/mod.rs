//! NumPy arrays, one per file. The samples keep their own type.

mod header;

use crate::decoded::{Decoded, sides};
use crate::format::{Claim, Format, Parts};
use crate::input::FileBytes;
use crate::raw_samples::RawSamples;
use crate::read::StoredType;
use crate::{Endian, OpenOptions, RasterError, SampleType};
use header::Header;

/// Files with one NumPy array.
pub(super) const FORMAT: Format = Format {
    name: "NumPy",
    begins: |head| head.starts_with(b"\x93NUMPY"),
    extensions: &[("npy", Claim::Possible)],
    parts: Parts::One,
    decode: |input, options| Array::in_file(input)?.heights(input, options),
};

/// Layout of an array's samples.
struct Array {
    shape: Vec<u64>,
    stored: StoredType,
    endian: Endian,
    column_major: bool,
    /// Offset of the first sample, bytes.
    first: u64,
}

/// Parses NumPy's type and byte order, as `<f4`.
fn sample_type(descr: &str) -> Result<(StoredType, Endian), RasterError> {
    let what = || format!("an array of {descr}");
    let (order, kind) = match descr.split_at_checked(1) {
        Some((order @ ("<" | ">" | "|" | "="), kind)) => (order, kind),
        _ => ("<", descr),
    };
    let endian = match order {
        ">" => Endian::Big,
        _ => Endian::Little,
    };
    let memory_type = match kind {
        "i8" => return Ok((StoredType::I64, endian)),
        "u8" => return Ok((StoredType::U64, endian)),
        "f2" => return Ok((StoredType::F16, endian)),
        "i1" => SampleType::I8,
        "i2" => SampleType::I16,
        "i4" => SampleType::I32,
        "u1" => SampleType::U8,
        "u2" => SampleType::U16,
        "u4" => SampleType::U32,
        "f4" => SampleType::F32,
        "f8" => SampleType::F64,
        _ if kind.starts_with(['O', 'S', 'U', 'a']) => return Err(RasterError::NoNumbers(what())),
        _ => return Err(RasterError::NotAHeightField(what())),
    };
    Ok((StoredType::Held(memory_type), endian))
}

impl Array {
    /// Reads an array's header; the samples stay in the file.
    fn in_file(input: &FileBytes) -> Result<Self, RasterError> {
        let Header {
            descr,
            column_major,
            shape,
            bytes: first,
        } = Header::read(&mut input.reader()?)?;
        let (stored, endian) = sample_type(&descr)?;
        let data = input.len().saturating_sub(first);
        let count = shape
            .iter()
            .try_fold(1_u64, |count, &side| count.checked_mul(side))
            .ok_or_else(|| RasterError::AbsurdSize(format!("an array of {shape:?} samples")))?;
        if count
            .checked_mul(stored.bytes())
            .is_none_or(|bytes| bytes > data)
        {
            return Err(RasterError::Truncated(format!(
                "an array of {shape:?} samples of {} bytes does not fit into {data} bytes",
                stored.bytes()
            )));
        }
        Ok(Self {
            shape,
            stored,
            endian,
            column_major,
            first,
        })
    }

    /// Returns the array as heights, its first row the northernmost.
    fn heights(&self, input: &FileBytes, options: &OpenOptions) -> Result<Decoded, RasterError> {
        let &[rows, columns] = self.shape.as_slice() else {
            let what = format!(
                "an array of {} dimensions; heights have two",
                self.shape.len()
            );
            return Err(match self.shape.len() {
                0 | 1 => RasterError::NoNumbers(what),
                _ => RasterError::NotAHeightField(what),
            });
        };
        let (columns, rows) = sides(columns, rows)?;
        let packed = |size| RawSamples::packed(size, self.stored, self.endian, self.first);
        let plain = match self.column_major {
            true => packed((rows, columns)).turned(),
            false => packed((columns, rows)),
        };
        let format = format!(
            "NumPy array, {}",
            self.stored.memory_type().none().type_name()
        );
        let storage = plain.storage(input, options)?;
        Ok(Decoded::new(format, (columns, rows), storage))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Samples;

    /// Returns a 2 × 3 array as NumPy writes it.
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

    fn samples(descr: &str, bytes: &[u8]) -> Result<Samples, RasterError> {
        let decoded = (FORMAT.decode)(&npy(descr, bytes), &crate::OpenOptions::default())?;
        Ok(decoded.storage.in_memory().expect("in memory").clone())
    }

    #[test]
    fn integers_of_64_bits_and_halves_are_read() {
        let numbers = [1_i64, -2, 8848, 1 << 40, -(1 << 53), 0];
        let expected = Samples::F64(numbers.map(|number| number as f64).to_vec());
        let little: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
        assert_eq!(samples("<i8", &little).expect("int64"), expected);
        let big: Vec<u8> = numbers.iter().flat_map(|n| n.to_be_bytes()).collect();
        assert_eq!(samples(">i8", &big).expect("int64"), expected);
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
    fn array_larger_than_the_file_is_refused() {
        let fault = samples("<i8", &[0; 47]).expect_err("too short");
        assert!(matches!(fault, RasterError::Truncated(_)), "{fault}");
        let fault = samples("<c8", &[0; 48]).expect_err("complex numbers");
        assert!(matches!(fault, RasterError::NotAHeightField(_)), "{fault}");
    }

    /// Safety: 29.
    #[test]
    fn header_that_nests_deep_is_refused_at_once() {
        for deep in ["{".repeat(30), "{\"}\":".repeat(30)] {
            let fault = samples(&format!("', 'x': {deep}"), &[]).expect_err("deep");
            assert!(matches!(fault, RasterError::NotAHeightField(_)), "{fault}");
        }
    }
}
