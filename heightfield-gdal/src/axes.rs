//! The axis on the ground along which a variable's samples are stored.

use std::path::Path;
use std::ptr;

use crate::dataset::Dataset;
use crate::library::Library;
use crate::text::{from_c, to_c};

/// Axis along which the samples of a row are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// From west to east, or unknown.
    X,
    /// North–south, in either direction.
    Y,
}

impl Library {
    /// Returns the axis of a variable's last dimension, in a file that GDAL has opened: in a
    /// raster, GDAL always treats it as x.
    #[must_use]
    pub fn last_axis(&self, path: &Path, variable: &str) -> Axis {
        let Ok(dataset) = Dataset::open_arrays(self.libgdal.clone(), path) else {
            return Axis::X;
        };
        let Ok(name) = to_c(variable) else {
            return Axis::X;
        };
        let functions = &self.libgdal.functions;
        // SAFETY: the dataset stays open until the end; each handle is used before its single
        // release; the list of dimensions has GDAL's count.
        let kind = unsafe {
            let group = (functions.GDALDatasetGetRootGroup)(dataset.handle());
            if group.is_null() {
                return Axis::X;
            }
            let array = (functions.GDALGroupOpenMDArray)(group, name.as_ptr(), ptr::null());
            (functions.GDALGroupRelease)(group);
            if array.is_null() {
                return Axis::X;
            }
            let mut count = 0;
            let dimensions = (functions.GDALMDArrayGetDimensions)(array, &raw mut count);
            let last = count.checked_sub(1).filter(|_| !dimensions.is_null());
            let kind = last
                .and_then(|last| from_c((functions.GDALDimensionGetType)(*dimensions.add(last))));
            if !dimensions.is_null() {
                (functions.GDALReleaseDimensions)(dimensions, count);
            }
            (functions.GDALMDArrayRelease)(array);
            kind
        };
        match kind.as_deref() {
            Some("HORIZONTAL_Y") => Axis::Y,
            _ => Axis::X,
        }
    }
}
