//! Coarse levels of a field without overviews, computed from blocks and saved on disk.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::ThreadId;
use std::time::Duration;

use super::coarse::STEPS;
use super::*;
use crate::decoded::Decoded;
use crate::storage::Storage;
use crate::timeouts::{pass, wait_for, wait_until};
use crate::{Raster, Window};

const SIZE: [u32; 2] = [2101, 1250];
const BLOCK: [u32; 2] = [64, 48];
/// Blocks that the file does not store, that cannot be read, and that are pending.
const SPARSE: [u32; 2] = [3, 2];
const BAD: [u32; 2] = [5, 4];
const LATE: [u32; 2] = [7, 6];
const NO_DATA: f64 = -5.0;

fn value(column: u32, row: u32) -> f64 {
    match (column * 31 + row * 17) % 11 {
        0 => NO_DATA,
        1 => f64::NAN,
        _ => f64::from(column) + f64::from(row) * 1e-3,
    }
}

/// State of the reader that a test can inspect.
#[derive(Clone)]
struct ReaderState {
    reads: Arc<AtomicU64>,
    threads: Arc<Mutex<Vec<ThreadId>>>,
    is_damaged: Arc<AtomicBool>,
    is_late: Arc<AtomicBool>,
    stamp: Arc<Mutex<Option<String>>>,
}

impl ReaderState {
    fn new(stamp: &str) -> Self {
        Self {
            reads: Arc::default(),
            threads: Arc::default(),
            is_damaged: Arc::default(),
            is_late: Arc::default(),
            stamp: Arc::new(Mutex::new(Some(stamp.into()))),
        }
    }

    fn reads(&self) -> u64 {
        self.reads.swap(0, Ordering::Relaxed)
    }
}

struct Full {
    images: Vec<BlockImage>,
    reader_state: ReaderState,
}

impl BlockReader for Full {
    fn format(&self) -> &'static str {
        "test"
    }

    fn images(&self) -> &[BlockImage] {
        &self.images
    }

    fn sample_type(&self) -> SampleType {
        SampleType::F64
    }

    fn is_stored(&self, _: usize, part: &Part) -> bool {
        [part.column / BLOCK[0], part.row / BLOCK[1]] != SPARSE
    }

    fn read(&self, _: usize, part: &Part) -> Result<Block, RasterError> {
        let at = [part.column / BLOCK[0], part.row / BLOCK[1]];
        self.reader_state.reads.fetch_add(1, Ordering::Relaxed);
        self.reader_state
            .threads
            .lock()
            .expect("alone")
            .push(thread::current().id());
        if at == BAD && self.reader_state.is_damaged.load(Ordering::Relaxed) {
            return Err(RasterError::Damaged("test".into()));
        }
        if at == LATE && self.reader_state.is_late.load(Ordering::Relaxed) {
            return Err(RasterError::Remote(crate::remote::outage()));
        }
        let rows = part.row..part.row + part.rows;
        let samples: Vec<f64> = rows
            .flat_map(|row| (part.column..part.column + part.columns).map(move |c| value(c, row)))
            .collect();
        Ok(Block {
            samples: samples.into(),
            no_data_mask: None,
            is_incomplete: false,
        })
    }

    fn stamp(&self, _: usize, _: &Part) -> Option<String> {
        self.reader_state.stamp.lock().expect("alone").clone()
    }

    fn survey_parts(&self) -> Option<SurveyParts> {
        // One part is enough to find a height.
        let parts = vec![Part::whole(2, 2)];
        Some(SurveyParts { image: 0, parts })
    }

    fn index(&self) -> u64 {
        7
    }
}

fn raster(
    reader_state: &ReaderState,
    disk: &DiskCache,
    [south_up, east_first]: [bool; 2],
) -> Raster {
    let full = BlockImage {
        columns: SIZE[0],
        rows: SIZE[1],
        block: BLOCK,
        every: None,
        first: [0; 2],
    };
    let reader = Full {
        images: vec![full],
        reader_state: reader_state.clone(),
    };
    let mut decoded = Decoded::new("test".into(), (SIZE[0], SIZE[1]), Storage::from(reader));
    (decoded.south_up, decoded.east_first) = (south_up, east_first);
    decoded.storage.set_disk_cache(disk);
    let raster = Raster::checked(decoded, Some(NO_DATA)).expect("a field");
    reader_state.reads();
    raster
}

const USUAL: [bool; 2] = [false, false];

