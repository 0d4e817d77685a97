//! A band of a raster: its samples and their meaning.

use std::ffi::{c_int, c_void};

use crate::error::Error;
use crate::functions::Handle;
use crate::libgdal::Libgdal;
use crate::pending_calls::Call;
use crate::text::from_c;

/// `GF_Read`.
const READ: c_int = 0;
/// `CE_Warning`; it and `CE_None` mean that the samples were read.
const WARNING: c_int = 2;
/// `GMF_ALL_VALID` and `GMF_NODATA`.
const ALL_VALID: c_int = 1;
const NO_DATA: c_int = 8;

/// A band of an open raster, or an overview or mask of one.
#[derive(Clone, Copy)]
pub struct Band<'d> {
    libgdal: &'d Libgdal,
    handle: Handle,
}

/// A rectangle of samples; column 0, row 0 is the file's first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its first column.
    pub column: u32,
    /// Its first row.
    pub row: u32,
    /// Samples per row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
}

/// The type of a band's stored samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleType {
    /// Unsigned, 8 bits.
    U8,
    /// Signed, 8 bits (since GDAL 3.7).
    I8,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 64 bits.
    U64,
    /// Signed, 64 bits.
    I64,
    /// Floats of 16 bits (since GDAL 3.11).
    F16,
    /// Floats of 32 bits.
    F32,
    /// Floats of 64 bits.
    F64,
}

/// Mask of no-data samples, besides a no-data value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mask {
    /// None, or only the no-data value.
    None,
    /// A separate band, or an alpha band: 0 marks no-data.
    Band,
}

/// A type for reading samples. GDAL converts, and clamps to the type's range.
pub trait Sample: Copy + Default + sealed::Code {}

mod sealed {
    pub trait Code {
        /// GDAL's number of the type.
        const CODE: std::ffi::c_int;
    }
}

macro_rules! samples {
    ($($type:ty = $code:literal),*) => {
        $(
            impl sealed::Code for $type {
                const CODE: c_int = $code;
            }
            impl Sample for $type {}
        )*
    };
}

// GDAL supports 14, and bands of that type, since 3.7.
samples!(
    u8 = 1,
    i8 = 14,
    u16 = 2,
    i16 = 3,
    u32 = 4,
    i32 = 5,
    f32 = 6,
    f64 = 7
);

impl SampleType {
    const fn of(code: c_int) -> Option<Self> {
        Some(match code {
            1 => Self::U8,
            2 => Self::U16,
            3 => Self::I16,
            4 => Self::U32,
            5 => Self::I32,
            6 => Self::F32,
            7 => Self::F64,
            12 => Self::U64,
            13 => Self::I64,
            14 => Self::I8,
            15 => Self::F16,
            _ => return None,
        })
    }
}

impl<'d> Band<'d> {
    /// Returns a band by its handle; `None` if it is null.
    pub(crate) fn of(libgdal: &'d Libgdal, handle: Handle) -> Option<Self> {
        (!handle.is_null()).then_some(Self { libgdal, handle })
    }

