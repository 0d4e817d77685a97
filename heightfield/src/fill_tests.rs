//! Filled heights against a simple reference over a whole array, for each reader of the file.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use crate::blocks::{Block, BlockImage, BlockReader, Blocks, Part};
use crate::timeouts::wait_for;
use crate::{OpenOptions, Raster, RasterError, SampleType, Wait, Window};

/// More than two blocks of 256 samples in both directions.
const SIZE: [u32; 2] = [600, 530];
const NO_DATA: f32 = -9999.0;

/// Returns data with scattered no-data, wide areas of it across block edges, and one sample at a
/// corner.
fn stored(column: u32, row: u32) -> Option<f32> {
    let mixed = (column.wrapping_mul(7919) ^ row.wrapping_mul(104_729)) % 1009;
    let is_wide = (200..300).contains(&column) && (240..262).contains(&row)
        || (500..520).contains(&column)
        || column < 9 && row < 7
        || (430..470).contains(&column) && (400..450).contains(&row);
    let is_island = (column, row) == (511, 300) || (column, row) == (450, 425);
    let has_data = is_island || !(is_wide || mixed.is_multiple_of(5));
    has_data.then_some((column as f32 * 0.37 - row as f32 * 0.11) + mixed as f32 * 0.01)
}

/// Returns all samples of the file, its first row the northernmost.
fn whole() -> Vec<Vec<Option<f64>>> {
    let row = |row| (0..SIZE[0]).map(move |column| stored(column, row).map(f64::from));
    (0..SIZE[1]).map(|at| row(at).collect()).collect()
}

/// Fills by the definition, without blocks: over all distances to data in the same row or column,
/// the nearest on each side.
fn reference(all: &[Vec<Option<f64>>], column: usize, row: usize, within: usize) -> Option<f64> {
    if let Some(height) = all[row][column] {
        return Some(height);
    }
    let across = all[row].iter().enumerate();
    let down = all.iter().map(|row| row[column]).enumerate();
    let data = across
        .filter_map(|(at, height)| Some(((at as i64 - column as i64, true), (*height)?)))
        .chain(down.filter_map(|(at, height)| Some(((at as i64 - row as i64, false), height?))));
    let data: Vec<_> = data.collect();
    let nearest = |is_there: &dyn Fn(i64, bool) -> bool| {
        let side = data
            .iter()
            .filter(|((away, is_across), _)| is_there(*away, *is_across));
        let nearest = side.min_by_key(|((away, _), _)| away.abs());
        nearest.filter(|((away, _), _)| away.unsigned_abs() as usize <= within)
    };
    let sides = [
        nearest(&|away, is_across| is_across && away < 0),
        nearest(&|away, is_across| is_across && away > 0),
        nearest(&|away, is_across| !is_across && away < 0),
        nearest(&|away, is_across| !is_across && away > 0),
    ];
    let found = || {
        sides
            .iter()
            .flatten()
            .map(|((away, _), height)| (away.abs() as f64, height))
    };
    let weights: f64 = found().map(|(away, _)| 1.0 / away).sum();
    let heights: f64 = found().map(|(away, height)| height / away).sum();
    (weights > 0.0).then(|| heights / weights)
}

/// Writes float samples with a header; GDAL also reads this format.
fn write_flt(folder: &Path) -> PathBuf {
    let places = (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| (column, row)));
    let value = |(column, row)| stored(column, row).unwrap_or(NO_DATA).to_le_bytes();
    let path = folder.join("holes.flt");
    std::fs::write(&path, places.flat_map(value).collect::<Vec<_>>()).expect("written");
    let header = format!(
        "ncols {}\nnrows {}\nxllcorner 5000\nyllcorner 0\ncellsize 1\nNODATA_value {NO_DATA}\nbyteorder LSBFIRST\n",
        SIZE[0], SIZE[1]
    );
    std::fs::write(folder.join("holes.hdr"), header).expect("written");
    path
}

