//! Strips and tiles that are too large to be decompressed for each read: they are decompressed
//! once, into a file without a name, which exists as long as the program, and read there row by
//! row.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::{Range, RangeInclusive};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::index::Chunk;
use crate::RasterError;
use crate::decoder_panic::guarded;
use crate::disk_cache::{DiskCache, TemporaryFile};
use crate::input::read_exact_at;

/// Size of a write, bytes.
const WRITE_BYTES: usize = 1 << 20;

/// Receives the rows of a strip or tile, in order.
pub(super) type RowSink<'s> = dyn FnMut(&[u8]) -> Result<(), RasterError> + 's;

/// Decompressed strips or tiles of an image.
pub(super) struct Unpacked {
    unnamed: TemporaryFile,
    /// Number of slots in the file.
    count: u64,
    /// Size of a slot, bytes.
    slot_bytes: u64,
    state: Mutex<SlotTable>,
    /// Locked during decompression.
    unpack_lock: Mutex<()>,
}

/// Content of the file.
struct SlotTable {
    /// The strip or tile in each slot.
    slots: Vec<Option<Slot>>,
    /// Number of reads so far.
    reads: u64,
}

/// A decompressed strip or tile.
struct Slot {
    /// Its offset in the TIFF, and its number of rows.
    chunk_id: (u64, u32),
    /// Number of decompressed bytes, and the fault of the others.
    bytes: u64,
    fault: Option<String>,
    /// `reads` at its last use.
    used: u64,
}

impl Unpacked {
    /// Creates an empty file for strips or tiles of `slot_bytes` bytes: as many as the bound of the
    /// cache allows, within `counts`.
    ///
    /// # Errors
    /// The reason why there is no space for them.
    pub(super) fn new(
        slot_bytes: u64,
        counts: RangeInclusive<u64>,
        disk: &DiskCache,
    ) -> io::Result<Self> {
        let count = (disk.max_bytes() / slot_bytes.max(1)).clamp(*counts.start(), *counts.end());
        let unnamed = disk.create_unnamed(slot_bytes.saturating_mul(count))?;
        let slots = (0..count).map(|_| None).collect();
        Ok(Self {
            unnamed,
            count,
            slot_bytes,
            state: Mutex::new(SlotTable { slots, reads: 0 }),
            unpack_lock: Mutex::new(()),
        })
    }

    /// Returns its max size on disk, bytes.
    pub(super) const fn max_bytes(&self) -> u64 {
        self.slot_bytes.saturating_mul(self.count)
    }

    /// Returns a byte range of a strip or tile. `unpack` decompresses its rows.
    pub(super) fn read(
        &self,
        chunk: &Chunk,
        range: Range<u64>,
        unpack: impl FnOnce(&mut RowSink<'_>) -> Result<(), RasterError>,
    ) -> Result<Vec<u8>, RasterError> {
        if let Some(read) = self.read_unpacked(chunk, &range) {
            return read;
        }
        let unpack_lock = self.unpack_lock.lock();
        // The panics of decoders are caught.
        let _guard = unpack_lock.unwrap_or_else(PoisonError::into_inner);
        // The previous owner of the lock may have decompressed it.
        if let Some(read) = self.read_unpacked(chunk, &range) {
            return read;
        }
        let index = self.state().evict_oldest();
        let slot = self.unpack(chunk, self.slot_bytes * index as u64, unpack);
        self.state().slots[index] = Some(slot);
        let read = self.read_unpacked(chunk, &range);
        read.unwrap_or_else(|| Err(RasterError::damaged("TIFF: nothing was unpacked")))
    }

    /// Returns true if a strip or tile is already decompressed.
    #[cfg(test)]
    pub(super) fn has(&self, chunk: &Chunk) -> bool {
        self.state().find(chunk).is_some()
    }

    /// Returns the bytes if they are already decompressed.
    fn read_unpacked(
        &self,
        chunk: &Chunk,
        range: &Range<u64>,
    ) -> Option<Result<Vec<u8>, RasterError>> {
        // Locked until the bytes are read, so that the slot is not reused.
        let mut state = self.state();
        let index = state.find(chunk)?;
        state.reads += 1;
        let reads = state.reads;
        let slot = state.slots[index].as_mut()?;
        slot.used = reads;
        if range.end > slot.bytes {
            let why = slot.fault.as_deref().unwrap_or("TIFF: a row too many");
            return Some(Err(RasterError::damaged(why)));
        }
        let mut bytes = vec![0; (range.end - range.start) as usize];
        let place = self.slot_bytes * index as u64 + range.start;
        let read = read_exact_at(&self.unnamed.file, &mut bytes, place);
        let read = read.map_err(|error| RasterError::from_io(error, "the unpacked samples"));
        Some(read.map(|()| bytes))
    }

    /// Writes the rows of a strip or tile to a slot. After an error, the rows before it and the
    /// fault are stored, and there is no retry.
    fn unpack(
        &self,
        chunk: &Chunk,
        place: u64,
        unpack: impl FnOnce(&mut RowSink<'_>) -> Result<(), RasterError>,
    ) -> Slot {
        let no_room = |error: io::Error| {
            let megabytes = self.slot_bytes.div_ceil(1_000_000);
            RasterError::Damaged(format!(
                "TIFF: {megabytes} MB could not be unpacked into the folder of --cache: {error}"
            ))
        };
        let mut bytes = 0;
        let done = guarded(super::FORMAT.name, || {
            let file = &self.unnamed.file;
            let mut to = BufWriter::with_capacity(WRITE_BYTES, OffsetWriter { file, place });
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
            chunk_id: (chunk.place, chunk.covers.rows),
            bytes,
            fault: done.err().map(|fault| match fault {
                RasterError::Damaged(what) => what,
                fault => fault.to_string(),
            }),
            used: 0,
        }
    }

    fn state(&self) -> MutexGuard<'_, SlotTable> {
        // No code that panics runs while the lock is held.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SlotTable {
    /// Returns the slot of a strip or tile.
    fn find(&self, chunk: &Chunk) -> Option<usize> {
        let chunk_id = (chunk.place, chunk.covers.rows);
        let is_same =
            |slot: &Option<Slot>| slot.as_ref().is_some_and(|slot| slot.chunk_id == chunk_id);
        self.slots.iter().position(is_same)
    }

    /// Empties a free slot or the least recently used one, and returns it.
    fn evict_oldest(&mut self) -> usize {
        let used = |index: &usize| self.slots[*index].as_ref().map_or(0, |slot| slot.used);
        let oldest = (0..self.slots.len()).min_by_key(used).unwrap_or(0);
        self.slots[oldest] = None;
        oldest
    }
}

/// Writes at an offset of a file, independent of concurrent reads.
struct OffsetWriter<'f> {
    file: &'f File,
    place: u64,
}

impl Write for OffsetWriter<'_> {
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
