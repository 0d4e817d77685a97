//! A field of a stated formula, read in blocks.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::cache::MAX_BYTES;
use super::*;
use crate::decoded::Decoded;
use crate::storage::Storage;
use crate::{OpenOptions, Raster};

const SIZE: [u32; 2] = [1000, 700];
const BLOCK: [u32; 2] = [64, 48];

/// A full image, and an overview of every fourth sample in both directions. One block of the full
/// image is not stored, and one cannot be read.
struct Field {
    images: Vec<BlockImage>,
    /// Number of samples that were read.
    read: Arc<AtomicU64>,
    /// True if one block cannot be read.
    fault: bool,
}

fn plane(column: f64, row: f64) -> f64 {
    3.0 * column - 2.0 * row
}

fn image(size: [u32; 2]) -> BlockImage {
    BlockImage {
        columns: size[0],
        rows: size[1],
        block: BLOCK,
        every: None,
        first: [0; 2],
    }
}

impl Field {
    fn new() -> (Self, Arc<AtomicU64>) {
        let read = Arc::new(AtomicU64::new(0));
        let field = Self {
            images: vec![image(SIZE), image(SIZE.map(|count| count / 4))],
            read: read.clone(),
            fault: true,
        };
        (field, read)
    }
}

impl BlockReader for Field {
    fn format(&self) -> &'static str {
        "test"
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        SampleType::F64
    }

    fn is_stored(&self, image: usize, part: &Part) -> bool {
        !(self.fault && image == 0 && (part.column, part.row) == (64, 0))
    }

    fn read(&self, image: usize, part: &Part) -> Result<Block, RasterError> {
        if self.fault && image == 0 && (part.column, part.row) == (0, 48) {
            return Err(RasterError::Damaged("test".into()));
        }
        if self.fault && image == 0 && (part.column, part.row) == (64, 48) {
            panic!("a decoder's");
        }
        let count = u64::from(part.columns) * u64::from(part.rows);
        self.read.fetch_add(count, Ordering::Relaxed);
        let times = if image == 0 { 1.0 } else { 4.0 };
        let at = |index: u32| f64::from(index) * times + 0.5 * (times - 1.0);
        let samples: Vec<f64> = (part.row..part.row + part.rows)
            .flat_map(|row| (part.column..part.column + part.columns).map(move |c| (c, row)))
            .map(|(column, row)| plane(at(column), at(row)))
            .collect();
        Ok(Block {
            samples: samples.into(),
            no_data_mask: None,
            is_incomplete: false,
        })
    }

    fn index(&self) -> u64 {
        7
    }
}

fn raster(field: Field, south_up: bool, east_first: bool) -> Raster {
    let size = (field.images[0].columns, field.images[0].rows);
    let mut decoded = Decoded::new("test".into(), size, Storage::from(field));
    decoded.south_up = south_up;
    decoded.east_first = east_first;
    Raster::checked(decoded, None).expect("a field")
}

#[test]
fn read_fetches_only_its_block_once() {
    let (field, read) = Field::new();
    let raster = raster(field, true, false);
    let survey = read.swap(0, Ordering::Relaxed);
    assert_eq!(survey, 250 * 175, "the overview, all of it");
    assert_eq!(raster.summary().examined, survey);
    assert!(!raster.is_summary_complete());
    for _ in 0..2 {
        assert_eq!(raster.height(300, 200), plane(300.0, 200.0));
        assert_eq!(raster.height(301, 210), plane(301.0, 210.0));
    }
    assert_eq!(read.load(Ordering::Relaxed), 64 * 48);
    // The last blocks are smaller.
    assert_eq!(raster.height(999, 699), plane(999.0, 699.0));
    assert!(raster.height(1000, 699).is_nan());
    assert!(raster.height(999, 700).is_nan());
}

