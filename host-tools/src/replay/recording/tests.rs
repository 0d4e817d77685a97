//! Tests that both formats of a recording contain the same rows and settings.

use std::fs::File;
use std::path::PathBuf;

use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::record::RowAccessor;
use hapterra_core::force::SurfaceParams;

use super::*;
use crate::replay::settings::{Device, KEY};
use crate::replay::{Row, Trajectory};
use crate::terrain::Terrain;
use heightfield::Raster;

/// More rows than one group of a Parquet file.
const ROWS: u32 = 61_003;
const MORE: [Column; 2] = [Column::Text("state"), Column::Count("tick")];
const STATES: [&str; 2] = ["free", "touching"];

fn settings() -> Settings {
    let raster = Raster::from_fn(4, 4, |_, _| 1.0).expect("raster");
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("valid"), 0);
    let device = Device {
        board: "native".into(),
        firmware: "0.1.0".into(),
        tick_hz: 1000,
    };
    let params = (SurfaceParams::PREMIUM, crate::replay::Rule::Swept);
    Settings::new("flat.tif", &terrain.expect("terrain"), params, None, device)
}

fn record(tick: u32) -> Record {
    let x = f64::from(tick);
    Record {
        t_s: x / 1000.0,
        hip_mm: [x / 3.0, -x, 1e-300],
        contact: tick % 2 == 1,
        proxy_mm: [x.sqrt(), 0.1, -0.0],
        force_n: [0.1 + x, 0.2, 0.3],
    }
}

fn recorded(folder: &tempfile::TempDir, name: &str) -> PathBuf {
    let path = folder.path().join(name);
    let output = Output::create(&path).expect("created");
    let mut recording = Recording::new(output, &MORE).expect("begun");
    recording.describe(&settings());
    for tick in 0..ROWS {
        let state = STATES[tick as usize % 2];
        let more = [Value::Text(state), Value::Count(tick)];
        recording.write(&record(tick), &more).expect("written");
    }
    recording.finish().expect("finished");
    path
}

fn rows_of(path: &Path) -> Vec<Row> {
    let mut trajectory = Trajectory::open(path).expect("opened");
    assert_eq!(trajectory.settings(), Some(&settings()));
    let next = || trajectory.next_row().expect("a row");
    std::iter::from_fn(next).collect()
}

#[test]
fn csv_and_parquet_read_back_as_the_same_trajectory() {
    let folder = tempfile::tempdir().expect("a folder");
    let csv = rows_of(&recorded(&folder, "r.csv"));
    assert_eq!(csv.len(), ROWS as usize);
    for (tick, row) in (0..).zip(&csv) {
        let record = record(tick);
        assert_eq!((row.t_s, row.hip_mm), (Some(record.t_s), record.hip_mm));
    }
    assert!(csv == rows_of(&recorded(&folder, "r.Parquet")));
}

#[test]
fn parquet_recording_is_read_by_its_library() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = File::open(recorded(&folder, "r.parquet")).expect("there");
    let reader = SerializedFileReader::new(file).expect("Parquet");
    let about = reader.metadata().file_metadata();
    let entries = about.key_value_metadata().expect("metadata");
    let entry = entries
        .iter()
        .find(|entry| entry.key == KEY)
        .expect("settings");
    let text = entry.value.as_deref().expect("text");
    assert_eq!(Settings::from_toml(text).expect("read"), Some(settings()));
    let columns = about.schema_descr().columns();
    let names: Vec<_> = columns.iter().map(|column| column.name()).collect();
    assert_eq!(
        names.join(","),
        "t_s,x_mm,y_mm,z_mm,contact,proxy_x_mm,proxy_y_mm,proxy_z_mm,force_x_n,force_y_n,force_z_n,state,tick"
    );
    let mut count = 0;
    for row in reader.get_row_iter(None).expect("rows") {
        let (row, record) = (row.expect("a row"), record(count));
        let number = |column: usize| row.get_double(column).expect("a number");
        let read: Vec<_> = (0..4).chain(5..11).map(number).collect();
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&record.numbers()));
        assert_eq!(row.get_int(4).expect("0 or 1"), i32::from(record.contact));
        let state = row.get_string(11).expect("text");
        assert_eq!(state, STATES[count as usize % 2]);
        assert_eq!(row.get_long(12).expect("a count"), i64::from(count));
        count += 1;
    }
    assert_eq!(count, ROWS);
}

#[test]
fn settings_precede_header_and_unfinished_files_vanish() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(recorded(&folder, "r.csv")).expect("there");
    let settings: Vec<_> = text
        .lines()
        .take_while(|line| line.starts_with('#'))
        .collect();
    assert_eq!(settings[0], "# hapterra-recording = 1");
    assert!(
        text.lines()
            .nth(settings.len())
            .expect("a header")
            .starts_with("t_s,x_mm")
    );
    std::fs::remove_file(folder.path().join("r.csv")).expect("removed");
    for name in ["r.csv", "r.parquet"] {
        let output = Output::create(&folder.path().join(name)).expect("created");
        let mut recording = Recording::new(output, &[]).expect("begun");
        recording.write(&record(0), &[]).expect("written");
        drop(recording);
    }
    assert_eq!(folder.path().read_dir().expect("a folder").count(), 0);
}

/// Returns marks with texts that need escapes: the first before any row, the last after all.
fn marks() -> Vec<Mark> {
    let texts = [
        "a, \"b\" 'c' \\ # d",
        "[[view]]",
        "= µ \u{1F9E0} \u{2028} end",
        "'''\"\"\"",
    ];
    let mark = |(at, text): (u32, &str)| Mark {
        tick: (at != 2).then_some(at),
        t_s: f64::from(at) / 1000.0,
        host_unix_s: 1_764_226_800.123_456,
        text: text.to_owned(),
    };
    (0..).zip(texts).map(mark).collect()
}

#[test]
fn marks_read_back_from_csv_and_parquet() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["m.csv", "m.parquet"] {
        let path = folder.path().join(name);
        let output = Output::create(&path).expect("created");
        let mut recording = Recording::new(output, &[]).expect("begun");
        recording.describe(&settings());
        recording.mark(&marks()[0]);
        for mark in &marks()[1..] {
            recording.write(&record(7), &[]).expect("written");
            recording.mark(mark);
        }
        recording.finish().expect("finished");
        let trajectory = Trajectory::open(&path).expect("opened");
        let read = trajectory.settings().expect("settings");
        assert_eq!(read.marks, marks(), "{name}");
        assert_eq!(read.of_beginning(), settings(), "{name}");
    }
}
