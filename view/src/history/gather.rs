//! Gathering of events: a time span of an entity as one entry.
//!
//! The viewer needs about a millisecond for each entry, of any size. A page that connects late, and
//! one that is drawn by software, receive the same rows in far fewer entries.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use re_chunk::{Chunk, TimelineName};
use re_log_types::{AbsoluteTimeRange, EntityPath, LogMsg, StoreId};

use super::{Blob, encoded};
use crate::drawing::TIMELINE;

/// Max entries that are joined: the device's time may stand still.
const MAX_ENTRIES: usize = 1000;

/// A piece of the events.
pub(super) struct Batch {
    pub(super) blob: Blob,
    entries: Vec<LogMsg>,
}

impl Batch {
    /// Creates a piece; `None` without entries.
    pub(super) fn of(entries: Vec<LogMsg>) -> Result<Option<Self>> {
        if entries.is_empty() {
            return Ok(None);
        }
        let blob = encoded(&entries)?;
        Ok(Some(Self { blob, entries }))
    }
}

/// Entries that wait for others, and the pieces in which they arrived.
pub(super) struct Batcher {
    /// Minimum span of a piece in the device's time, ns.
    min_ns: u64,
    batches: Vec<Blob>,
    waiting: BTreeMap<EntityPath, Vec<(StoreId, Chunk)>>,
    count: usize,
    /// Time from the first to the last of them.
    span: Option<AbsoluteTimeRange>,
}

impl Batcher {
    /// Creates a gatherer for pieces of `span_s` of the device's time.
    pub(super) fn new(span_s: u32) -> Self {
        Self {
            min_ns: u64::from(span_s) * 1_000_000_000,
            batches: Vec::new(),
            waiting: BTreeMap::new(),
            count: 0,
            span: None,
        }
    }

    /// Returns the pieces of the waiting entries.
    pub(super) fn batches(&self) -> &[Blob] {
        &self.batches
    }

    /// Adds a piece of events; returns the joined piece if one is complete.
    pub(super) fn add(&mut self, batch: &Batch) -> Result<Option<Batch>> {
        self.batches.push(Blob::clone(&batch.blob));
        for entry in &batch.entries {
            // Events consist only of rows.
            let LogMsg::ArrowMsg(store, rows) = entry else {
                continue;
            };
            let chunk = Chunk::from_arrow_msg(rows).context("an entry to put together")?;
            let times = chunk
                .timelines()
                .get(&TimelineName::from_static_str(TIMELINE));
            self.span = match (self.span, times.map(|times| times.time_range())) {
                (Some(span), Some(times)) => Some(span.union(times)),
                (span, times) => span.or(times),
            };
            let of_entity = self.waiting.entry(chunk.entity_path().clone());
            of_entity.or_default().push((store.clone(), chunk));
            self.count += 1;
        }
        let is_long = self
            .span
            .is_some_and(|span| span.abs_length() >= self.min_ns);
        match is_long || self.count >= MAX_ENTRIES {
            true => self.flush(),
            false => Ok(None),
        }
    }

    /// Returns all waiting entries as one piece.
    pub(super) fn flush(&mut self) -> Result<Option<Batch>> {
        (self.count, self.span) = (0, None);
        self.batches.clear();
        let mut joined_batch = Vec::new();
        for (store, chunk) in std::mem::take(&mut self.waiting)
            .into_values()
            .flat_map(joined)
        {
            let rows = chunk.to_arrow_msg().context("entries put together")?;
            joined_batch.push(LogMsg::ArrowMsg(store, rows));
        }
        Batch::of(joined_batch)
    }
}

/// Joins the chunks of each entity with the same columns.
fn joined(chunks: Vec<(StoreId, Chunk)>) -> Vec<(StoreId, Chunk)> {
    let mut joined: Vec<(StoreId, Chunk)> = Vec::new();
    for (store, chunk) in chunks {
        let previous = joined.last_mut().map(|(_, previous)| previous);
        let previous = previous.filter(|previous| previous.concatenable(&chunk));
        let both = previous.map(|previous| (Chunk::concat_and_sort(previous, &chunk), previous));
        match both {
            Some((Ok(both), previous)) => *previous = both,
            _ => joined.push((store, chunk)),
        }
    }
    joined
}
