//! A look at the image directories before the decoder does.
//!
//! The decoder makes room for as many values as a directory entry claims to have.
//! An entry whose values cannot be in the file is found here, where it can be
//! named, and the decoder is not asked.

use std::io::{self, Read, Seek, SeekFrom};

use crate::raster::Fault;

/// Directories to look through; more than that is a chain that bites its tail.
const MOST: usize = 64;

/// Entries a directory can have: one for each tag there is.
const MOST_ENTRIES: u64 = 65_535;

/// The tags that the decoder reads, and those of GeoTIFF and GDAL. Others may be
/// as wrong as they like.
const READ_TAGS: [u64; 27] = [
    254, 256, 257, 258, 259, 262, 273, 277, 278, 279, 284, 317, 322, 323, 324, 325, 338, 339, 347,
    530, 33_550, 33_922, 34_264, 34_735, 34_736, 42_112, 42_113,
];

/// Counts the leading directories that are sound.
///
/// # Errors
/// When the first, or the way to it, is not.
pub(super) fn sound(reader: &mut (impl Read + Seek), file_bytes: u64) -> Result<usize, Fault> {
    let mut file = Directories::open(reader, file_bytes)?;
    let mut offset = file.first_offset()?;
    for count in 0..MOST {
        match file.check(offset) {
            Err(fault) if count == 0 => return Err(fault),
            Err(_) => return Ok(count),
            Ok(0) => return Ok(count + 1),
            Ok(next) => offset = next,
        }
    }
    Ok(MOST)
}

/// Where in the file the value of a short tag of one of the sound directories is.
///
/// # Errors
/// When the file cannot be read.
pub(super) fn value_place(
    reader: &mut (impl Read + Seek),
    file_bytes: u64,
    directory: usize,
    wanted: u64,
) -> Result<Option<u64>, Fault> {
    let mut file = Directories::open(reader, file_bytes)?;
    let mut offset = file.first_offset()?;
    for _ in 0..directory {
        offset = file.check(offset)?;
    }
    file.place_of(offset, wanted)
}

struct Directories<'r, R> {
    reader: &'r mut R,
    file_bytes: u64,
    big_endian: bool,
    /// Offsets and counts have 8 bytes instead of 4.
    big: bool,
}

impl<'r, R: Read + Seek> Directories<'r, R> {
    fn open(reader: &'r mut R, file_bytes: u64) -> Result<Self, Fault> {
        let mut magic = [0; 4];
        reader.read_exact(&mut magic).map_err(header_fault)?;
        Ok(Self {
            reader,
            file_bytes,
            big_endian: magic[0] == b'M',
            big: magic.contains(&43),
        })
    }

    fn number(&mut self, bytes: usize) -> io::Result<u64> {
        let mut buffer = [0; 8];
        let (number, _) = buffer.split_at_mut(bytes);
        self.reader.read_exact(number)?;
        Ok(if self.big_endian {
            number
                .iter()
                .fold(0, |all, &byte| all << 8 | u64::from(byte))
        } else {
            u64::from_le_bytes(buffer)
        })
    }

    /// Where the first directory is, from the file's header.
    fn first_offset(&mut self) -> Result<u64, Fault> {
        let at = if self.big { 8 } else { 4 };
        let width = if self.big { 8 } else { 4 };
        self.reader
            .seek(SeekFrom::Start(at))
            .and_then(|_| self.number(width))
            .map_err(header_fault)
    }

    /// Checks a directory, and says where the next is; 0 after the last.
    fn check(&mut self, offset: u64) -> Result<u64, Fault> {
        if offset >= self.file_bytes {
            return Err(Fault::Truncated(format!(
                "its directory should be at byte {offset}, the file has {}",
                self.file_bytes
            )));
        }
        self.reader
            .seek(SeekFrom::Start(offset))
            .map_err(header_fault)?;
        let (count_width, width) = if self.big { (8, 8) } else { (2, 4) };
        let entries = self.number(count_width).map_err(header_fault)?;
        if entries > MOST_ENTRIES {
            return Err(Fault::AbsurdSize(format!("a directory of {entries} tags")));
        }
        for _ in 0..entries {
            let tag = self.number(2).map_err(header_fault)?;
            let kind = self.number(2).map_err(header_fault)?;
            let values = self.number(width).map_err(header_fault)?;
            let place = self.number(width).map_err(header_fault)?;
            self.check_values(tag, kind, values, place)?;
        }
        self.number(width).map_err(header_fault)
    }

    /// Where a directory holds the value of a tag that needs no more room than the
    /// entry has.
    fn place_of(&mut self, offset: u64, wanted: u64) -> Result<Option<u64>, Fault> {
        self.reader
            .seek(SeekFrom::Start(offset))
            .map_err(header_fault)?;
        let (count_width, width) = if self.big { (8, 8) } else { (2, 4) };
        let entries = self.number(count_width).map_err(header_fault)?;
        for _ in 0..entries.min(MOST_ENTRIES) {
            let tag = self.number(2).map_err(header_fault)?;
            self.number(2).map_err(header_fault)?;
            self.number(width).map_err(header_fault)?;
            let place = self.reader.stream_position().map_err(header_fault)?;
            self.number(width).map_err(header_fault)?;
            if tag == wanted {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }

    /// The values of an entry that is read must lie inside the file.
    fn check_values(&self, tag: u64, kind: u64, values: u64, place: u64) -> Result<(), Fault> {
        if !READ_TAGS.contains(&tag) {
            return Ok(());
        }
        let in_entry: u64 = if self.big { 8 } else { 4 };
        let bytes = u128::from(values) * value_bytes(kind);
        if bytes <= u128::from(in_entry) {
            return Ok(());
        }
        if bytes > u128::from(self.file_bytes) {
            return Err(Fault::AbsurdSize(format!(
                "tag {tag} has {values} values, the file {} bytes",
                self.file_bytes
            )));
        }
        if u128::from(place) + bytes > u128::from(self.file_bytes) {
            return Err(Fault::Truncated(format!(
                "the {values} values of tag {tag} should be at byte {place}, the file has {}",
                self.file_bytes
            )));
        }
        Ok(())
    }
}

/// Bytes that a value of a type takes; unknown types count as one.
fn value_bytes(kind: u64) -> u128 {
    match kind {
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16 | 17 | 18 => 8,
        _ => 1,
    }
}

fn header_fault(error: io::Error) -> Fault {
    Fault::from_io(error, "the TIFF's directory")
}