/// Writes the same samples as a NumPy array, with NaN for no-data.
fn write_npy(folder: &Path) -> PathBuf {
    let shape = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}",
        SIZE[1], SIZE[0]
    );
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{shape:117}\n").bytes());
    for row in 0..SIZE[1] {
        bytes.extend((0..SIZE[0]).flat_map(|c| stored(c, row).unwrap_or(f32::NAN).to_le_bytes()));
    }
    let path = folder.join("holes.npy");
    std::fs::write(&path, bytes).expect("written");
    path
}

fn options(within: u32, max_in_memory_bytes: u64) -> OpenOptions {
    OpenOptions {
        fill: Fill::within(within),
        max_in_memory_bytes,
        ..OpenOptions::default()
    }
}

/// Compares windows of level 0, some across the edges of blocks, with the reference.
fn check(raster: &Raster, within: u32) {
    let all = whole();
    for [column, row, columns, rows] in [
        [190, 255, 120, 45],
        [505, 200, 40, 70],
        [420, 70, 60, 70],
        [511, 229, 1, 1],
        [0, 515, 12, 15],
    ] {
        let window = Window {
            column,
            row,
            columns,
            rows,
        };
        let mut heights = vec![0.0; (columns * rows) as usize];
        let status = raster.read_window(0, window, &mut heights, Wait::UntilRead);
        assert!(status.is_complete());
        for (index, found) in (0..).zip(heights) {
            let (column, row) = (column + index % columns, row + index / columns);
            let from_north = (SIZE[1] - 1 - row) as usize;
            let expected = reference(&all, column as usize, from_north, within as usize);
            match expected {
                Some(expected) => {
                    let off = (f64::from(found) - expected).abs();
                    assert!(off < 1e-4, "{within}: {column} {row}: {found} {expected}");
                }
                None => assert!(found.is_nan(), "{within}: {column} {row}: {found}"),
            }
        }
    }
}

#[test]
fn filled_heights_are_those_of_the_reference() {
    let folder = tempfile::tempdir().expect("a folder");
    for path in [write_flt(folder.path()), write_npy(folder.path())] {
        for (within, in_memory) in [(1, 0), (10, 0), (64, 0), (10, u64::MAX)] {
            let raster = Raster::open(&path, &options(within, in_memory)).expect("opened");
            assert_eq!(raster.is_summary_complete(), in_memory > 0);
            check(&raster, within);
        }
    }
}

#[test]
fn filled_heights_are_the_same_by_gdal() {
    if let Err(why) = crate::gdal() {
        eprintln!("skipped: {why}");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = write_flt(folder.path());
    for in_memory in [0, u64::MAX] {
        let raster = Raster::open_by_gdal(&path, &options(10, in_memory)).expect("opened");
        check(&raster, 10);
    }
}

#[test]
fn coarse_levels_are_filled_from_their_own_samples() {
    let folder = tempfile::tempdir().expect("a folder");
    let raster = Raster::open(write_npy(folder.path()), &options(3, 0)).expect("opened");
    let level = 3;
    let every = 1 << level;
    // Levels count from the south, the file's rows from the north.
    let all: Vec<Vec<_>> = (0..SIZE[1])
        .step_by(every)
        .map(|row| {
            let columns = (0..SIZE[0]).step_by(every);
            columns
                .map(|column| stored(column, SIZE[1] - 1 - row).map(f64::from))
                .collect()
        })
        .collect();
    let mut filled = 0;
    for row in 0..all.len() {
        let mut heights = vec![0.0; all[row].len()];
        let read = raster.read_row(level, row as u32, 0, &mut heights, Wait::UntilRead);
        assert!(read.is_complete());
        for (column, found) in heights.iter().enumerate() {
            let expected = reference(&all, column, row, 3).unwrap_or(f64::NAN);
            let is_same = (found - expected).abs() < 1e-9 || found.is_nan() && expected.is_nan();
            assert!(is_same, "{column} {row}: {found} {expected}");
            filled += u32::from(all[row][column].is_none() && !expected.is_nan());
        }
    }
    assert!(filled > 500, "{filled}");
}

#[test]
fn distances_have_a_limit() {
    assert_eq!(
        [0, 1, 64, 65].map(|n| Fill::within(n).map(Fill::samples)),
        [None, Some(1), Some(64), None]
    );
}

#[test]
fn file_without_data_is_refused_and_classes_are_unfilled() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("holes.asc");
    let head = "ncols 3\nnrows 2\ncellsize 1\nNODATA_value -1\n";
    std::fs::write(&path, format!("{head}-1 -1 -1 -1 -1 -1")).expect("written");
    let error = Raster::open(&path, &options(64, 0)).expect_err("no data");
    assert!(
        matches!(error.fault(), RasterError::AllNoData { samples: 6 }),
        "{error}"
    );
    std::fs::write(&path, format!("{head}1 -1 3 4 5 6")).expect("written");
    let filled = Raster::open(&path, &options(1, 0)).expect("opened");
    // The weights are equal: 1, 3, and 5 below.
    assert_eq!(filled.height(1, 1), 3.0);
    assert_eq!(
        (filled.summary().no_data, filled.fill()),
        (1, Fill::within(1))
    );
    let classes = OpenOptions {
        classes: true,
        ..options(1, 0)
    };
    let classes = Raster::open(&path, &classes).expect("opened");
    assert!(classes.height(1, 1).is_nan() && classes.fill().is_none());
}