#[test]
fn missing_or_damaged_blocks_are_no_data() {
    let (field, _) = Field::new();
    let raster = raster(field, true, false);
    for (column, row, is_no_data) in [
        (64, 0, true),
        (127, 47, true),
        (0, 48, true),
        (63, 95, true),
        (64, 48, true),
        (63, 47, false),
        (128, 48, false),
        (128, 0, false),
        (0, 96, false),
    ] {
        assert_eq!(
            raster.height(column, row).is_nan(),
            is_no_data,
            "{column} {row}"
        );
    }
}

#[test]
fn coarse_levels_use_the_overview_in_any_file_orientation() {
    for (south_up, east_first) in [(true, false), (false, false), (true, true), (false, true)] {
        let (mut field, read) = Field::new();
        field.fault = false;
        let raster = raster(field, south_up, east_first);
        read.store(0, Ordering::Relaxed);
        let height = |column: u32, row: u32| {
            let (column, row) = (f64::from(column), f64::from(row));
            let column = if east_first { 999.0 - column } else { column };
            let row = if south_up { row } else { 699.0 - row };
            plane(column, row)
        };
        for level in [2, 3, 5] {
            let mut heights = [0.0; 5];
            assert!(
                raster
                    .read_row(level, 3, 2, &mut heights, Wait::UntilRead)
                    .is_complete()
            );
            for (index, found) in (2..).zip(heights) {
                let expected = height(index << level, 3 << level);
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{level}: {found} {expected}"
                );
            }
        }
        assert!(
            read.load(Ordering::Relaxed) < 250 * 175,
            "no full image was read"
        );
        // Level 1 is finer than the overview.
        assert_eq!(raster.surface(1, [400.0, 200.0]), height(400, 200));
        let before = read.load(Ordering::Relaxed);
        assert!(before >= 64 * 48);
        // Beyond the outermost samples of the overview, its surface is level.
        let corner = raster.surface(2, [0.0, 0.0]);
        assert!((corner - height(0, 0)).abs() <= 3.0 * 1.5 + 2.0 * 1.5);
    }
}

#[test]
fn block_memory_is_bounded() {
    let mut field = Field::new().0;
    let read = field.read.clone();
    field.images = vec![image([20_000, 20_000])];
    let blocks = Blocks::new(Box::new(field));
    for block in 0..20_000 / 64 {
        assert!(
            blocks
                .stored(0, block * 64, 4800, Wait::UntilRead)
                .is_ok_and(|stored| stored.is_some())
        );
        for row in 1..20 {
            let _ = blocks.stored(0, block * 64, 4800 + row * 480, Wait::UntilRead);
        }
    }
    let state = blocks.state.lock().expect("alone");
    assert!(8 * read.load(Ordering::Relaxed) > 2 * MAX_BYTES as u64);
    assert!(state.cache.bytes() <= MAX_BYTES, "{}", state.cache.bytes());
    assert!(state.cache.bytes() > MAX_BYTES / 2);
    drop(state);
    // The block used last is still cached.
    let before = read.load(Ordering::Relaxed);
    let _ = blocks.stored(0, (20_000 / 64 - 1) * 64, 4800 + 19 * 480, Wait::UntilRead);
    assert_eq!(read.load(Ordering::Relaxed), before);
}

/// Concurrent reads of the same field by several threads, as for several devices, each with its own
/// terrain.
#[test]
fn block_is_read_once_for_all_threads() {
    let (mut field, read) = Field::new();
    field.fault = false;
    let raster = raster(field, true, false);
    read.store(0, Ordering::Relaxed);
    let walk = || {
        for row in (0..SIZE[1]).step_by(7) {
            for column in (0..SIZE[0]).step_by(5) {
                let expected = plane(f64::from(column), f64::from(row));
                assert_eq!(raster.height(column, row), expected);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(walk);
        }
    });
    let samples = u64::from(SIZE[0]) * u64::from(SIZE[1]);
    assert_eq!(read.load(Ordering::Relaxed), samples, "each block once");
    let Storage::Blocks(blocks) = &raster.source.storage else {
        panic!("it is read in blocks");
    };
    // The overview was read at opening.
    let overview = samples / 16;
    let cached_bytes = blocks.cache_use().0 as u64;
    assert!(cached_bytes >= 8 * (samples + overview), "{cached_bytes}");
    assert!(
        cached_bytes < 9 * (samples + overview),
        "{cached_bytes}: kept once"
    );
}

