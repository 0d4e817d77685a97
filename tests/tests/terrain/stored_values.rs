//! `hapterra info` on the numbers that a file stores, and the remarks on contact.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use hapterra_tests::hapterra_binary;
use hapterra_tests::tiffs::{DATA, Values, floats_in_a_strip, tiff};

const SIDE: u32 = 8;

/// Writes a file of the heights 0 to 63 with an overview, and GDAL's sidecar.
fn write_noted(folder: &Path) {
    let floats = |side: u32| (0..side * side).flat_map(|at| (at as f32).to_le_bytes());
    let data: Vec<u8> = floats(SIDE).chain(floats(SIDE / 2)).collect();
    let mut overview = vec![(254, Values::Longs(vec![1]))];
    overview.extend(floats_in_a_strip([SIDE / 2; 2], DATA + 4 * SIDE * SIDE));
    let images = [floats_in_a_strip([SIDE; 2], DATA), overview];
    fs::write(folder.join("x.tif"), tiff(&data, &images)).expect("written");
    let notes = "<PAMDataset><PAMRasterBand band='1'><NoDataValue>63</NoDataValue>\
                 <Scale>0.5</Scale><Offset>10</Offset></PAMRasterBand></PAMDataset>";
    fs::write(folder.join("x.tif.aux.xml"), notes).expect("written");
}

fn hapterra(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(hapterra_binary());
    command.args(arguments).current_dir(folder);
    let output = command.output().expect("it runs");
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    output
}

#[test]
fn info_shows_the_stored_values() {
    let folder = tempfile::tempdir().expect("a folder");
    write_noted(folder.path());
    let output = hapterra(folder.path(), &["info", "x.tif"]);
    let text = String::from_utf8(output.stdout).expect("text");
    for line in [
        "heights   10 to 41",
        "stored    no-data value 63, scale 0.5, offset 10",
        "bands     1, in blocks of 8 × 8",
        "samples   area or point not stated",
        "overviews 4 × 4",
    ] {
        assert!(text.contains(line), "{line} is missing in {text}");
    }
    let output = hapterra(folder.path(), &["info", "--json", "x.tif"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["no_data_value"], 63.0);
    assert_eq!(
        (&report["scale"], &report["offset"]),
        (&0.5.into(), &10.0.into())
    );
    assert_eq!(report["overviews"], serde_json::json!([[4, 4]]));
    assert_eq!(report["samples_are"], serde_json::Value::Null);
}

#[test]
fn no_data_is_counted_before_filling() {
    let folder = tempfile::tempdir().expect("a folder");
    let grid =
        "ncols 3\nnrows 2\nxllcorner 5000\nyllcorner 0\ncellsize 1\nNODATA_value -1\n1 -1 3 4 5 6";
    fs::write(folder.path().join("x.asc"), grid).expect("written");
    let output = hapterra(folder.path(), &["info", "x.asc", "--input", "fill=1"]);
    let text = String::from_utf8(output.stdout).expect("text");
    for line in [
        "no data   1 samples (16.67 %)",
        "fill      those within 1 samples of data are filled from it",
    ] {
        assert!(text.contains(line), "{line} is missing in {text}");
    }
    let filled = ["cut", "x.asc", "-o", "out", "--input", "fill=1"];
    hapterra(folder.path(), &filled);
    let npy = fs::read(folder.path().join("out/terrain.npy")).expect("written");
    let north: Vec<f32> = npy[128..]
        .chunks_exact(4)
        .take(3)
        .flat_map(<[u8; 4]>::try_from)
        .map(f32::from_le_bytes)
        .collect();
    assert_eq!(north, [1.0, 3.0, 3.0]);
}

#[test]
fn remarks_are_noted_where_a_terrain_is_touched() {
    let folder = tempfile::tempdir().expect("a folder");
    let grid = "ncols 3\nnrows 2\nxllcorner 5000\nyllcorner 0\ncellsize 1\n1 2 3 4 5 -32768";
    fs::write(folder.path().join("x.asc"), grid).expect("written");
    let output = hapterra(folder.path(), &["cut", "x.asc", "-o", "out"]);
    let notes = String::from_utf8(output.stderr).expect("text");
    assert!(
        notes.contains("note: ") && notes.contains("--input no-data=-32768"),
        "{notes}"
    );
    let arguments = ["cut", "x.asc", "-o", "out", "--input", "no-data=-32768"];
    let output = hapterra(folder.path(), &arguments);
    let notes = String::from_utf8(output.stderr).expect("text");
    assert!(!notes.contains("--input no-data"), "{notes}");
}
