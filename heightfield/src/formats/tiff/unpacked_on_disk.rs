//! Strips and tiles that are too large to be unpacked each time: unpacked once, into a file
//! without a name that goes with the program, and read there row by row.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::{Range, RangeInclusive};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::index::Chunk;
use crate::RasterError;
use crate::decoder_panic::guarded;
use crate::disk_cache::{DiskCache, TemporaryFile};
use crate::input::read_exact_at;

/// Bytes that are written at once.
const AT_ONCE: usize = 1 << 20;

/// Takes the rows of a strip or tile, one after the other.
pub(super) type RowSink<'s> = dyn FnMut(&[u8]) -> Result<(), RasterError> + 's;

/// Unpacked strips or tiles of an image.
pub(super) struct Unpacked {
    unnamed: TemporaryFile,
    /// Places in it.
    count: u64,
    /// Bytes that one takes.
    each: u64,
    kept: Mutex<Kept>,
    /// Held during an unpacking.
    turn: Mutex<()>,
}

/// Content of the file.
struct Kept {
    /// The strip or tile at each place of the file.
    slots: Vec<Option<Slot>>,
    /// Number of times that something was asked for.
    asked: u64,
}

/// A strip or tile that was unpacked.
struct Slot {
    /// Its offset in the TIFF, and the number of wanted rows.
    is_of: (u64, u32),
    /// Number of bytes that are here, and what is wrong with the others.
    bytes: u64,
    fault: Option<String>,
    /// When it was asked for last.
    used: u64,
}

impl Unpacked {
    /// An empty file for strips or tiles of `each` bytes: as many as the bound of the cache allows,
    /// within `counts`.
    ///
    /// # Errors
    /// The reason for which there is no room for them.
    pub(super) fn new(
        each: u64,
        counts: RangeInclusive<u64>,
        disk: &DiskCache,
    ) -> io::Result<Self> {
        let count = (disk.most_bytes() / each.max(1)).clamp(*counts.start(), *counts.end());
        let unnamed = disk.file_without_name(each.saturating_mul(count))?;
        let slots = (0..count).map(|_| None).collect();
        Ok(Self {
            unnamed,
            count,
            each,
            kept: Mutex::new(Kept { slots, asked: 0 }),
            turn: Mutex::new(()),
        })
    }

    /// Bytes that it takes on disk at most.
    pub(super) const fn most_bytes(&self) -> u64 {
        self.each.saturating_mul(self.count)
    }

    /// Bytes of a strip or tile, counted from its first one. `unpack` hands over its rows.
    pub(super) fn read(
        &self,
        chunk: &Chunk,
        range: Range<u64>,
        unpack: impl FnOnce(&mut RowSink<'_>) -> Result<(), RasterError>,
    ) -> Result<Vec<u8>, RasterError> {
        if let Some(read) = self.read_kept(chunk, &range) {
            return read;
        }
        let turn = self.turn.lock();
        // The panics of decoders are caught.
        let _turn = turn.unwrap_or_else(PoisonError::into_inner);
        // It may have been unpacked by the one who had the turn before.
        if let Some(read) = self.read_kept(chunk, &range) {
            return read;
        }
        let index = self.kept().leave_oldest();
        let slot = self.unpack(chunk, self.each * index as u64, unpack);
        self.kept().slots[index] = Some(slot);
        let read = self.read_kept(chunk, &range);
        read.unwrap_or_else(|| Err(RasterError::damaged("TIFF: nothing was unpacked")))
    }

    /// Returns true if a strip or tile is unpacked already.
    #[cfg(test)]
    pub(super) fn has(&self, chunk: &Chunk) -> bool {
        self.kept().find(chunk).is_some()
    }

    /// The same bytes of what is unpacked already.
    fn read_kept(&self, chunk: &Chunk, range: &Range<u64>) -> Option<Result<Vec<u8>, RasterError>> {
        // Is held until the bytes are read: another may want the place for something else.
        let mut kept = self.kept();
        let index = kept.find(chunk)?;
        kept.asked += 1;
        let asked = kept.asked;
        let slot = kept.slots[index].as_mut()?;
        slot.used = asked;
        if range.end > slot.bytes {
            let why = slot.fault.as_deref().unwrap_or("TIFF: a row too many");
            return Some(Err(RasterError::damaged(why)));
        }
        let mut bytes = vec![0; (range.end - range.start) as usize];
        let place = self.each * index as u64 + range.start;
        let read = read_exact_at(&self.unnamed.file, &mut bytes, place);
        let read = read.map_err(|error| RasterError::from_io(error, "what was unpacked"));
        Some(read.map(|()| bytes))
    }

    /// Writes the rows of a strip or tile to a place; after an error those before it. The fault is
    /// kept, and the strip or tile is not tried again.
    fn unpack(
        &self,
        chunk: &Chunk,
        place: u64,
        unpack: impl FnOnce(&mut RowSink<'_>) -> Result<(), RasterError>,
    ) -> Slot {
        let no_room = |error: io::Error| {
            let megabytes = self.each.div_ceil(1_000_000);
            RasterError::Damaged(format!(
                "TIFF: {megabytes} MB could not be unpacked into the folder of --cache: {error}"
            ))
        };
        let mut bytes = 0;
        let done = guarded(super::FORMAT.name, || {
            let file = &self.unnamed.file;
            let mut to = BufWriter::with_capacity(AT_ONCE, Placed { file, place });
            let mut count = 0;
            let unpacked = unpack(&mut |row| {
                to.write_all(row).map_err(no_room)?;
                count += row.len() as u64;
                Ok(())
            });
            to.flush().map_err(no_room)?;
            bytes = count;
            unpacked
        });
        Slot {
            is_of: (chunk.place, chunk.covers.rows),
            bytes,
            fault: done.err().map(|fault| match fault {
                RasterError::Damaged(what) => what,
                fault => fault.to_string(),
            }),
            used: 0,
        }
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        // Nothing that panics runs while this is held.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    /// The place of a strip or tile.
    fn find(&self, chunk: &Chunk) -> Option<usize> {
        let is_of = (chunk.place, chunk.covers.rows);
        let known = |slot: &Option<Slot>| slot.as_ref().is_some_and(|slot| slot.is_of == is_of);
        self.slots.iter().position(known)
    }

    /// The place that is free, or was asked for longest ago: nothing is there from now on.
    fn leave_oldest(&mut self) -> usize {
        let used = |index: &usize| self.slots[*index].as_ref().map_or(0, |slot| slot.used);
        let oldest = (0..self.slots.len()).min_by_key(used).unwrap_or(0);
        self.slots[oldest] = None;
        oldest
    }
}

/// Writes from a place of a file on, wherever others read meanwhile.
struct Placed<'f> {
    file: &'f File,
    place: u64,
}

impl Write for Placed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = write_at(self.file, bytes, self.place)?;
        self.place += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(unix)]
fn write_at(file: &File, bytes: &[u8], place: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::write_at(file, bytes, place)
}

#[cfg(windows)]
fn write_at(file: &File, bytes: &[u8], place: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_write(file, bytes, place)
}

#[cfg(test)]
#[path = "unpacked_on_disk_tests.rs"]
mod tests;
