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
const MAX: usize = 1000;

/// A piece of the events.
pub(super) struct Piece {
    pub(super) blob: Blob,
    entries: Vec<LogMsg>,
}

impl Piece {
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
pub(super) struct Gather {
    /// Minimum span of a piece in the device's time, ns.
    least_ns: u64,
    pieces: Vec<Blob>,
    waiting: BTreeMap<EntityPath, Vec<(StoreId, Chunk)>>,
    count: usize,
    /// Time from the first to the last of them.
    span: Option<AbsoluteTimeRange>,
}

impl Gather {
    /// Creates a gatherer for pieces of `span_s` of the device's time.
    pub(super) fn new(span_s: u32) -> Self {
        Self {
            least_ns: u64::from(span_s) * 1_000_000_000,
            pieces: Vec::new(),
            waiting: BTreeMap::new(),
            count: 0,
            span: None,
        }
    }

    /// Returns the pieces of the waiting entries.
    pub(super) fn pieces(&self) -> &[Blob] {
        &self.pieces
    }

    /// Adds a piece of events; returns the joined piece if one is complete.
    pub(super) fn take(&mut self, piece: &Piece) -> Result<Option<Piece>> {
        self.pieces.push(Blob::clone(&piece.blob));
        for entry in &piece.entries {
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
            .is_some_and(|span| span.abs_length() >= self.least_ns);
        match is_long || self.count >= MAX {
            true => self.rest(),
            false => Ok(None),
        }
    }

    /// Returns all waiting entries as one piece.
    pub(super) fn rest(&mut self) -> Result<Option<Piece>> {
        (self.count, self.span) = (0, None);
        self.pieces.clear();
        let mut together = Vec::new();
        for (store, chunk) in std::mem::take(&mut self.waiting)
            .into_values()
            .flat_map(joined)
        {
            let rows = chunk.to_arrow_msg().context("entries put together")?;
            together.push(LogMsg::ArrowMsg(store, rows));
        }
        Piece::of(together)
    }
}

/// Joins the chunks of each entity with the same columns.
fn joined(chunks: Vec<(StoreId, Chunk)>) -> Vec<(StoreId, Chunk)> {
    let mut joined: Vec<(StoreId, Chunk)> = Vec::new();
    for (store, chunk) in chunks {
        let before = joined.last_mut().map(|(_, before)| before);
        let before = before.filter(|before| before.concatenable(&chunk));
        let both = before.map(|before| (Chunk::concat_and_sort(before, &chunk), before));
        match both {
            Some((Ok(both), before)) => *before = both,
            _ => joined.push((store, chunk)),
        }
    }
    joined
}