#[test]
fn filled_files_have_another_hash() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = write_npy(folder.path());
    let print = |within| {
        let raster = Raster::open(&path, &options(within, 0)).expect("opened");
        raster.print_in_file().expect("it stays in the file")
    };
    let prints = [0, 1, 10].map(print);
    assert!(prints[0] != prints[1] && prints[1] != prints[2] && prints[0] != prints[2]);
    assert_eq!(prints[1], print(1));
}

/// Two blocks of 64 samples; the second is pending until the test sets `is_here`.
struct Late {
    images: Vec<BlockImage>,
    is_here: Arc<AtomicBool>,
}

impl BlockReader for Late {
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
        if part.column > 0 && !self.is_here.load(Ordering::Relaxed) {
            return Err(RasterError::Remote(crate::remote::outage()));
        }
        // The last two columns of the first block are no-data.
        let columns = (0..part.rows).flat_map(|_| part.column..part.column + part.columns);
        let value = |column| {
            if column == 62 || column == 63 {
                f64::NAN
            } else {
                f64::from(column)
            }
        };
        Ok(Block {
            samples: columns.map(value).collect::<Vec<_>>().into(),
            no_data_mask: None,
            is_incomplete: false,
        })
    }

    fn index(&self) -> u64 {
        7
    }
}

#[test]
fn height_is_pending_while_a_neighbour_is() {
    let is_here = Arc::new(AtomicBool::new(false));
    let image = BlockImage {
        columns: 128,
        rows: 4,
        block: [64, 4],
        every: None,
        first: [0; 2],
    };
    let blocks = Blocks::new(Box::new(Late {
        images: vec![image],
        is_here: is_here.clone(),
    }));
    let read = |column, within, wait| {
        let fill = Fill::within(within).expect("a distance");
        fill.height([column, 1], [128, 4], |at| {
            blocks.height(0, at, wait, |stored| stored.unwrap_or(f64::NAN))
        })
    };
    for wait in [Wait::UntilRead, Wait::Never] {
        let (height, status) = wait_for("the first block", || {
            Some(read(61, 2, wait)).filter(|(_, status)| status.is_complete())
        });
        assert_eq!((height, status), (61.0, ReadStatus::Complete));
        for (column, within) in [(63, 1), (63, 64), (62, 2)] {
            let (height, status) = read(column, within, wait);
            assert!(
                height.is_nan() && status == ReadStatus::Pending,
                "{column} {within}"
            );
        }
        // No data of the second block is near enough.
        assert_eq!(read(62, 1, wait), (61.0, ReadStatus::Complete));
    }
    is_here.store(true, Ordering::Relaxed);
    let late = wait_for("the second block", || {
        Some(read(63, 2, Wait::Never)).filter(|(_, status)| status.is_complete())
    });
    assert_eq!(late.0, (61.0 / 2.0 + 64.0) / 1.5);
}
