//! What happened, put together: half a second of an entity as one entry.
//!
//! The viewer takes about a millisecond for each entry that it is told, however small. A page
//! that comes late, and one that is drawn by software, are told the same rows in a tenth of
//! the entries.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use re_chunk::{Chunk, TimelineName};
use re_log_types::{AbsoluteTimeRange, EntityPath, LogMsg, StoreId};

use crate::drawing::TIMELINE;

/// What is put together spans so much of the device's time, ns.
const SPAN_NS: u64 = 500_000_000;
/// Or so many entries, where the device's time stands still.
const MOST: usize = 1000;

/// Entries that wait for others.
#[derive(Default)]
pub(super) struct Gather {
    waiting: BTreeMap<EntityPath, Vec<(StoreId, Chunk)>>,
    count: usize,
    /// From the first to the last of them.
    span: Option<AbsoluteTimeRange>,
}

impl Gather {
    /// Takes entries that happened; gives those that are put together now.
    pub(super) fn take<'m>(
        &mut self,
        entries: impl IntoIterator<Item = &'m LogMsg>,
    ) -> Result<Vec<LogMsg>> {
        for entry in entries {
            // What happened is nothing but rows.
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
        let is_long = self.span.is_some_and(|span| span.abs_length() >= SPAN_NS);
        match is_long || self.count >= MOST {
            true => self.rest(),
            false => Ok(Vec::new()),
        }
    }

    /// Gives all that waits.
    pub(super) fn rest(&mut self) -> Result<Vec<LogMsg>> {
        let Self { waiting, .. } = std::mem::take(self);
        let mut together = Vec::new();
        for (store, chunk) in waiting.into_values().flat_map(joined) {
            let rows = chunk.to_arrow_msg().context("entries put together")?;
            together.push(LogMsg::ArrowMsg(store, rows));
        }
        Ok(together)
    }
}

/// Chunks of one entity, those of the same columns as one.
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
