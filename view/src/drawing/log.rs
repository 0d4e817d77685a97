//! Entries of the log in rerun's format.

use anyhow::{Context as _, Result};
use re_chunk::{Chunk, RowId, TimeColumn};
use re_log_types::{
    EntityPath, LogMsg, SetStoreInfo, StoreId, StoreInfo, StoreKind, StoreSource, TimeInt,
    TimePoint, Timeline,
};
use re_sdk_types::{AsComponents, SerializedComponentColumn};

/// The viewer's name for recordings and layouts of this program.
pub const APPLICATION: &str = "hapterra";
/// The timeline: the device's time since the beginning.
pub const TIMELINE: &str = "time";

/// An entry of the log.
pub struct Entry {
    /// Key of entries that replace each other; `None` for events.
    pub key: Option<String>,
    /// The entry.
    pub message: LogMsg,
}

/// Makes entries of one recording.
pub(super) struct Log {
    store: StoreId,
}

impl Log {
    pub(super) fn new() -> Self {
        Self {
            store: StoreId::random(StoreKind::Recording, APPLICATION),
        }
    }

    /// Returns the recording's first entry.
    pub(super) fn opened(&self) -> Entry {
        Entry {
            // Sorts before all others, for a page that connects later.
            key: Some(" opened".into()),
            message: opened(&self.store),
        }
    }

    /// Returns a static state of an entity, valid until the same `part` of it is sent again.
    pub(super) fn log_static(
        &self,
        entity: &str,
        part: &str,
        what: &dyn AsComponents,
    ) -> Result<Entry> {
        let message = one(&self.store, entity, TimePoint::STATIC, what)?;
        Ok(Entry {
            key: Some(format!("{entity} {part}")),
            message,
        })
    }

    /// Returns a state of an entity from a time on, s.
    pub(super) fn at(&self, entity: &str, t_s: f64, what: &dyn AsComponents) -> Result<Entry> {
        let time = TimeInt::new_temporal(nanoseconds(t_s));
        let at = TimePoint::default().with(Timeline::new_duration(TIMELINE), time);
        Ok(Entry {
            key: None,
            message: one(&self.store, entity, at, what)?,
        })
    }

    /// Returns the states of an entity at times, s, one row of each column a time.
    pub(super) fn log_timed(
        &self,
        entity: &str,
        times_s: &[f64],
        columns: impl IntoIterator<Item = SerializedComponentColumn>,
    ) -> Result<Entry> {
        let times = times_s.iter().map(|t_s| nanoseconds(*t_s));
        let times = TimeColumn::new_duration_nanos(TIMELINE, times);
        let columns = columns
            .into_iter()
            .map(|column| (column.descriptor, column.list_array));
        let chunk = Chunk::from_columns(EntityPath::from(entity), [times], columns);
        Ok(Entry {
            key: None,
            message: arrow(&self.store, chunk.context("an entry over time")?)?,
        })
    }
}

/// Converts a time to the viewer's unit.
pub(super) fn nanoseconds(t_s: f64) -> i64 {
    (t_s * 1e9).round() as i64
}

/// Returns the first entry of a store.
pub(super) fn opened(store: &StoreId) -> LogMsg {
    let source = StoreSource::Other("hapterra-view".into());
    LogMsg::SetStoreInfo(SetStoreInfo {
        row_id: *RowId::new(),
        info: StoreInfo::new(store.clone(), source),
    })
}

/// Returns one row of an entity.
pub(super) fn one(
    store: &StoreId,
    entity: &str,
    at: TimePoint,
    what: &dyn AsComponents,
) -> Result<LogMsg> {
    let chunk = Chunk::builder(EntityPath::from(entity))
        .with_archetype(RowId::new(), at, what)
        .build();
    arrow(store, chunk.context("an entry that stands")?)
}

fn arrow(store: &StoreId, chunk: Chunk) -> Result<LogMsg> {
    let message = chunk.to_arrow_msg().context("an entry of the log")?;
    Ok(LogMsg::ArrowMsg(store.clone(), message))
}
