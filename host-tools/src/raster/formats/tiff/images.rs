//! What each image of a file is.

use tiff_reader::{Ifd, TiffFile};

use crate::raster::BadRaster;

/// The tag that says what an image is, and two of its bits.
const NEW_SUBFILE_TYPE: u16 = 254;
const REDUCED: u32 = 1;
const MASK: u32 = 4;

/// The first image that is neither an overview nor a mask; else the last.
pub(super) fn full(file: &TiffFile) -> Result<&Ifd, BadRaster> {
    let images = file.ifds();
    let full = images.iter().find(|image| kind(image) == 0);
    full.or(images.last())
        .ok_or_else(|| BadRaster::damaged("TIFF: it has no image"))
}

/// The mask that GDAL keeps beside an image or overview of the same size: 0 for no data.
pub(super) fn mask_of<'f>(file: &'f TiffFile, image: &Ifd) -> Option<&'f Ifd> {
    let size = |image: &Ifd| (image.width(), image.height());
    let mut others = file.ifds().iter().skip(1);
    others.find(|other| kind(other) & MASK != 0 && size(other) == size(image))
}

/// The first image that is as large as another.
pub(super) fn of_same_size<'f>(file: &'f TiffFile, image: &Ifd) -> Option<&'f Ifd> {
    let size = |image: &Ifd| (image.width(), image.height());
    file.ifds().iter().find(|other| size(other) == size(image))
}

/// The overviews in a file, the finest first.
pub(super) fn overviews(file: &TiffFile) -> Vec<&Ifd> {
    let reduced = file.ifds().iter().filter(|image| kind(image) == REDUCED);
    let mut reduced: Vec<_> = reduced.collect();
    reduced.sort_by_key(|image| std::cmp::Reverse((image.width(), image.height())));
    reduced
}

/// Whether an image is reduced or a mask, as a set of bits.
fn kind(image: &Ifd) -> u32 {
    let bits = image.tag(NEW_SUBFILE_TYPE);
    bits.and_then(|tag| tag.value.as_u32()).unwrap_or(0) & (REDUCED | MASK)
}