/// Returns the height at a sample of the full image, by the field's formula.
fn height(column: u32, row: u32, [south_up, east_first]: [bool; 2]) -> f64 {
    let column = if east_first {
        SIZE[0] - 1 - column
    } else {
        column
    };
    let row = if south_up { row } else { SIZE[1] - 1 - row };
    let is_in = |block: [u32; 2]| [column / BLOCK[0], row / BLOCK[1]] == block;
    match value(column, row) {
        NO_DATA => f64::NAN,
        _ if is_in(SPARSE) => f64::NAN,
        value => value,
    }
}

/// Compares all samples of a level with the field.
fn check(raster: &Raster, level: u8, order: [bool; 2]) {
    let count = SIZE.map(|count| ((count - 1) >> level) + 1);
    let mut heights = vec![0.0; count[0] as usize];
    for row in 0..count[1] {
        assert!(
            raster
                .read_row(level, row, 0, &mut heights, Wait::UntilRead)
                .is_complete()
        );
        for (column, found) in (0..).zip(&heights) {
            let expected = height(column << level, row << level, order);
            let is_same = found.to_bits() == expected.to_bits();
            assert!(
                is_same || found.is_nan() && expected.is_nan(),
                "{level}: {column} {row}: {found} {expected}"
            );
        }
    }
}

#[test]
fn coarse_levels_have_the_files_own_samples_in_any_order() {
    for order in [[true, false], [false, false], [true, true], [false, true]] {
        let reader_state = ReaderState::new("");
        for level in [2, 3, 5, 6, 8, 9, 10] {
            // Each level in a new raster, then all in the same one.
            check(
                &raster(&reader_state, &DiskCache::off(), order),
                level,
                order,
            );
        }
        let all = raster(&reader_state, &DiskCache::off(), order);
        for level in [9, 6, 3, 4, 5, 7, 8, 10, 2] {
            check(&all, level, order);
        }
    }
}

#[test]
fn repeated_read_is_cached_and_fine_level_fills_coarse_levels() {
    let reader_state = ReaderState::new("");
    let raster = raster(&reader_state, &DiskCache::off(), USUAL);
    check(&raster, 8, USUAL);
    let first = reader_state.reads();
    // Every 256th sample is in another block.
    assert!((1..=9 * 5).contains(&first), "{first}");
    check(&raster, 8, USUAL);
    assert_eq!(reader_state.reads(), 0);
    // Blocks that are read also contribute their coarse samples.
    check(&raster, 0, USUAL);
    assert_eq!(
        reader_state.reads(),
        33 * 27 - 1 - first,
        "all but those in memory, and the one that is not stored"
    );
    for level in 3..=10 {
        check(&raster, level, USUAL);
    }
    assert_eq!(reader_state.reads(), 0);
    assert_eq!(raster.blocks_read(), 1 + 33 * 27 - 1);
}

#[test]
fn surface_is_linear_between_coarse_samples() {
    let reader_state = ReaderState::new("");
    let raster = raster(&reader_state, &DiskCache::off(), [true, false]);
    // None of them is no-data.
    let [a, b] = [560, 568].map(|column| height(column, 808, [true, false]));
    assert!(a > 0.0 && b > 0.0);
    assert_eq!(raster.surface(3, [562.0, 808.0]), 0.75 * a + 0.25 * b);
}

/// Reads the level's rows as a tile does; `None` while they are pending.
fn read_tile(raster: &Raster, level: u8, wait: Wait) -> Option<Vec<f64>> {
    let reads = ReadTracker::default();
    let mut heights = vec![0.0; 9 * 7];
    for (row, heights) in (0..).zip(heights.chunks_exact_mut(9)) {
        reads.add(raster.read_row(level, row, 0, heights, wait));
    }
    reads.status().is_complete().then_some(heights)
}

fn wait_for_level(raster: &Raster, level: u8) -> Vec<f64> {
    wait_for("the level", || read_tile(raster, level, Wait::Never))
}

fn same(one: &[f64], other: &[f64]) {
    let bits = |heights: &[f64]| {
        let each = heights
            .iter()
            .map(|h| if h.is_nan() { 0 } else { h.to_bits() });
        each.collect::<Vec<_>>()
    };
    assert_eq!(bits(one), bits(other));
}

