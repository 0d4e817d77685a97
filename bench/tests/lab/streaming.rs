//! Results of `streaming` that do not depend on a clock, and the stored figures.

use std::path::{Path, PathBuf};
use std::process::Command;

use hapterra_lab::report::{self, STREAMING_HEADER};
use hapterra_lab::streaming::{LATENCIES_MS, RATES, Reading, Row, SIDES};

/// Memory limit of the host for any terrain, 10⁶ bytes: the device in the same process takes one of
/// them.
const MAX_MB: f64 = 256.0;

fn rows(path: &Path) -> Vec<Row> {
    let mut table = csv::Reader::from_path(path).expect("it is there");
    assert_eq!(table.headers().expect("a header"), &STREAMING_HEADER[..]);
    table.deserialize().map(|row| row.expect("a row")).collect()
}

fn recorded() -> Vec<Row> {
    rows(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/streaming.csv"))
}

/// Returns the program's success, both of its outputs, and the table that it writes.
fn streamed(name: &str, arguments: &[&str]) -> (bool, String, PathBuf) {
    let csv = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let output = Command::new(env!("CARGO_BIN_EXE_hapterra-lab"))
        .args(["streaming", "--quick", "--latency", "0ms", "--out"])
        .arg(&csv)
        .args(arguments)
        .output()
        .expect("it runs");
    let text =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    (output.status.success(), text.concat(), csv)
}

#[test]
fn streaming_cost_is_independent_of_terrain_size() {
    let (done, text, csv) = streamed("flat.csv", &["--sizes", "7,10"]);
    assert!(done, "{text}");
    let rows = rows(&csv);
    let of = |samples: u64, link: u32| {
        let is = |row: &&Row| {
            let key = (row.samples, row.link_kb_per_s, row.reading);
            key == (samples, link, Reading::Blocks)
        };
        rows.iter().find(is).expect("measured")
    };
    let [small, large] = [SIDES[1], SIDES[4]].map(|side| u64::from(side) * u64::from(side));
    for link in RATES {
        let (small, large) = (of(small, link), of(large, link));
        // The same path over the same samples: tiles differ by the size of their numbers, and by
        // the link ticks of the fallback, which has other heights.
        let [a, b] = [small, large].map(|row| row.tiles.expect("tiles"));
        assert!(a.abs_diff(b) <= 3, "{a} {b}");
        let [a, b] = [small, large].map(|row| row.tile_bytes_mean.expect("tiles"));
        assert!(
            (a - b).abs() < 4.0 && (900.0..1300.0).contains(&a),
            "{a} {b}"
        );
        assert!(large.tile_bytes_p99 < Some(1300), "{large:?}");
        // A hand at 500 cells a second never has missing ground.
        for row in [small, large] {
            let [[straight, ..], [turning, ..]] = row.missing();
            assert_eq!([straight, turning], [Some(0); 2], "{row:?}");
        }
        // A fallback avoids no-data at any speed, and a slow hand never needs it.
        for row in [small, large] {
            let [[straight, ..], [turning, ..]] = row.coarse();
            let shares = [straight, turning, row.no_data_over_fallback];
            assert_eq!(shares, [Some(0); 3], "{row:?}");
        }
        let held = |row: &Row| [row.held_straight, row.held_turning];
        assert_eq!(held(small), held(large));
        assert!(
            held(small).iter().all(|speed| *speed > Some(500.0)),
            "{small:?}"
        );
        assert!(small.tiles_per_s > Some(f64::from(link) / 3.0), "{small:?}");
        // From the file: the same blocks, in as many reads. The index grows by 8 bytes a block.
        if let [Some(a), Some(b)] = [small, large].map(|row| row.way_bytes) {
            assert!(a.abs_diff(b) < a / 100, "{a} {b}");
            // The near tile of the fallback lies a multiple of its cells from the corner of the
            // wide one, which differs between the terrains: its border may reach a block farther.
            let [a, b] = [small, large].map(|row| row.way_requests.expect("of the file"));
            assert!(a.abs_diff(b) <= 1, "{a} {b}");
            assert!(large.open_bytes < Some(2_000_000), "{large:?}");
        }
        for row in [small, large] {
            assert!(row.peak_mb.is_none_or(|peak| peak < MAX_MB), "{row:?}");
        }
    }
}

#[test]
fn small_file_is_reported_and_the_other_is_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let [hills, small] = ["hills.asc", "small.asc"].map(|name| folder.path().join(name));
    let field = |side: usize, path: &Path| {
        let row = |y: usize| {
            let heights = (0..side).map(|x| format!("{}", (x * 7 + y * 3) % 13));
            heights.collect::<Vec<_>>().join(" ")
        };
        let rows: Vec<String> = (0..side).map(row).collect();
        let head = format!("ncols {side}\nnrows {side}\nxllcorner 0\nyllcorner 0\ncellsize 10\n");
        std::fs::write(path, head + &rows.join("\n") + "\n").expect("written");
    };
    field(480, &hills);
    field(90, &small);
    let png = folder.path().join("streaming.png");
    let names = [&hills, &small, &png].map(|path| path.to_str().expect("text"));
    let (done, text, csv) = streamed(
        "files.csv",
        &["--files-only", names[0], names[1], "-o", names[2]],
    );
    assert!(done, "{text}");
    assert!(
        text.contains("small.asc: 90 × 90 samples; the paths need 460"),
        "{text}"
    );
    let rows = rows(&csv);
    assert_eq!(rows.len(), RATES.len());
    for row in rows {
        // Text has no blocks.
        assert_eq!((&*row.terrain, row.reading), ("hills", Reading::Whole));
        assert_eq!(row.missing()[0][0], Some(0), "{row:?}");
    }
    let picture = std::fs::read(&png).expect("drawn");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 10_000);
    let (done, text, _) = streamed("none.csv", &["--files-only", names[1]]);
    assert!(!done && text.contains("nothing was measured"), "{text}");
}

