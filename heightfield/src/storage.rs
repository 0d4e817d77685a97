//! Storage of a raster's samples: in memory, or in its file until they are accessed.

use std::path::Path;
use std::sync::Arc;

use super::blocks::{BlockReader, Blocks};
use super::samples::{NoDataMask, SampleType, Samples};
use crate::disk_cache::DiskCache;

/// The samples of a raster, in the file's order and type.
#[derive(Clone, Debug)]
pub(super) enum Storage {
    /// All samples in memory.
    Memory {
        /// `columns × rows` samples, the file's first row first.
        samples: Samples,
        /// No-data that no value marks.
        mask: Option<NoDataMask>,
    },
    /// In the file.
    Blocks(Arc<Blocks>),
}

impl From<Samples> for Storage {
    fn from(samples: Samples) -> Self {
        Self::Memory {
            samples,
            mask: None,
        }
    }
}

impl<R: BlockReader + 'static> From<R> for Storage {
    fn from(reader: R) -> Self {
        Self::Blocks(Arc::new(Blocks::new(Box::new(reader))))
    }
}

impl Storage {
    /// Returns the samples, if all are in memory.
    pub(super) fn in_memory(&self) -> Option<&Samples> {
        match self {
            Self::Memory { samples, .. } => Some(samples),
            Self::Blocks(_) => None,
        }
    }

    /// Returns the type of a sample.
    pub(super) fn sample_type(&self) -> SampleType {
        match self {
            Self::Memory { samples, .. } => samples.sample_type(),
            Self::Blocks(blocks) => blocks.sample_type(),
        }
    }

    /// Sets the file's order; call it before anything is read.
    pub(super) fn set_order(&mut self, south_up: bool, east_first: bool) {
        if let Self::Blocks(blocks) = self
            && let Some(blocks) = Arc::get_mut(blocks)
        {
            blocks.set_order(south_up, east_first);
        }
    }

    /// Sets the folder of coarse samples; call it before anything is read.
    pub(super) fn set_disk_cache(&mut self, disk: &DiskCache) {
        if let Self::Blocks(blocks) = self
            && let Some(blocks) = Arc::get_mut(blocks)
        {
            blocks.set_disk_cache(disk);
        }
    }

    /// Sets the file's name for warnings of later reads.
    pub(super) fn set_path(&self, path: &Path) {
        if let Self::Blocks(blocks) = self {
            blocks.set_path(path);
        }
    }

    /// Marks no-data in samples that are in memory.
    pub(super) fn set_no_data(&mut self, no_data_mask: Option<NoDataMask>) {
        if let Self::Memory { mask, .. } = self {
            *mask = no_data_mask.filter(|no_data_mask| !no_data_mask.is_clear());
        }
    }
}