/// Safety: 29.
#[test]
fn nonblocking_read_loads_coarse_level_in_background() {
    let reader_state = ReaderState::new("");
    let waited = read_tile(
        &raster(&reader_state, &DiskCache::off(), USUAL),
        8,
        Wait::UntilRead,
    )
    .expect("here");
    let raster = raster(&reader_state, &DiskCache::off(), USUAL);
    reader_state.threads.lock().expect("alone").clear();
    assert_eq!(
        read_tile(&raster, 8, Wait::Never),
        None,
        "no sample is read yet, and no read waits"
    );
    same(&wait_for_level(&raster, 8), &waited);
    let this = thread::current().id();
    let threads = reader_state.threads.lock().expect("alone").clone();
    assert!(!threads.is_empty() && !threads.contains(&this));
}

/// Safety: 29.
#[test]
fn nonblocking_read_loads_fine_block_in_background() {
    let reader_state = ReaderState::new("");
    let raster = raster(&reader_state, &DiskCache::off(), USUAL);
    let height_at = |column| raster.read_height(column, 1000, Wait::Never);
    assert!(raster.height(300, 1000) > 0.0, "a read that may wait does");
    reader_state.threads.lock().expect("alone").clear();
    let mut columns = 1000..1010;
    let uncached = columns.find(|column| height(*column, 1000, USUAL) > 0.0);
    let uncached = uncached.expect("no missing sample");
    assert_eq!(height_at(uncached).1, ReadStatus::Pending);
    assert!(height_at(300).0 > 0.0, "it is in memory");
    wait_until("the block", || height_at(uncached).0 > 0.0);
    let threads = reader_state.threads.lock().expect("alone").clone();
    assert!(threads.len() == 1 && threads[0] != thread::current().id());
}

#[test]
fn late_block_is_pending_and_damaged_block_is_not_cached() {
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), 1 << 26);
    let reader_state = ReaderState::new("one");
    reader_state.is_late.store(true, Ordering::Relaxed);
    reader_state.is_damaged.store(true, Ordering::Relaxed);
    {
        let raster = raster(&reader_state, &disk, [true, false]);
        // Level 3: the late block covers columns 448 to 511, rows 288 to 335.
        let late = |raster: &Raster| {
            let mut heights = [0.0; 8];
            let status = raster.read_row(3, 37, 56, &mut heights, Wait::Never);
            status.is_complete().then_some(heights)
        };
        for _ in 0..20 {
            assert_eq!(late(&raster), None);
            pass(Duration::from_millis(5));
        }
        reader_state.is_late.store(false, Ordering::Relaxed);
        let heights = wait_for("the late block", || late(&raster));
        let expected: Vec<f64> = (56..64)
            .map(|c| height(c * 8, 37 * 8, [true, false]))
            .collect();
        same(&heights, &expected);
        // The damaged block covers columns 320 to 383, rows 192 to 239.
        let mut bad = [0.0; 8];
        wait_until("the damaged block", || {
            raster
                .read_row(3, 25, 40, &mut bad, Wait::Never)
                .is_complete()
        });
        assert!(bad.iter().all(|height| height.is_nan()), "{bad:?}");
    }
    // It was damaged in that run only.
    reader_state.is_damaged.store(false, Ordering::Relaxed);
    check(
        &raster(&reader_state, &disk, [true, false]),
        3,
        [true, false],
    );
}

#[test]
fn disk_cache_serves_next_run_only_for_the_same_file_stamp() {
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), 1 << 26);
    let reader_state = ReaderState::new("one");
    for (stamp, is_off, is_cached) in [
        (Some("one"), false, false),
        (Some("one"), false, true),
        (Some("two"), false, false),
        (Some("one"), true, false),
        (None, false, false),
        (None, false, false),
        (Some("two"), false, true),
    ] {
        *reader_state.stamp.lock().expect("alone") = stamp.map(Into::into);
        let disk = if is_off {
            DiskCache::off()
        } else {
            disk.clone()
        };
        let raster = raster(&reader_state, &disk, USUAL);
        for level in [8, 5, 9] {
            check(&raster, level, USUAL);
        }
        assert_eq!(reader_state.reads() == 0, is_cached, "{stamp:?}");
    }
    // In another order, other samples are coarse ones.
    *reader_state.stamp.lock().expect("alone") = Some("one".into());
    check(&raster(&reader_state, &disk, [true, true]), 8, [true, true]);
}

#[test]
fn samples_of_a_file_changed_while_open_are_not_cached() {
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), 1 << 26);
    let reader_state = ReaderState::new("one");
    let before = raster(&reader_state, &disk, USUAL);
    check(&before, 8, USUAL);
    // The reader detects that the file has changed.
    *reader_state.stamp.lock().expect("alone") = None;
    drop(before);
    *reader_state.stamp.lock().expect("alone") = Some("one".into());
    check(&raster(&reader_state, &disk, USUAL), 8, USUAL);
    assert!(reader_state.reads() > 0);
}

