//! The kinds of images in a file.

use std::sync::Arc;

use tiff_reader::{Ifd, TiffFile};

use crate::RasterError;

/// The tag for the kind of an image, and two of its bits.
const NEW_SUBFILE_TYPE: u16 = 254;
const REDUCED: u32 = 1;
const MASK: u32 = 4;

/// An image of a file. It refers to its directory, whose lists may be too long to copy.
#[derive(Clone)]
pub(super) struct Directory {
    file: Arc<TiffFile>,
    number: usize,
}

impl Directory {
    /// Returns its file.
    pub(super) fn file(&self) -> &TiffFile {
        &self.file
    }

    /// Returns its directory.
    pub(super) fn ifd(&self) -> &Ifd {
        &self.file.ifds()[self.number]
    }
}

/// Returns the first image that is neither an overview nor a mask; else the last.
pub(super) fn full(file: &Arc<TiffFile>) -> Result<Directory, RasterError> {
    let images = file.ifds();
    let full = images.iter().position(|image| kind(image) == 0);
    let number = full
        .or(images.len().checked_sub(1))
        .ok_or_else(|| RasterError::damaged("TIFF: it has no image"))?;
    Ok(Directory {
        file: file.clone(),
        number,
    })
}

/// Returns the masks of an image or overview, of its size: the one in the same file, and the one in
/// a file `beside`. 0 is no-data.
pub(super) fn masks(image: &Directory, beside: Option<&Arc<TiffFile>>) -> Vec<Directory> {
    let size = |image: &Ifd| (image.width(), image.height());
    let own_size = size(image.ifd());
    let mut inside = image.file().ifds().iter().skip(1);
    let inside = inside.position(|other| kind(other) & MASK != 0 && size(other) == own_size);
    let inside = inside.map(|number| Directory {
        file: image.file.clone(),
        number: number + 1,
    });
    let outside = beside.and_then(|file| {
        let number = file
            .ifds()
            .iter()
            .position(|other| size(other) == own_size)?;
        let file = file.clone();
        Some(Directory { file, number })
    });
    inside.into_iter().chain(outside).collect()
}

/// Returns the overviews in a file, the finest first.
pub(super) fn overviews(file: &Arc<TiffFile>) -> Vec<Directory> {
    let reduced = (0..file.ifds().len()).filter(|number| kind(&file.ifds()[*number]) == REDUCED);
    let mut reduced: Vec<_> = reduced
        .map(|number| Directory {
            file: file.clone(),
            number,
        })
        .collect();
    reduced.sort_by_key(|image| std::cmp::Reverse((image.ifd().width(), image.ifd().height())));
    reduced
}

/// Returns the bits for overviews and masks.
fn kind(image: &Ifd) -> u32 {
    let bits = image.tag(NEW_SUBFILE_TYPE);
    bits.and_then(|tag| tag.value.as_u32()).unwrap_or(0) & (REDUCED | MASK)
}
