//! The pages of flash that an update erases, and their new content.

use std::collections::BTreeMap;

use super::error::UpdateError;
use super::layout::Layout;
use crate::board::boards::Board;
use crate::board::image::Image;
use crate::board::memories::Memories;

/// Value of an erased byte.
const ERASED: u8 = 0xFF;
/// Whole words of flash and their new content.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlashRange {
    /// The first address.
    pub address: u64,
    /// The new content.
    pub bytes: Vec<u8>,
}

/// The pages to erase and the words to write in an update.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// First addresses of the pages to erase; the page with the vectors is first.
    pub erased: Vec<u64>,
    /// The word with the first two vectors, stack and start, which is written last.
    pub vectors: FlashRange,
    /// All other words, in order. The rest of an erased page stays erased.
    pub others: Vec<FlashRange>,
}

impl Plan {
    /// Plans an update of `board` with `image` through a loader with the flash `layout`.
    ///
    /// # Errors
    /// [`UpdateError`]: the flash belongs to another chip, or the image reaches into the
    /// calibrations or has no vectors.
    pub fn new(board: &Board, image: &Image, layout: &Layout) -> Result<Self, UpdateError> {
        let memories = image.memories;
        let expected = (memories.flash, memories.page_bytes, memories.flash_bytes);
        let found = (
            layout.start,
            layout.page_bytes,
            layout.page_bytes * layout.pages,
        );
        if found != expected {
            return Err(UpdateError::OtherChip {
                board: board.name,
                description: layout.description.clone(),
            });
        }
        let mut pages = pages(image, &memories)?;
        let erased = pages.keys().copied().collect();
        let start = memories.flash;
        let vectors = pages.get_mut(&start).ok_or(UpdateError::NoVectors(start))?;
        let behind = vectors.split_off(memories.word_bytes as usize);
        let word = std::mem::replace(vectors, behind);
        let others = pages.into_iter().map(|(address, bytes)| match address {
            _ if address == start => FlashRange {
                address: start + memories.word_bytes,
                bytes,
            },
            _ => FlashRange { address, bytes },
        });
        Ok(Self {
            erased,
            vectors: FlashRange {
                address: start,
                bytes: word,
            },
            others: others.filter(|range| !range.bytes.is_empty()).collect(),
        })
    }

    /// Returns the number of bytes to write.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let others: usize = self.others.iter().map(|range| range.bytes.len()).sum();
        self.vectors.bytes.len() + others
    }
}

/// Divides the image's bytes into pages.
fn pages(image: &Image, memories: &Memories) -> Result<BTreeMap<u64, Vec<u8>>, UpdateError> {
    let allowed = memories.for_image();
    let mut pages: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
    for part in &image.parts {
        let end = part.address + part.bytes.len() as u64;
        if part.address < allowed.start || end > allowed.end {
            return Err(UpdateError::Calibrations { end });
        }
        for (address, byte) in (part.address..).zip(&part.bytes) {
            let offset = ((address - memories.flash) % memories.page_bytes) as usize;
            let page = pages.entry(address - offset as u64).or_default();
            let words = (offset + 1).next_multiple_of(memories.word_bytes as usize);
            page.resize(page.len().max(words), ERASED);
            page[offset] = *byte;
        }
    }
    Ok(pages)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::image::Part;

    const FLASH: u64 = 0x0800_0000;

    fn image(parts: &[(u64, usize)]) -> Image {
        let part = |(address, bytes): &(u64, usize)| Part {
            address: *address,
            bytes: vec![0x5A; *bytes],
        };
        Image {
            memories: Memories::G474,
            parts: parts.iter().map(part).collect(),
            placed: vec![],
        }
    }

    fn plan(parts: &[(u64, usize)], description: &str) -> Result<Plan, UpdateError> {
        let board = Board::named("nucleo-g474re").expect("known");
        let layout = Layout::read(description).expect("understood");
        Plan::new(board, &image(parts), &layout)
    }

    const G474: &str = "@Internal Flash   /0x08000000/256*02Kg";

    #[test]
    fn image_erases_its_own_pages_only() {
        let plan = plan(&[(FLASH, 2049), (FLASH + 0x3010, 3)], G474).expect("fits");
        assert_eq!(plan.erased, [FLASH, FLASH + 0x800, FLASH + 0x3000]);
        assert_eq!((plan.vectors.address, plan.vectors.bytes.len()), (FLASH, 8));
        let others = plan.others.iter();
        let others: Vec<_> = others.map(|s| (s.address - FLASH, s.bytes.len())).collect();
        assert_eq!(others, [(8, 2040), (0x800, 8), (0x3000, 24)]);
        let last = &plan.others[2].bytes;
        assert_eq!(last[..16], [ERASED; 16]);
        assert_eq!(last[16..20], [0x5A, 0x5A, 0x5A, ERASED]);
    }

    #[test]
    fn h743_plan_writes_32_byte_words_and_erases_sectors() {
        const SECTOR: u64 = 128 * 1024;
        let board = Board::named("nucleo-h743zi2").expect("known");
        let description = "@Internal Flash   /0x08000000/8*128Kg,8*128Kg";
        let layout = Layout::read(description).expect("understood");
        let of = |parts: &[(u64, usize)]| {
            let memories = Memories::H743;
            let image = Image {
                memories,
                ..image(parts)
            };
            Plan::new(board, &image, &layout)
        };
        let last = FLASH + 14 * SECTOR;
        let plan = of(&[(FLASH, 40), (FLASH + SECTOR + 33, 3), (last - 1, 1)]).expect("fits");
        assert_eq!(plan.erased, [FLASH, FLASH + SECTOR, last - SECTOR]);
        assert_eq!(
            (plan.vectors.address, plan.vectors.bytes.len()),
            (FLASH, 32)
        );
        let others = plan.others.iter();
        let others: Vec<_> = others.map(|s| (s.address - FLASH, s.bytes.len())).collect();
        let whole = SECTOR as usize;
        assert_eq!(others, [(32, 32), (SECTOR, 64), (13 * SECTOR, whole)]);
        assert_eq!(
            plan.others[0].bytes[..9],
            [[0x5A; 8].as_slice(), &[ERASED]].concat()
        );
        // The calibrations.
        for part in [(last - 1, 2), (last, 1)] {
            let refused = of(&[(FLASH, 8), part]);
            assert!(matches!(refused, Err(UpdateError::Calibrations { .. })));
        }
    }

    /// Safety: 36.
    #[test]
    fn calibration_sectors_cannot_be_erased() {
        let calibrations = FLASH + 508 * 1024;
        assert!(plan(&[(FLASH, 8), (calibrations - 8, 8)], G474).is_ok());
        for part in [(calibrations - 8, 9), (calibrations, 1), (FLASH - 4, 8)] {
            let refused = plan(&[(FLASH, 8), part], G474);
            assert!(
                matches!(refused, Err(UpdateError::Calibrations { .. })),
                "{part:?}"
            );
        }
    }

    #[test]
    fn loader_of_another_chip_is_refused() {
        for description in [
            "@Internal Flash /0x08000000/16*128Kg",
            "@Internal Flash /0x08000000/128*02Kg",
            "@Internal Flash /0x08000000/128*04Kg",
            "@Internal Flash /0x90000000/256*02Kg",
        ] {
            let refused = plan(&[(FLASH, 8)], description);
            assert!(
                matches!(refused, Err(UpdateError::OtherChip { .. })),
                "{description}"
            );
        }
        let refused = plan(&[(FLASH + 0x800, 8)], G474);
        assert!(matches!(refused, Err(UpdateError::NoVectors(FLASH))));
    }
}
