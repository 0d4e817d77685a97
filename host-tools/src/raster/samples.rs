//! The samples of a file, held once, in the file's own compact type.

/// Samples in file order (row after row), in the file's own type.
///
/// Half floats are held as `f32` and 64-bit integers as `f64` (exact to 2^53).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Samples {
    /// 8-bit unsigned.
    U8(Vec<u8>),
    /// 8-bit signed.
    I8(Vec<i8>),
    /// 16-bit unsigned.
    U16(Vec<u16>),
    /// 16-bit signed.
    I16(Vec<i16>),
    /// 32-bit unsigned.
    U32(Vec<u32>),
    /// 32-bit signed.
    I32(Vec<i32>),
    /// 32-bit IEEE float.
    F32(Vec<f32>),
    /// 64-bit IEEE float.
    F64(Vec<f64>),
}

/// Runs `$body` with `$values` bound to the vector inside, whatever its type.
macro_rules! with_samples {
    ($samples:expr, $values:ident => $body:expr) => {
        match $samples {
            $crate::raster::Samples::U8($values) => $body,
            $crate::raster::Samples::I8($values) => $body,
            $crate::raster::Samples::U16($values) => $body,
            $crate::raster::Samples::I16($values) => $body,
            $crate::raster::Samples::U32($values) => $body,
            $crate::raster::Samples::I32($values) => $body,
            $crate::raster::Samples::F32($values) => $body,
            $crate::raster::Samples::F64($values) => $body,
        }
    };
}
pub(super) use with_samples;

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, values => values.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that the samples take in memory.
    pub fn bytes(&self) -> usize {
        with_samples!(self, values => std::mem::size_of_val(values.as_slice()))
    }

    /// Name of the sample type, as `int16`.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::U8(_) => "uint8",
            Self::I8(_) => "int8",
            Self::U16(_) => "uint16",
            Self::I16(_) => "int16",
            Self::U32(_) => "uint32",
            Self::I32(_) => "int32",
            Self::F32(_) => "float32",
            Self::F64(_) => "float64",
        }
    }

    /// The no-data value as this type would hold it, so that comparing samples
    /// widened to `f64` with it is exact; `None` when no sample can equal it.
    ///
    /// A float32 file's no-data is often written with the digits of a double
    /// (-3.4028234663852886e+38): it is rounded to `f32` first.
    pub(super) fn comparable_no_data(&self, value: f64) -> Option<f64> {
        let held = match self {
            Self::F32(_) => f64::from(value as f32),
            Self::F64(_) => value,
            Self::U8(_) => f64::from(value as u8),
            Self::I8(_) => f64::from(value as i8),
            Self::U16(_) => f64::from(value as u16),
            Self::I16(_) => f64::from(value as i16),
            Self::U32(_) => f64::from(value as u32),
            Self::I32(_) => f64::from(value as i32),
        };
        // NaN needs no rule: it is a hole in every float file. An integer type
        // that had to change the value cannot hold it.
        let same = matches!(self, Self::F32(_)) || held == value;
        (same && !held.is_nan()).then_some(held)
    }
}

/// A sample widened to `f64`.
pub(super) trait Widen: Copy {
    /// The same number.
    fn widen(self) -> f64;
}

macro_rules! widen {
    ($($sample:ty),*) => {
        $(impl Widen for $sample {
            fn widen(self) -> f64 {
                f64::from(self)
            }
        })*
    };
}
widen!(u8, i8, u16, i16, u32, i32, f32, f64);

/// One bit a sample: the holes that no sample value marks (alpha 0 in a grey
/// picture, a tile that a sparse file leaves out).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct HoleMask {
    words: Vec<u64>,
}

impl HoleMask {
    /// A mask of `samples` samples, none of them holes.
    pub(super) fn new(samples: usize) -> Self {
        Self {
            words: vec![0; samples.div_ceil(64)],
        }
    }

    pub(super) fn set(&mut self, index: usize) {
        if let Some(word) = self.words.get_mut(index / 64) {
            *word |= 1 << (index % 64);
        }
    }

    pub(super) fn is_hole(&self, index: usize) -> bool {
        self.words
            .get(index / 64)
            .is_some_and(|word| word >> (index % 64) & 1 == 1)
    }
}
