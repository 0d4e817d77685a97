//! Terrains of generated files: when files are opened, and how much memory they use.

use std::path::Path;

use super::super::blocks::{BlockReader, Part};
use super::super::samples::SampleType;
use super::super::{OpenOptions, Raster};
use super::pool::Pool;
use super::reader::Mosaic;
use super::source::Source;

/// Side of a tile, samples.
const SIDE: u32 = 40;

/// Returns the height at a column and row of all tiles together.
fn height(column: u32, row: u32) -> u32 {
    (column * 7 + row * 3) % 1000
}

/// Writes a square of `count × count` tiles that share no samples, without gaps.
fn tiles(folder: &Path, count: u32) {
    for (across, up) in (0..count * count).map(|number| (number % count, number / count)) {
        let mut text = format!(
            "ncols {SIDE}\nnrows {SIDE}\nxllcorner {}\nyllcorner {}\ncellsize 1\n",
            across * SIDE,
            up * SIDE
        );
        for row in (0..SIDE).rev() {
            for column in 0..SIDE {
                let height = height(across * SIDE + column, up * SIDE + row);
                text.push_str(&format!("{height} "));
            }
            text.push('\n');
        }
        let name = format!("{up:03}-{across:03}.asc");
        std::fs::write(folder.join(name), text).expect("written");
    }
}

fn source(folder: &Path, name: &str, column: u32, row: u32) -> Source {
    Source {
        path: folder.join(name),
        bytes: 0,
        covers: Part {
            column,
            row,
            columns: SIDE,
            rows: SIDE,
        },
        turned: [false, true],
    }
}

#[test]
fn number_of_open_files_is_bounded() {
    const COUNT: u32 = 9;
    let folder = tempfile::tempdir().expect("a folder");
    tiles(folder.path(), COUNT);
    let side = SIDE * COUNT;
    let sources = (0..COUNT * COUNT).map(|number| {
        let (across, up) = (number % COUNT, number / COUNT);
        let name = format!("{up:03}-{across:03}.asc");
        source(folder.path(), &name, across * SIDE, up * SIDE)
    });
    let options = OpenOptions::default();
    let mosaic = Mosaic::new((side, side), sources.collect(), SampleType::F32, &options);
    assert_eq!(mosaic.open_files(), 0);
    let all = mosaic.read(0, &Part::whole(side, side)).expect("all");
    for row in 0..side {
        for column in 0..side {
            let found = all.stored((row * side + column) as usize);
            assert_eq!(
                found,
                Some(f64::from(height(column, row))),
                "{column} {row}"
            );
        }
    }
    assert!(
        (2..=32).contains(&mosaic.open_files()),
        "{}",
        mosaic.open_files()
    );
    // A coarse image has exactly the same samples.
    let part = Part {
        column: 3,
        row: 5,
        columns: 20,
        rows: 11,
    };
    let coarse = mosaic.read(3, &part).expect("a part");
    for (index, (row, column)) in (5..16)
        .flat_map(|row| (3..23).map(move |c| (row, c)))
        .enumerate()
    {
        assert_eq!(
            coarse.stored(index),
            Some(f64::from(height(column * 8, row * 8)))
        );
    }
}

#[test]
fn files_outside_the_read_part_are_not_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    tiles(folder.path(), 2);
    let names = ["000-000.asc", "000-001.asc", "001-000.asc"];
    let at = [(0, 0), (SIDE, 0), (0, SIDE)];
    let sources = names.iter().zip(at);
    let sources = sources.map(|(name, (column, row))| source(folder.path(), name, column, row));
    let options = OpenOptions::default();
    let size = (2 * SIDE, 2 * SIDE);
    let mosaic = Mosaic::new(size, sources.collect(), SampleType::F32, &options);
    let part = |column, row| Part {
        column,
        row,
        columns: 5,
        rows: 5,
    };
    assert!(mosaic.is_stored(0, &part(0, 0)) && !mosaic.is_stored(0, &part(SIDE, SIDE)));
    mosaic.read(0, &part(SIDE + 1, 1)).expect("a part");
    assert_eq!(mosaic.open_files(), 1);
    mosaic.read(0, &part(SIDE - 2, 1)).expect("two files' part");
    assert_eq!(mosaic.open_files(), 2);
    // A file that is covered by another is not opened, even if its neighbourhood is read.
    let covered = [names[1], names[0]].map(|name| source(folder.path(), name, 0, 0));
    let mosaic = Mosaic::new(size, covered.to_vec(), SampleType::F32, &options);
    let block = mosaic.read(0, &part(SIDE - 2, 0)).expect("a part");
    assert_eq!(block.stored(0), Some(f64::from(height(SIDE - 2, 0))));
    assert_eq!(mosaic.open_files(), 1);
}

