//! The part of a terrain under the hand, by options of `run` and `demo`, and their messages if it
//! is impossible.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra_tests::hapterra_binary;

/// Writes a grid of 40 × 30 cells of this size, its south-west corner at `corner`, with no-data in
/// the north-east.
fn grid(folder: &Path, corner: [f64; 2], cell: f64) -> PathBuf {
    let path = folder.join("terrain.asc");
    let [x, y] = corner;
    let mut text = format!("ncols 40\nnrows 30\nxllcenter {x}\nyllcenter {y}\ncellsize {cell}\n");
    for row in (0..30).rev() {
        let heights = (0..40).map(|column: i32| match column > 34 && row > 24 {
            true => "-9999".to_owned(),
            false => format!("{:.2}", 0.1 * cell * f64::from(column % 7)),
        });
        text += &(heights.collect::<Vec<_>>().join(" ") + "\n");
    }
    std::fs::write(&path, text).expect("written");
    path
}

fn output_text(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}

/// Runs a command for a moment on the device in memory.
fn hapterra(command: &str, file: &Path, more: &[&str]) -> Output {
    Command::new(hapterra_binary())
        .args([command.as_ref(), file.as_os_str()])
        .args(["--device", "native", "--duration", "0.05s"])
        .args(more)
        .current_dir(file.parent().expect("a folder"))
        .output()
        .expect("started")
}

#[test]
fn default_placement_fits_workspace_and_prints_scale() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = grid(folder.path(), [5000.0, 7000.0], 10.0);
    for command in ["run", "demo"] {
        let plain = output_text(&hapterra(command, &file, &[]));
        let place = |text: &str| {
            let lines = text
                .lines()
                .filter(|line| line.starts_with("place") || line.starts_with("scale"));
            lines.map(str::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(place(&plain).len(), 2, "{plain}");
        let scale = &place(&plain)[1];
        let metres: f64 = scale
            .split_whitespace()
            .nth(1)
            .and_then(|s| s.parse().ok())
            .expect("a number");
        // 390 m in 150 to 450 mm.
        assert!((0.8..2.7).contains(&metres), "{scale}");
        assert!(scale.contains("at level 0 a cell is 10 m"), "{scale}");
    }
}

#[test]
fn place_scale_and_level_options_are_applied_and_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = grid(folder.path(), [5000.0, 7000.0], 10.0);
    for (more, parts) in [
        (
            &["--at", "5100,7150", "--scale", "4m/mm"][..],
            [
                "place          x 5100, y 7150",
                "4 ground metres per device millimetre; at level 0 a cell is 10 m, 2.5 mm",
            ],
        ),
        (
            &["--at", "5100,7150"],
            [
                "x 5100, y 7150",
                "10 ground metres per device millimetre; at level 0 a cell is 10 m, 1 mm",
            ],
        ),
        (
            &["--at=5100,7150", "--scale", "2mm/cell", "--level", "2"],
            [
                "x 5100, y 7150",
                "5 ground metres per device millimetre; at level 2 a cell is 40 m, 8 mm",
            ],
        ),
        (
            &["--bbox", "5100,7100,5200,7150"],
            ["place          x 5150, y 7", "at level 0 a cell is 10 m"],
        ),
    ] {
        let run = hapterra("run", &file, more);
        let reported = output_text(&run);
        assert!(run.status.success(), "{more:?}: {reported}");
        for part in parts {
            assert!(reported.contains(part), "{more:?}: {part} in {reported}");
        }
    }
    let flat = output_text(&hapterra(
        "run",
        &file,
        &["--at", "5100,7150", "--scale", "0.5mm/cell"],
    ));
    assert!(flat.contains("mm in the hand; --exaggeration "), "{flat}");
}

#[test]
fn impossible_placement_error_states_bounds_or_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = grid(folder.path(), [5000.0, 7000.0], 10.0);
    let bounds = "x 5000 to 5390, y 7000 to 7290";
    for (more, parts) in [
        (
            &["--at", "0,0"][..],
            ["x 0, y 0 (the file's own coordinates) is outside", bounds],
        ),
        (
            &["--at", "5380,7280"],
            ["there is no data at x 5380, y 7280", bounds],
        ),
        (
            &["--at", "-118.2,34.2", "--crs", "lonlat"],
            ["states no reference system", bounds],
        ),
        (
            &["--bbox", "-118.2,34.2,-118.1,34.3", "--crs", "lonlat"],
            ["states no reference system", "gdal_translate -a_srs"],
        ),
        (
            &["--bbox", "0,0,10,10"],
            ["the box 0,0,10,10 is outside", bounds],
        ),
        (
            &["--bbox", "5370,7270,5390,7290"],
            ["no data in the box", bounds],
        ),
        (
            &["--bbox", "5101,7101,5102,7102"],
            ["smaller than a cell", bounds],
        ),
        (
            &["--bbox", "5200,7100,5100,7200"],
            ["is west,south,east,north", "west before east"],
        ),
        (
            &["--exaggeration", "0"],
            ["heights × 0", "1 is true to scale"],
        ),
        (
            &["--exaggeration", "900mm/unit"],
            ["the relief is", "a smaller --exaggeration"],
        ),
        (
            &["--level", "9"],
            ["level 9 leaves nothing", "a lower --level"],
        ),
    ] {
        for command in ["run", "demo"] {
            let run = hapterra(command, &file, more);
            let reported = output_text(&run);
            assert_eq!(run.status.code(), Some(1), "{command} {more:?}: {reported}");
            for part in parts {
                assert!(
                    reported.contains(part),
                    "{command} {more:?}: {part} in {reported}"
                );
            }
        }
    }
}

