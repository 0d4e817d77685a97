//! Plain samples read at once, in blocks, and in row or column order.

use std::path::Path;

use super::*;
use crate::input::FileBytes;
use crate::{Raster, RawLayout, RemoteFetcher, Wait};

const SIZE: [u32; 2] = [1100, 700];

fn value(column: u32, row: u32) -> i16 {
    // No value between two samples equals a sample.
    (column.wrapping_mul(7919) ^ row.wrapping_mul(104_729)) as i16
}

/// Writes big-endian samples with a header and bytes between rows and between samples.
fn file(folder: &Path) -> (FileBytes, RawSamples) {
    let mut bytes = vec![0xAA; 37];
    for row in 0..SIZE[1] {
        for column in 0..SIZE[0] {
            bytes.extend(value(column, row).to_be_bytes());
            bytes.push(0xBB);
        }
        bytes.extend([0xCC; 5]);
    }
    let path = folder.join("samples.raw");
    std::fs::write(&path, bytes).expect("written");
    let input = FileBytes::open(&path, &RemoteFetcher::default()).expect("there");
    let plain = RawSamples {
        columns: SIZE[0],
        rows: SIZE[1],
        stored: StoredType::Held(SampleType::I16),
        endian: Endian::Big,
        first: 37,
        row: u64::from(SIZE[0]) * 3 + 5,
        sample: 3,
    };
    (input, plain)
}

fn part(column: u32, row: u32, columns: u32, rows: u32) -> Part {
    Part {
        column,
        row,
        columns,
        rows,
    }
}

#[test]
fn parts_of_images_have_their_samples_in_either_order() {
    let folder = tempfile::tempdir().expect("a folder");
    let (input, plain) = file(folder.path());
    for every in [1, 2, 64] {
        let count = [SIZE[0].div_ceil(every), SIZE[1].div_ceil(every)];
        let part = part(0, count[1] / 2, count[0], 1 + (count[1] - 1) / 3);
        let expected = |turned: bool| {
            let along = (0..part.columns).map(|column| (part.column + column) * every);
            let down = (0..part.rows).map(|row| (part.row + row) * every);
            let (along, down): (Vec<_>, Vec<_>) = (along.collect(), down.collect());
            let values: Vec<i16> = match turned {
                false => (down.iter())
                    .flat_map(|row| along.iter().map(|column| value(*column, *row)))
                    .collect(),
                true => (along.iter())
                    .flat_map(|column| down.iter().map(|row| value(*column, *row)))
                    .collect(),
            };
            Samples::from(values)
        };
        let subsampling = Subsampling {
            every,
            first: [0; 2],
        };
        let read = plain.read(&input, &part, subsampling).expect("inside");
        assert_eq!(read, expected(false), "{every}");
        let turned = Part {
            column: part.row,
            row: part.column,
            columns: part.rows,
            rows: part.columns,
        };
        let read = plain.turned().read(&input, &turned, subsampling);
        assert_eq!(read.expect("inside"), expected(true), "{every}, turned");
    }
}

#[test]
fn widely_spaced_samples_are_read_one_by_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let (input, plain) = file(folder.path());
    let bytes = std::fs::read(folder.path().join("samples.raw")).expect("there");
    let spaced = RawSamples {
        columns: 5,
        rows: 4,
        row: 90_000,
        sample: 3000,
        ..plain
    };
    let at = |column: u64, row: u64| {
        let at = (37 + row * spaced.row + column * spaced.sample) as usize;
        i16::from_be_bytes([bytes[at], bytes[at + 1]])
    };
    // Every second sample, over more rows than one read covers.
    let subsampling = Subsampling {
        every: 2,
        first: [0, 1],
    };
    let places = [1, 3].into_iter();
    let places = places.flat_map(|row| [0, 2, 4].map(|column| (column, row)));
    let expected: Vec<i16> = places.map(|(column, row)| at(column, row)).collect();
    let read = spaced.read(&input, &part(0, 0, 3, 2), subsampling);
    assert_eq!(read.expect("inside"), Samples::from(expected));
}

