//! The samples of a file, held once, in the file's own compact type.

/// Declares the types a sample may have, one line a type.
macro_rules! sample_types {
    ($($(#[$about:meta])* $variant:ident($type:ty) = $name:literal, $short:literal;)*) => {
        /// Samples in file order (row after row), in the file's own type.
        ///
        /// Half floats are held as `f32` and 64-bit integers as `f64` (exact to 2^53).
        #[derive(Clone, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum Samples {
            $($(#[$about])* $variant(Vec<$type>),)*
        }

        /// The type of a sample.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum SampleType {
            $($(#[$about])* $variant,)*
        }

        impl SampleType {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Its short name, as `i16`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $short,)*
                }
            }

            /// Bytes that a sample of this type takes.
            pub const fn bytes(self) -> u64 {
                match self {
                    $(Self::$variant => size_of::<$type>() as u64,)*
                }
            }

            /// No samples of this type, to be filled.
            pub(super) const fn none(self) -> Samples {
                match self {
                    $(Self::$variant => Samples::$variant(Vec::new()),)*
                }
            }
        }

        impl Samples {
            /// Type of the samples.
            pub const fn sample_type(&self) -> SampleType {
                match self {
                    $(Self::$variant(_) => SampleType::$variant,)*
                }
            }

            /// Name of the sample type, as `int16`.
            pub const fn type_name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $name,)*
                }
            }
        }

        $(impl From<Vec<$type>> for Samples {
            fn from(values: Vec<$type>) -> Self {
                Self::$variant(values)
            }
        }

        impl SampleValue for $type {
            fn widen(self) -> f64 {
                f64::from(self)
            }

            fn nearest(value: f64) -> Self {
                value as $type
            }

            fn from_bytes(bytes: &[u8], endian: Endian) -> Self {
                let bytes = bytes.try_into().unwrap_or_default();
                match endian {
                    Endian::Little => <$type>::from_le_bytes(bytes),
                    Endian::Big => <$type>::from_be_bytes(bytes),
                }
            }
        })*
    };
}

sample_types! {
    /// 8-bit unsigned
    U8(u8) = "uint8", "u8";
    /// 8-bit signed
    I8(i8) = "int8", "i8";
    /// 16-bit unsigned
    U16(u16) = "uint16", "u16";
    /// 16-bit signed
    I16(i16) = "int16", "i16";
    /// 32-bit unsigned
    U32(u32) = "uint32", "u32";
    /// 32-bit signed
    I32(i32) = "int32", "i32";
    /// 32-bit IEEE float
    F32(f32) = "float32", "f32";
    /// 64-bit IEEE float
    F64(f64) = "float64", "f64";
}

/// Runs `$body` with `$values` bound to the vector inside, whatever its type.
macro_rules! with_samples {
    ($samples:expr, $values:ident => $body:expr) => {
        match $samples {
            $crate::Samples::U8($values) => $body,
            $crate::Samples::I8($values) => $body,
            $crate::Samples::U16($values) => $body,
            $crate::Samples::I16($values) => $body,
            $crate::Samples::U32($values) => $body,
            $crate::Samples::I32($values) => $body,
            $crate::Samples::F32($values) => $body,
            $crate::Samples::F64($values) => $body,
        }
    };
}
pub(super) use with_samples;

/// Byte order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Endian {
    /// Least significant byte first
    #[default]
    Little,
    /// Most significant byte first
    Big,
}

impl Endian {
    /// Both.
    pub const ALL: &[Self] = &[Self::Little, Self::Big];

    /// Its name, as `little`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Little => "little",
            Self::Big => "big",
        }
    }
}

/// One sample of a type that [`Samples`] can hold.
pub(super) trait SampleValue: Copy {
    /// The same number.
    fn widen(self) -> f64;

    /// The number of this type that is nearest to `value`.
    fn nearest(value: f64) -> Self;

    /// The sample stored in as many bytes as the type has.
    fn from_bytes(bytes: &[u8], endian: Endian) -> Self;
}

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, values => values.len())
    }

    /// Returns true if there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that the samples take in memory.
    pub fn bytes(&self) -> usize {
        with_samples!(self, values => size_of_val(values.as_slice()))
    }

    /// The no-data value as this type would hold it, so that comparing samples
    /// widened to `f64` with it is exact; `None` when no sample can equal it.
    ///
    /// A float32 file's no-data is often written with the digits of a double
    /// (-3.4028234663852886e+38): it is rounded to `f32` first.
    pub(super) fn comparable_no_data(&self, value: f64) -> Option<f64> {
        fn held<T: SampleValue>(_: &[T], value: f64) -> f64 {
            T::nearest(value).widen()
        }
        let held = with_samples!(self, values => held(values, value));
        // NaN needs no rule: it is a hole in every float file. An integer type
        // that had to change the value cannot hold it.
        let same = matches!(self, Self::F32(_)) || held == value;
        (same && !held.is_nan()).then_some(held)
    }
}

/// One bit a sample: the holes that no sample value marks (alpha 0 in a grey
/// picture, a tile that a sparse file leaves out).
pub(super) type HoleMask = fixedbitset::FixedBitSet;