/// A field of blocks of one row each; reading the second one waits for the test.
struct Slow {
    images: Vec<BlockImage>,
    started: Arc<std::sync::Barrier>,
    resume: Arc<std::sync::Barrier>,
    is_offline: bool,
}

impl BlockReader for Slow {
    fn format(&self) -> &'static str {
        "test"
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        SampleType::F64
    }

    fn is_stored(&self, _: usize, _: &Part) -> bool {
        true
    }

    fn read(&self, _: usize, part: &Part) -> Result<Block, RasterError> {
        if part.column == BLOCK[0] {
            if self.is_offline {
                return Err(RasterError::Remote(crate::remote::outage()));
            }
            self.started.wait();
            self.resume.wait();
        }
        let count = (part.columns * part.rows) as usize;
        Ok(Block {
            samples: vec![1.0; count].into(),
            no_data_mask: None,
            is_incomplete: false,
        })
    }

    fn index(&self) -> u64 {
        7
    }
}

fn slow(is_offline: bool) -> Slow {
    let barrier = || Arc::new(std::sync::Barrier::new(2));
    Slow {
        images: vec![image([BLOCK[0] * 2, BLOCK[1]])],
        started: barrier(),
        resume: barrier(),
        is_offline,
    }
}

#[test]
fn cached_block_is_read_while_another_block_loads() {
    let field = slow(false);
    let (started, resume) = (field.started.clone(), field.resume.clone());
    let blocks = Blocks::new(Box::new(field));
    assert_eq!(blocks.stored(0, 0, 0, Wait::UntilRead), Ok(Some(1.0)));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            assert_eq!(
                blocks.stored(0, BLOCK[0], 0, Wait::UntilRead),
                Ok(Some(1.0))
            );
        });
        started.wait();
        // The other thread is reading until it gets the signal.
        let is_free = blocks.state.try_lock().is_ok();
        let sample = is_free.then(|| blocks.stored(0, 1, 1, Wait::UntilRead));
        resume.wait();
        assert_eq!(sample, Some(Ok(Some(1.0))));
    });
}

#[test]
fn missing_block_is_reported_at_each_read() {
    let blocks = Blocks::new(Box::new(slow(true)));
    let missing = || blocks.stored(0, BLOCK[0], 0, Wait::UntilRead);
    // The second time, its state is cached.
    assert_eq!((missing(), missing()), (Err(NotLoaded), Err(NotLoaded)));
    assert_eq!(blocks.stored(0, 0, 0, Wait::UntilRead), Ok(Some(1.0)));
}

/// A read that does not wait is repeated until the block arrives: no result lacks its heights.
#[test]
fn only_waiting_reads_report_an_outage() {
    let blocks = Blocks::new(Box::new(slow(true)));
    let missing = |wait| assert_eq!(blocks.stored(0, BLOCK[0], 0, wait), Err(NotLoaded));
    missing(Wait::Never);
    while blocks.is_reading() {
        std::thread::yield_now();
    }
    assert!(blocks.take_outage().is_none());
    missing(Wait::UntilRead);
    assert!(blocks.take_outage().is_some() && blocks.take_outage().is_none());
}

#[test]
fn field_without_any_height_is_refused() {
    let (mut field, _) = Field::new();
    field.fault = false;
    let size = (SIZE[0], SIZE[1]);
    let mut decoded = Decoded::new("test".into(), size, Storage::from(field));
    decoded.scale = f64::MAX;
    // All heights but zero are too large.
    let fault = Raster::checked(decoded, Some(0.0)).expect_err("no height");
    assert!(matches!(fault, RasterError::AllNoData { .. }), "{fault}");
    assert_eq!(OpenOptions::default().max_in_memory_bytes, 128 << 20);
}
