//! Parts of an image with their addresses, checked against the chip's memories before any write.

use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use object::LittleEndian;
use object::elf::{EM_ARM, FileHeader32, PT_LOAD, SHT_SYMTAB};
use object::read::elf::{FileHeader, ProgramHeader, Sym};

use super::boards::Board;
use super::memories::Memories;
use heightfield::regular_file;

/// Size limit of an ELF; one with debug information is smaller.
const MAX_BYTES: u64 = 256 << 20;

/// An image that fits its chip.
#[derive(Debug)]
pub struct Image {
    pub(super) memories: Memories,
    /// Parts for the chip's flash.
    pub(super) parts: Vec<Part>,
    /// The memories used, for the user's information.
    pub placed: Vec<Placed>,
}

/// Bytes and their address.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) address: u64,
    pub(super) bytes: Vec<u8>,
}

/// Part of an image in one of its chip's memories.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Placed {
    /// The memory's first address and the one past its last.
    pub memory: Range<u64>,
    /// True if the memory keeps its content without power.
    pub is_flash: bool,
    /// Bytes used.
    pub bytes: u64,
}

/// Error of reading an image for a board.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The board has no chip.
    #[error("{0} is emulated: there is no chip to write to")]
    Emulated(&'static str),
    /// The file cannot be read.
    #[error("cannot read {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// The file is not a program for a Cortex-M.
    #[error("{} is no image for a board: {why}", path.display())]
    NoImage {
        /// The file.
        path: PathBuf,
        /// Defect of the file.
        why: String,
    },
    /// Part of the image lies where the chip has no memory of that kind.
    #[error(
        "{} is not for {chip}: {bytes} bytes of it belong at {address:#010x}, where that chip has no {memory}",
        path.display()
    )]
    OutOfMemory {
        /// The file.
        path: PathBuf,
        /// The chip.
        chip: String,
        /// First address of the part.
        address: u64,
        /// Length of the part, bytes.
        bytes: u64,
        /// Flash or RAM.
        memory: &'static str,
    },
    /// The image was built for another board, or names no board.
    #[error(
        "{} is not for {board}: {}",
        path.display(),
        found.as_deref().map_or("it names no board".into(), |found| format!("it was built for {found}"))
    )]
    OtherBoard {
        /// The file.
        path: PathBuf,
        /// The expected board.
        board: &'static str,
        /// The board that the image names.
        found: Option<String>,
    },
}

impl Image {
    /// Returns the memories of the image's chip.
    #[must_use]
    pub const fn memories(&self) -> &Memories {
        &self.memories
    }

    /// Reads an ELF and checks it against the memories of the board's chip.
    ///
    /// # Errors
    /// [`ImageError`].
    pub fn read(board: &Board, path: &Path) -> Result<Self, ImageError> {
        let (Some(chip), Some(memories)) = (board.chip, board.memories) else {
            return Err(ImageError::Emulated(board.name));
        };
        let elf = regular_file::read(path, MAX_BYTES).map_err(|source| ImageError::Unreadable {
            path: path.to_owned(),
            source,
        })?;
        let Contents { segments, mark } = contents(&elf).map_err(|why| ImageError::NoImage {
            path: path.to_owned(),
            why,
        })?;
        let image = place(memories, segments).map_err(|stray| ImageError::OutOfMemory {
            path: path.to_owned(),
            chip: chip.to_owned(),
            address: stray.address,
            bytes: stray.bytes,
            memory: if stray.in_flash { "flash" } else { "RAM" },
        })?;
        // The wiring can differ even if the image fits both chips.
        match mark.as_deref() == Some(board.name) {
            true => Ok(image),
            false => Err(ImageError::OtherBoard {
                path: path.to_owned(),
                board: board.name,
                found: mark,
            }),
        }
    }
}

/// Prefix of the symbol that `firmware/build.rs` adds to an image. The board's name follows, with
/// underscores for dashes.
const MARK: &str = "hapterra.board.";

/// Contents of an ELF.
struct Contents {
    segments: Vec<Segment>,
    /// The board that the ELF names.
    mark: Option<String>,
}

fn contents(elf: &[u8]) -> Result<Contents, String> {
    let header = FileHeader32::<LittleEndian>::parse(elf).map_err(|_| "it is no 32-bit ELF")?;
    if header.e_machine(LittleEndian) != EM_ARM {
        return Err("it is not for ARM".into());
    }
    Ok(Contents {
        segments: segments(header, elf)?,
        mark: mark(header, elf),
    })
}

fn mark(header: &FileHeader32<LittleEndian>, elf: &[u8]) -> Option<String> {
    let sections = header.sections(LittleEndian, elf).ok()?;
    let table = sections.symbols(LittleEndian, elf, SHT_SYMTAB).ok()?;
    table.iter().find_map(|symbol| {
        let name = symbol.name(LittleEndian, table.strings()).ok()?;
        let board = std::str::from_utf8(name).ok()?.strip_prefix(MARK)?;
        Some(board.replace('_', "-"))
    })
}