/// Each causes one warning, however often it is read.
#[test]
fn failed_file_is_not_retried() {
    let folder = tempfile::tempdir().expect("a folder");
    let sources = vec![source(folder.path(), "000-000.asc", 0, 0)];
    let options = OpenOptions::default();
    let mosaic = Mosaic::new((SIDE, SIDE), sources, SampleType::F32, &options);
    for _ in 0..2 {
        let block = mosaic.read(0, &Part::whole(SIDE, SIDE)).expect("a part");
        assert!(block.stored(0).is_some_and(f64::is_nan));
        tiles(folder.path(), 1);
    }
}

/// Samples, open files and index of a terrain of many files use at most 256 MB.
#[test]
fn memory_of_many_files_is_bounded() {
    let folder = tempfile::tempdir().expect("a folder");
    tiles(folder.path(), 3);
    let raster = Raster::open(folder.path(), &OpenOptions::default()).expect("a terrain");
    assert!(raster.samples().is_none());
    assert!(raster.memory_bytes() > Pool::max_bytes());
    assert!(
        raster.memory_bytes() <= 256 << 20,
        "{}",
        raster.memory_bytes()
    );
    // A file that cannot be read in blocks and is too large for memory is rejected.
    let text = "ncols 9000\nnrows 9000\nxllcorner 120\nyllcorner 0\ncellsize 1\n";
    std::fs::write(folder.path().join("large.asc"), text).expect("written");
    let error = Raster::open(folder.path(), &OpenOptions::default()).expect_err("too large");
    let error = error.to_string();
    assert!(
        error.contains("large.asc") && error.contains("9000 × 9000"),
        "{error}"
    );
}

#[test]
fn changed_files_are_another_terrain() {
    let prints = [0, 1, 2].map(|change| {
        let folder = tempfile::tempdir().expect("a folder");
        tiles(folder.path(), 2);
        let path = folder.path().join("001-001.asc");
        let text = std::fs::read_to_string(&path).expect("text");
        match change {
            0 => {}
            1 => std::fs::write(path, text.replace(" 500 ", " 501 ")).expect("written"),
            _ => std::fs::remove_file(path).expect("removed"),
        }
        let reopened = Raster::open(folder.path(), &OpenOptions::default()).expect("a terrain");
        let first = Raster::open(folder.path(), &OpenOptions::default()).expect("a terrain");
        assert_eq!(reopened.print_in_file(), first.print_in_file());
        first.print_in_file()
    });
    assert!(prints[0].is_some() && prints[0] != prints[1] && prints[0] != prints[2]);
}

/// Writes a tile of constant height.
fn flat(folder: &Path, name: &str, west: u32, height: i32) {
    let header = format!("ncols 4\nnrows 3\nxllcorner {west}\nyllcorner 0\ncellsize 1\n");
    let samples = format!("{height} ").repeat(12);
    std::fs::write(folder.join(name), header + &samples).expect("written");
}

#[test]
fn layers_beside_heights_are_ignored_and_named() {
    let folder = tempfile::tempdir().expect("a folder");
    flat(folder.path(), "n38_dem.asc", 0, 500);
    flat(folder.path(), "n38_num.asc", 0, 12);
    // Its name is unknown, but it has the same samples.
    flat(folder.path(), "n38_aux.asc", 0, 7);
    let raster = Raster::open(folder.path(), &OpenOptions::default()).expect("a terrain");
    let summary = raster.summary();
    assert_eq!((summary.lowest, summary.highest), (500.0, 500.0));
    let remarks = raster.remarks().join(" ");
    assert!(
        remarks.contains("n38_num.asc") && remarks.contains("n38_aux.asc"),
        "{remarks}"
    );
}

#[test]
fn rasters_that_differ_on_the_same_samples_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    flat(folder.path(), "a_2019.asc", 0, 500);
    flat(folder.path(), "a_2020.asc", 0, 503);
    let fault = Raster::open(folder.path(), &OpenOptions::default()).expect_err("refused");
    let fault = fault.to_string();
    assert!(fault.contains("differ by up to 3"), "{fault}");
    assert!(
        fault.contains("a_2019.asc") && fault.contains("a_2020.asc"),
        "{fault}"
    );
    // Two files with the same heights are not ambiguous.
    flat(folder.path(), "a_2020.asc", 0, 500);
    let raster = Raster::open(folder.path(), &OpenOptions::default()).expect("a terrain");
    assert_eq!(raster.remarks(), [""; 0]);
}

#[test]
fn tiles_that_differ_where_they_overlap_are_reported() {
    let folder = tempfile::tempdir().expect("a folder");
    flat(folder.path(), "a.asc", 0, 500);
    flat(folder.path(), "b.asc", 3, 510);
    let raster = Raster::open(folder.path(), &OpenOptions::default()).expect("a terrain");
    let remarks = raster.remarks().join(" ");
    assert!(
        remarks.contains("a.asc and b.asc overlap") && remarks.contains("up to 10"),
        "{remarks}"
    );
    assert_eq!(raster.height(3, 0), 510.0);
}