#[test]
fn options_that_contradict_each_other_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = grid(folder.path(), [5000.0, 7000.0], 10.0);
    for more in [
        &["--at", "1,2", "--at", "1,2"][..],
        &["--bbox", "1,2,3,4", "--at", "1,2"],
        &["--bbox", "1,2,3,4", "--bbox", "1,2,3,4"],
        &["--bbox", "1,2,3,4", "--scale", "1mm/cell"],
        &["--bbox", "1,2,3,4", "--crs", "lonlat", "--scale", "1m/mm"],
        &["--scale", "1m/mm", "--scale", "1mm/cell"],
        &["--exaggeration", "2", "--exaggeration", "1mm/unit"],
        &["--crs", "file", "--crs", "lonlat"],
    ] {
        let run = hapterra("run", &file, more);
        assert_eq!(
            run.status.code(),
            Some(2),
            "{more:?}: {}",
            output_text(&run)
        );
        assert!(
            output_text(&run).contains("cannot be used"),
            "{more:?}: {}",
            output_text(&run)
        );
    }
    for more in [
        &["--at", "1"][..],
        &["--at", "1,x"],
        &["--bbox", "1,2,3"],
        &["--at", "nan,0"],
    ] {
        let run = hapterra("run", &file, more);
        assert_eq!(
            run.status.code(),
            Some(2),
            "{more:?}: {}",
            output_text(&run)
        );
        assert!(
            output_text(&run).contains("numbers between commas"),
            "{more:?}: {}",
            output_text(&run)
        );
    }
}

/// Returns the ratio of the lengths of a degree of longitude at two latitudes, on a sphere: the
/// difference to the ellipsoid is below the rounding of the figure.
fn narrower(from_deg: f64, to_deg: f64) -> f64 {
    to_deg.to_radians().cos() / from_deg.to_radians().cos()
}

/// Cells are measured at one point. If the arm reaches points where they are off by more than 0.1
/// %, `run` and `demo` print by how much and where; `info` prints it for the whole file.
#[test]
fn cell_distortion_within_workspace_is_printed_at_start() {
    let folder = tempfile::tempdir().expect("a folder");
    // From 40° to 54.5° north.
    let file = grid(folder.path(), [10.0, 40.0], 0.5);
    let degrees = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]"#;
    std::fs::write(folder.path().join("terrain.prj"), degrees).expect("written");
    let shape = |text: &str| {
        let line = text.lines().find(|line| line.starts_with("shape"));
        line.map(|line| {
            let (_, off) = line.split_once("off by up to ").expect("a figure");
            let percent = off.split(' ').next().expect("a number");
            let (_, latitude) = line.split_once("latitude ").expect("a place");
            let latitude = latitude.split([' ', ',']).next().expect("a number");
            [percent, latitude].map(|number| number.parse::<f64>().expect("a number"))
        })
    };
    let expected = |from: f64, to: f64| 100.0 * (narrower(from, to) - 1.0).abs();
    for command in ["run", "demo"] {
        // Everything is in reach: cells of the middle are too wide in the north.
        let all = output_text(&hapterra(command, &file, &["--exaggeration", "9"]));
        let [percent, latitude] = shape(&all).expect("a line");
        // The last row of haptic cells.
        assert!((54.0..54.5).contains(&latitude), "{all}");
        let off = percent - expected(47.25, latitude);
        assert!(
            off.abs() < 0.2,
            "{percent} for {}",
            expected(47.25, latitude)
        );
        // At a scale at which the arm reaches 20 km to each side, cells are correct.
        let near = ["--at", "15,47", "--scale", "5m/mm"];
        let near = output_text(&hapterra(command, &file, &near));
        assert!(near.contains("place ") && shape(&near).is_none(), "{near}");
        // Stored cells are not square anywhere.
        let stored = ["--input", "cells=stored", "--exaggeration", "9"];
        let stored = output_text(&hapterra(command, &file, &stored));
        assert!(
            shape(&stored).is_some_and(|[percent, _]| percent > 20.0),
            "{stored}"
        );
        for part in [
            "not in their true shape",
            "--input cells=square renders them",
        ] {
            assert!(stored.contains(part), "{part} in {stored}");
        }
    }
    let info = |more: &[&str]| {
        let arguments = [&["info", file.to_str().expect("plain")], more].concat();
        let output = Command::new(hapterra_binary()).args(arguments).output();
        String::from_utf8(output.expect("started").stdout).expect("text")
    };
    let [percent, latitude] = shape(&info(&[])).expect("a line");
    assert!((percent - expected(47.25, latitude)).abs() < 0.2 && latitude > 54.0);
    let report: serde_json::Value = serde_json::from_str(&info(&["--json"])).expect("JSON");
    let share = report["cell"]["worst_share"].as_f64().expect("a share");
    assert!((100.0 * share - percent).abs() < 0.01, "{report:#}");
    let there = report["cell"]["worst_at"][1].as_f64().expect("a latitude");
    assert!((there - latitude).abs() < 0.01, "{report:#}");
    // A small field needs no message.
    let file = grid(folder.path(), [10.0, 40.0], 0.0005);
    std::fs::write(folder.path().join("terrain.prj"), degrees).expect("written");
    let small = output_text(&hapterra("run", &file, &["--exaggeration", "9"]));
    assert!(
        small.contains("place ") && shape(&small).is_none(),
        "{small}"
    );
}