#[test]
#[cfg(not(feature = "remote"))]
fn latencies_without_remote_feature_are_refused_with_hint() {
    let output = Command::new(env!("CARGO_BIN_EXE_hapterra-lab"))
        .args(["streaming", "--latency", "0ms,50ms"])
        .output()
        .expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && text.contains("--features remote"),
        "{text}"
    );
}

#[test]
fn recorded_figures_cover_all_sizes_and_latencies() {
    let rows = recorded();
    for side in SIDES {
        for latency in LATENCIES_MS {
            for link in RATES {
                let samples = u64::from(side) * u64::from(side);
                let is = |row: &&Row| {
                    let place = (row.samples, row.latency_ms, row.link_kb_per_s);
                    place == (samples, latency, link) && row.reading == Reading::Blocks
                };
                let found: Vec<&Row> = rows.iter().filter(is).collect();
                let [row] = found[..] else {
                    panic!("{side} {latency} {link}: {} rows", found.len());
                };
                assert!(row.peak_mb < Some(MAX_MB), "{row:?}");
                assert!(row.held_straight.is_some() && row.missing()[1][2].is_some());
                assert_eq!(row.no_data_over_fallback, Some(0), "{row:?}");
            }
        }
    }
    let whole = rows.iter().filter(|row| row.reading == Reading::Whole);
    let sides: Vec<u64> = whole.map(|row| row.samples).collect();
    assert_eq!(sides.len(), 3 * RATES.len(), "10⁶ to 10⁸ as a whole");
}

#[test]
fn picture_is_drawn_from_recorded_figures() {
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("streaming.png");
    report::draw_streaming(&recorded(), &file).expect("it is drawn");
    let written = std::fs::read(file).expect("it is there");
    assert!(written.starts_with(b"\x89PNG") && written.len() > 20_000);
}