fn opened(path: &Path, max_in_memory_bytes: u64) -> Raster {
    let options = OpenOptions {
        raw: Some(RawLayout {
            columns: SIZE[0],
            rows: SIZE[1],
            sample: SampleType::I16,
            endian: Endian::Little,
        }),
        max_in_memory_bytes,
        ..OpenOptions::default()
    };
    Raster::open(path, &options).expect("opens")
}

#[test]
fn blockwise_and_in_memory_heights_match_on_all_levels() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hills.raw");
    let places = (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| (column, row)));
    let bytes: Vec<u8> = places
        .flat_map(|(column, row)| value(column, row).to_le_bytes())
        .collect();
    std::fs::write(&path, bytes).expect("written");
    let (in_memory, blocks) = (opened(&path, u64::MAX), opened(&path, 0));
    assert!(in_memory.samples().is_some() && blocks.samples().is_none());
    assert!(!blocks.is_summary_complete());
    for level in 0..9 {
        let count = ((SIZE[0] - 1) >> level) + 1;
        let mut rows = [vec![0.0; count as usize], vec![0.0; count as usize]];
        for row in (0..SIZE[1] >> level).step_by(7) {
            assert!(
                in_memory
                    .read_row(level, row, 0, &mut rows[0], Wait::UntilRead)
                    .is_complete()
            );
            assert!(
                blocks
                    .read_row(level, row, 0, &mut rows[1], Wait::UntilRead)
                    .is_complete()
            );
            assert_eq!(rows[0], rows[1], "{level} {row}");
        }
    }
}

/// A header may state that a file begins in the south or in the east.
#[test]
fn levels_count_from_south_west_in_any_file_order() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hills.flt");
    let places = (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |column| (column, row)));
    let bytes: Vec<u8> = places
        .flat_map(|(column, row)| f32::from(value(column, row)).to_le_bytes())
        .collect();
    std::fs::write(&path, bytes).expect("written");
    let mut orders = std::collections::HashSet::new();
    let map = [("1", "-1"), ("1", "1"), ("-1", "1"), ("-1", "-1")];
    for (east, down) in map {
        let header = format!(
            "ENVI\nsamples = {}\nlines = {}\nbands = 1\ndata type = 4\nbyte order = 0\n\
             interleave = bsq\nmap info = {{Arbitrary, 1, 1, 5000, 5000, {east}, {}}}\n",
            SIZE[0],
            SIZE[1],
            // Steps to the south.
            if down == "-1" { "1" } else { "-1" }
        );
        std::fs::write(folder.path().join("hills.hdr"), header).expect("written");
        let [in_memory, blocks] = [u64::MAX, 0].map(|max_in_memory_bytes| {
            let options = OpenOptions {
                max_in_memory_bytes,
                ..OpenOptions::default()
            };
            Raster::open(&path, &options).expect("opens")
        });
        assert!(blocks.samples().is_none());
        orders.insert((blocks.source.south_up, blocks.source.east_first));
        let mut rows = [[0.0; 60], [0.0; 60]];
        for (level, row) in [(0, 3), (1, 200), (2, 100), (4, 30)] {
            assert!(
                in_memory
                    .read_row(level, row, 1, &mut rows[0], Wait::UntilRead)
                    .is_complete()
            );
            assert!(
                blocks
                    .read_row(level, row, 1, &mut rows[1], Wait::UntilRead)
                    .is_complete()
            );
            assert!(
                rows[0][0] == rows[1][0] && rows[0][30] == rows[1][30],
                "{level} {east} {down}"
            );
        }
    }
    assert_eq!(orders.len(), 4, "{orders:?}");
}

#[test]
fn truncated_file_reads_as_no_data_past_its_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hills.raw");
    let bytes = vec![7; 2 * SIZE[0] as usize * SIZE[1] as usize];
    std::fs::write(&path, &bytes).expect("written");
    let raster = opened(&path, 0);
    let file = std::fs::OpenOptions::new().write(true).open(&path);
    let half = bytes.len() as u64 / 2;
    file.and_then(|file| file.set_len(half)).expect("cut");
    // Rows are counted from the south.
    assert!(raster.height(300, 20).is_nan());
    assert_eq!(raster.height(300, SIZE[1] - 100), 1799.0);
}