    /// Returns columns and rows.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        let functions = &self.libgdal.functions;
        // SAFETY: the band's dataset is open.
        let size = unsafe {
            [
                (functions.GDALGetRasterBandXSize)(self.handle),
                (functions.GDALGetRasterBandYSize)(self.handle),
            ]
        };
        size.map(|count| count.max(0) as u32)
    }

    /// Returns columns and rows of a block, which GDAL always reads whole.
    #[must_use]
    pub fn block_size(&self) -> [u32; 2] {
        let (mut columns, mut rows) = (0, 0);
        // SAFETY: both pointers are valid for a write.
        unsafe {
            (self.libgdal.functions.GDALGetBlockSize)(self.handle, &raw mut columns, &raw mut rows);
        }
        [columns, rows].map(|count| count.max(1) as u32)
    }

    /// Returns the type of the samples.
    ///
    /// # Errors
    /// The name of a complex type, or of a type that is newer than this crate.
    pub fn sample_type(&self) -> Result<SampleType, String> {
        let functions = &self.libgdal.functions;
        // SAFETY: the band's dataset is open; the name is static, and is copied.
        unsafe {
            let code = (functions.GDALGetRasterDataType)(self.handle);
            SampleType::of(code).ok_or_else(|| {
                let name = from_c((functions.GDALGetDataTypeName)(code));
                name.unwrap_or_else(|| format!("type {code}"))
            })
        }
    }

    /// Returns the value that marks no-data.
    #[must_use]
    pub fn no_data(&self) -> Option<f64> {
        self.number(self.libgdal.functions.GDALGetRasterNoDataValue)
    }

    /// Returns the factor of samples, applied before the [offset](Self::offset).
    #[must_use]
    pub fn scale(&self) -> Option<f64> {
        self.number(self.libgdal.functions.GDALGetRasterScale)
    }

    /// Returns the offset of samples.
    #[must_use]
    pub fn offset(&self) -> Option<f64> {
        self.number(self.libgdal.functions.GDALGetRasterOffset)
    }

    fn number(&self, of: unsafe extern "C" fn(Handle, *mut c_int) -> f64) -> Option<f64> {
        let mut is_stated = 0;
        // SAFETY: one of the three functions above; the pointer is valid for a write.
        let number = unsafe { of(self.handle, &raw mut is_stated) };
        (is_stated != 0).then_some(number)
    }

    /// Returns the unit of the heights, by its name in the file.
    #[must_use]
    pub fn unit(&self) -> Option<String> {
        // SAFETY: the band's dataset is open; the text is copied.
        unsafe { from_c((self.libgdal.functions.GDALGetRasterUnitType)(self.handle)) }
    }

    /// Returns the band's name in the file.
    #[must_use]
    pub fn description(&self) -> Option<String> {
        // SAFETY: as above.
        unsafe { from_c((self.libgdal.functions.GDALGetDescription)(self.handle)) }
    }

    /// Returns an item of its metadata, from the default domain.
    ///
    /// # Errors
    /// [`Error::ZeroByte`].
    pub fn metadata(&self, name: &str) -> Result<Option<String>, Error> {
        // SAFETY: the band's dataset is open.
        unsafe { self.libgdal.metadata(self.handle, name, None) }
    }

    /// Returns its overviews, in the file's order.
    #[must_use]
    pub fn overviews(&self) -> Vec<Self> {
        let functions = &self.libgdal.functions;
        // SAFETY: the band's dataset is open and owns the overviews, whose numbers start at 0.
        unsafe {
            let count = (functions.GDALGetOverviewCount)(self.handle);
            let overviews =
                (0..count).map(|number| (functions.GDALGetOverview)(self.handle, number));
            let bands = overviews.filter_map(|handle| Self::of(self.libgdal, handle));
            bands.collect()
        }
    }

    /// Returns the mask of no-data samples, besides the no-data value.
    #[must_use]
    pub fn mask(&self) -> Mask {
        // SAFETY: the band's dataset is open.
        let flags = unsafe { (self.libgdal.functions.GDALGetMaskFlags)(self.handle) };
        match flags & (ALL_VALID | NO_DATA) {
            0 => Mask::Band,
            _ => Mask::None,
        }
    }

    /// Returns the band of its mask: 0 for no-data.
    #[must_use]
    pub fn mask_band(&self) -> Option<Self> {
        // SAFETY: the band's dataset is open, and owns the mask.
        let handle = unsafe { (self.libgdal.functions.GDALGetMaskBand)(self.handle) };
        Self::of(self.libgdal, handle)
    }

    /// Reads a window into `samples`, row after row.
    ///
    /// # Errors
    /// [`Error::Window`] if it is not inside the band, or `samples` has another size;
    /// [`Error::Refused`] with GDAL's message.
    pub fn read<T: Sample>(&self, window: Window, samples: &mut [T]) -> Result<(), Error> {
        let Window {
            column,
            row,
            columns,
            rows,
        } = window;
        let misfit = |why: String| Error::Window {
            window: [column, row, columns, rows],
            why,
        };
        let [across, down] = self.size();
        let ends = [column.checked_add(columns), row.checked_add(rows)];
        let is_inside = ends
            .iter()
            .zip([across, down])
            .all(|(end, size)| end.is_some_and(|end| end <= size));
        if !is_inside || columns == 0 || rows == 0 {
            return Err(misfit(format!("the band has {across} × {down} samples")));
        }
        if samples.len() as u64 != u64::from(columns) * u64::from(rows) {
            return Err(misfit(format!("there is room for {}", samples.len())));
        }
        // At most the band's size, which GDAL stores as `c_int`.
        let [x, y, width, height] = [column, row, columns, rows].map(|count| count as c_int);
        let buffer = samples.as_mut_ptr().cast::<c_void>();
        self.libgdal.prepare_thread();
        let _call = Call::begin();
        let functions = &self.libgdal.functions;
        // SAFETY: the buffer has space for the window's samples of that type, without gaps.
        let status = unsafe {
            (functions.CPLErrorReset)();
            (functions.GDALRasterIO)(
                self.handle,
                READ,
                x,
                y,
                width,
                height,
                buffer,
                width,
                height,
                T::CODE,
                0,
                0,
            )
        };
        match status <= WARNING {
            true => Ok(()),
            false => Err(self.libgdal.refused("the samples cannot be read")),
        }
    }
}