/// A loaded segment: its address at run time, its load address and its bytes.
struct Segment {
    run_address: u64,
    memory_bytes: u64,
    load_address: u64,
    bytes: Vec<u8>,
}

fn segments(header: &FileHeader32<LittleEndian>, elf: &[u8]) -> Result<Vec<Segment>, String> {
    let headers = header
        .program_headers(LittleEndian, elf)
        .map_err(|error| error.to_string())?;
    let loads = headers
        .iter()
        .filter(|segment| segment.p_type(LittleEndian) == PT_LOAD);
    let segments: Result<Vec<_>, String> = loads
        .map(|segment| {
            let bytes = segment
                .data(LittleEndian, elf)
                .map_err(|()| "it is cut off")?;
            Ok(Segment {
                run_address: segment.p_vaddr(LittleEndian).into(),
                memory_bytes: segment.p_memsz(LittleEndian).into(),
                load_address: segment.p_paddr(LittleEndian).into(),
                bytes: bytes.to_vec(),
            })
        })
        .collect();
    match segments {
        Ok(segments) if segments.iter().all(|s| s.bytes.is_empty()) => {
            Err("there is nothing to load in it".into())
        }
        segments => segments,
    }
}

/// Part of an image that lies in no memory of the chip.
struct Stray {
    address: u64,
    bytes: u64,
    in_flash: bool,
}

fn place(memories: Memories, segments: Vec<Segment>) -> Result<Image, Stray> {
    let mut placed: Vec<Placed> = Vec::new();
    let mut take = |address: u64, bytes: u64, in_flash: bool| {
        if bytes == 0 {
            return Ok(());
        }
        let stray = Stray {
            address,
            bytes,
            in_flash,
        };
        let memory = memories.containing(address, bytes, in_flash).ok_or(stray)?;
        match placed.iter_mut().find(|place| place.memory == memory) {
            Some(place) => place.bytes += bytes,
            None => placed.push(Placed {
                memory,
                is_flash: in_flash,
                bytes,
            }),
        }
        Ok(())
    };
    for segment in &segments {
        take(segment.load_address, segment.bytes.len() as u64, true)?;
        // A segment that runs at its load address is already in flash.
        if segment.run_address != segment.load_address || segment.bytes.is_empty() {
            take(segment.run_address, segment.memory_bytes, false)?;
        }
    }
    let parts = segments.into_iter().filter(|s| !s.bytes.is_empty());
    Ok(Image {
        parts: parts
            .map(|s| Part {
                address: s.load_address,
                bytes: s.bytes,
            })
            .collect(),
        memories,
        placed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(run_address: u64, load_address: u64, bytes: usize, memory_bytes: u64) -> Segment {
        Segment {
            run_address,
            memory_bytes,
            load_address,
            bytes: vec![1; bytes],
        }
    }

    const FLASH: u64 = 0x0800_0000;
    const RAM: u64 = 0x2000_0000;

    #[test]
    fn code_and_data_find_their_memories() {
        let code = segment(FLASH, FLASH, 1000, 1000);
        let data = segment(RAM, FLASH + 1000, 40, 240);
        let image = place(Memories::G474, vec![code, data]).ok().expect("fits");
        let ranges: Vec<_> = image.placed.iter().map(|p| (p.is_flash, p.bytes)).collect();
        assert_eq!(ranges, [(true, 1040), (false, 240)]);
        assert_eq!(image.parts.len(), 2);
    }

    #[test]
    fn segment_may_span_adjacent_ram_blocks() {
        // SRAM1, SRAM2 and CCM of the G474, 128 KiB end to end.
        let data = segment(RAM + 0x1000, FLASH, 8, 0x1_F000);
        assert!(place(Memories::G474, vec![data]).is_ok());
        let too_much = segment(RAM + 0x1000, FLASH, 8, 0x1_F001);
        assert!(place(Memories::G474, vec![too_much]).is_err());
    }

    #[test]
    fn image_of_another_chip_is_refused() {
        // The H743's data RAM, and flash past the G474's 512 KiB.
        for stray in [
            segment(0x2400_0000, FLASH, 8, 8),
            segment(FLASH, FLASH + 0x8_0000 - 4, 8, 8),
            segment(0, 0, 64, 64),
        ] {
            assert!(place(Memories::G474, vec![stray]).is_err());
        }
    }

    #[test]
    fn missing_or_non_elf_image_or_emulated_board_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("image");
        let board = Board::named("nucleo-g474re").expect("known");
        let read = || Image::read(board, &path).expect_err("no image").to_string();
        assert!(read().contains("cannot read"), "{}", read());
        std::fs::write(&path, "not an image").expect("written");
        assert!(read().contains("no 32-bit ELF"), "{}", read());
        let emulated = Board::named("mps2-an386").expect("known");
        let error = Image::read(emulated, &path).expect_err("no chip");
        assert!(matches!(error, ImageError::Emulated(_)));
    }
}
