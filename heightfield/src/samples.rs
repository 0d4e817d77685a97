//! The samples of a file, stored once, in the file's own compact type.

/// Declares the sample types, one line each.
macro_rules! sample_types {
    ($($(#[$about:meta])* $variant:ident($type:ty) = $name:literal, $short:literal;)*) => {
        /// Samples in file order (row after row), in the file's own type.
        ///
        /// Half floats are stored as `f32` and 64-bit integers as `f64` (exact to 2^53).
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
            /// All types.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// Returns the short name, as `i16`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $short,)*
                }
            }

            /// Returns the bytes of a sample.
            pub const fn bytes(self) -> u64 {
                match self {
                    $(Self::$variant => size_of::<$type>() as u64,)*
                }
            }

            /// Returns an empty vector of this type.
            pub(super) const fn none(self) -> Samples {
                match self {
                    $(Self::$variant => Samples::$variant(Vec::new()),)*
                }
            }
        }

        impl Samples {
            /// Returns the type of the samples.
            pub const fn sample_type(&self) -> SampleType {
                match self {
                    $(Self::$variant(_) => SampleType::$variant,)*
                }
            }

            /// Returns the name of the sample type, as `int16`.
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

/// Runs `$body` with `$values` bound to the inner vector, for any type.
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
    /// Both orders.
    pub const ALL: &[Self] = &[Self::Little, Self::Big];

    /// Returns its name, as `little`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Little => "little",
            Self::Big => "big",
        }
    }
}

/// One sample of a type that [`Samples`] can contain.
pub(super) trait SampleValue: Copy {
    /// Converts to `f64`, exactly.
    fn widen(self) -> f64;

    /// Returns the number of this type nearest to `value`.
    fn nearest(value: f64) -> Self;

    /// Reads a sample from as many bytes as the type has.
    fn from_bytes(bytes: &[u8], endian: Endian) -> Self;
}

impl Samples {
    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, values => values.len())
    }

    /// Returns true if there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the memory of the samples, bytes.
    pub fn bytes(&self) -> usize {
        with_samples!(self, values => size_of_val(values.as_slice()))
    }

    /// Returns the no-data value as this type stores it, so that comparing it with samples widened
    /// to `f64` is exact; `None` if no sample can equal it.
    ///
    /// The no-data value of a float32 file is often written with the digits of a double
    /// (-3.4028234663852886e+38): it is rounded to `f32` first.
    pub(super) fn comparable_no_data(&self, value: f64) -> Option<f64> {
        fn rounded<T: SampleValue>(_: &[T], value: f64) -> f64 {
            T::nearest(value).widen()
        }
        let result = with_samples!(self, values => rounded(values, value));
        // NaN is no-data in every float file, so it needs no rule. An integer type that had to
        // change the value cannot store it.
        let same = matches!(self, Self::F32(_)) || result == value;
        (same && !result.is_nan()).then_some(result)
    }
}

/// One bit per sample: no-data that no sample value marks (alpha 0 in a grey picture, a missing
/// tile of a sparse file).
pub(super) type NoDataMask = fixedbitset::FixedBitSet;