#[test]
fn coarse_memory_is_bounded_and_evicted_samples_stay_on_disk() {
    let folder = tempfile::tempdir().expect("a folder");
    let disk = DiskCache::at(folder.path(), 1 << 30);
    let reader_state = ReaderState::new("one");
    let size = [1 << 14, 1 << 14];
    let full = BlockImage {
        columns: size[0],
        rows: size[1],
        block: [512, 16],
        every: None,
        first: [0; 2],
    };
    let reader = || Full {
        images: vec![full],
        reader_state: reader_state.clone(),
    };
    let blocks = || {
        let mut blocks = Blocks::new(Box::new(reader()));
        blocks.set_disk_cache(&disk);
        blocks.set_order(true, false);
        blocks
    };
    let first = blocks();
    let image = first.image_of(3);
    assert_eq!((image, first.images.len()), (1, 1 + STEPS.len()));
    let step = STEPS[0];
    let places = || {
        (0..size[0]).step_by(512).flat_map(|column| {
            (0..size[1])
                .step_by(512)
                .map(move |row| [column / step, row / step])
        })
    };
    for [column, row] in places() {
        let _ = first.stored(image, column, row, Wait::UntilRead);
    }
    let reads = reader_state.reads();
    assert_eq!(reads, 32 * 32);
    assert!(first.coarse().pieces() <= 512 && first.coarse().pieces() > 400);
    drop(first);
    let is_cached = blocks();
    for [column, row] in places() {
        let found = is_cached.stored(image, column, row, Wait::UntilRead);
        let found = found.expect("complete");
        let expected = value(column * step, row * step);
        let is_same = found.is_some_and(|found| found.to_bits() == expected.to_bits());
        assert!(is_same || expected.is_nan());
    }
    assert_eq!(reader_state.reads(), 0);
}

#[test]
fn prefetch_reads_in_background_and_skips_oversized_areas() {
    for order in [[true, false], [false, true]] {
        let reader_state = ReaderState::new("");
        let raster = raster(&reader_state, &DiskCache::off(), order);
        reader_state.threads.lock().expect("alone").clear();
        raster.prefetch(0, [0, 2100], [0, 1249]);
        raster.prefetch(0, [1000, 1100], [600, 650]);
        let height_at = |raster: &Raster| {
            let mut heights = [0.0; 101];
            let is_all = |row: u32, heights: &mut [f64; 101]| {
                assert!(
                    raster
                        .read_row(0, row, 1000, heights, Wait::UntilRead)
                        .is_complete()
                );
                (1000..).zip(&*heights).all(|(column, found)| {
                    let expected = height(column, row, order);
                    found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan()
                })
            };
            [600, 625, 650].iter().all(|row| is_all(*row, &mut heights))
        };
        let Storage::Blocks(blocks) = &raster.source.storage else {
            panic!("it stays in its file");
        };
        let keys = [12, 13].map(|row| [15, 16, 17].map(|column| [column, row]));
        let has = |at: &[u32; 2]| blocks.state().cache.has(&Key { image: 0, at: *at });
        wait_until("the blocks", || keys.as_flattened().iter().all(has));
        assert!(height_at(&raster));
        assert_eq!(reader_state.reads(), 6);
        let this = thread::current().id();
        assert!(!reader_state.threads.lock().expect("alone").contains(&this));
    }
}

#[test]
fn windows_contain_their_rows_and_report_pending_heights() {
    let raster = raster(&ReaderState::new(""), &DiskCache::off(), USUAL);
    let window = Window {
        column: 700,
        row: 500,
        columns: 5,
        rows: 3,
    };
    let mut heights = [0.0_f32; 15];
    let status = raster.read_window(0, window, &mut heights, Wait::Never);
    assert_eq!(status, ReadStatus::Pending);
    assert!(heights.iter().all(|height| height.is_nan()));
    let status = raster.read_window(0, window, &mut heights, Wait::UntilRead);
    assert_eq!(status, ReadStatus::Complete);
    for (index, found) in (0..).zip(heights) {
        let expected = height(700 + index % 5, 500 + index / 5, USUAL) as f32;
        assert!(
            found == expected || found.is_nan() && expected.is_nan(),
            "{index}"
        );
    }
}
