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

/// The masks of an image or overview, each with its file: the one that GDAL keeps in the same
/// file, and the one in a file `beside`; they are of its size. 0 is no data.
pub(super) fn masks<'f>(
    file: &'f TiffFile,
    beside: Option<&'f TiffFile>,
    image: &Ifd,
) -> impl Iterator<Item = (&'f TiffFile, &'f Ifd)> {
    let size = |image: &Ifd| (image.width(), image.height());
    let wanted = size(image);
    let mut others = file.ifds().iter().skip(1);
    let inside = others.find(|other| kind(other) & MASK != 0 && size(other) == wanted);
    let outside = beside.and_then(|beside| {
        let mask = beside.ifds().iter().find(|other| size(other) == wanted);
        mask.map(|mask| (beside, mask))
    });
    inside.map(|mask| (file, mask)).into_iter().chain(outside)
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
