//! Index of an image's strips or tiles: the lists in its directory, as `tiff-reader` parsed them.

use tiff_reader::{Ifd, TagValue};

use crate::blocks::Part;

const STRIP_OFFSETS: u16 = 273;
const STRIP_BYTE_COUNTS: u16 = 279;
const TILE_OFFSETS: u16 = 324;
const TILE_BYTE_COUNTS: u16 = 325;

/// A strip or tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    /// Its offset in the file.
    pub(super) place: u64,
    /// Bytes stored for it; 0 if it is missing in a sparse file.
    pub(super) bytes: u64,
    /// Its samples.
    pub(super) covers: Part,
}

/// The offsets and sizes of strips or tiles.
pub(super) struct Index<'f> {
    places: &'f TagValue,
    bytes: &'f TagValue,
}

impl<'f> Index<'f> {
    /// Returns the index of an image in tiles or strips; `None` if it is missing.
    pub(super) fn of(image: &'f Ifd, tiled: bool) -> Option<Self> {
        let tags = match tiled {
            true => [TILE_OFFSETS, TILE_BYTE_COUNTS],
            false => [STRIP_OFFSETS, STRIP_BYTE_COUNTS],
        };
        let [places, bytes] = tags.map(|tag| image.tag(tag).map(|tag| &tag.value));
        let (places, bytes) = places.zip(bytes)?;
        number(places, 0).and(number(bytes, 0))?;
        Some(Self { places, bytes })
    }

    /// Returns offset and size of a strip or tile. Offset 0 is the file's header: such a chunk is
    /// missing, and its size is 0.
    pub(super) fn at(&self, index: usize) -> Option<(u64, u64)> {
        let (place, bytes) = number(self.places, index).zip(number(self.bytes, index))?;
        Some((place, if place == 0 { 0 } else { bytes }))
    }

    /// Returns the offset of a strip or tile, even if its size is missing.
    pub(super) fn place(&self, index: usize) -> Option<u64> {
        number(self.places, index)
    }

    /// Returns the size of the lists in memory.
    pub(super) fn memory_bytes(&self) -> usize {
        let list_bytes = |list: &TagValue| match list {
            TagValue::Byte(all) => all.len(),
            TagValue::Short(all) => size_of_val(&all[..]),
            TagValue::Long(all) => size_of_val(&all[..]),
            TagValue::Long8(all) => size_of_val(&all[..]),
            _ => 0,
        };
        list_bytes(self.places) + list_bytes(self.bytes)
    }
}

/// Returns an integer of a list.
fn number(list: &TagValue, index: usize) -> Option<u64> {
    match list {
        TagValue::Byte(all) => all.get(index).copied().map(u64::from),
        TagValue::Short(all) => all.get(index).copied().map(u64::from),
        TagValue::Long(all) => all.get(index).copied().map(u64::from),
        TagValue::Long8(all) => all.get(index).copied(),
        _ => None,
    }
}
