//! Tests of the ticks of small paths against values computed by hand.

use super::*;

/// Returns a folder, and the ticks of a path of (t_s, x_mm) in it.
fn ticks_of(text: &str, pace: Pace, tick_hz: u32) -> (tempfile::TempDir, TrajectoryTicks) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("t.csv");
    std::fs::write(&path, text).expect("written");
    let trajectory = Trajectory::open(&path).expect("a trajectory");
    (folder, TrajectoryTicks::new(trajectory, pace, tick_hz))
}

/// Returns a path along x; the times are written unchanged.
fn path(rows: &[(&str, f64)]) -> String {
    let rows = rows.iter().map(|(t, x)| format!("{t},{x},7,-1\n"));
    format!("t_s,x_mm,y_mm,z_mm\n{}", rows.collect::<String>())
}

/// Returns time and x of each tick.
fn read(ticks: &mut TrajectoryTicks) -> Result<Vec<(f64, f64)>, String> {
    let mut all = Vec::new();
    while let Some(tick) = ticks.next_tick().map_err(|error| error.to_string())? {
        assert_eq!((tick.hip_mm[1], tick.hip_mm[2]), (7.0, -1.0));
        all.push((tick.t_s, tick.hip_mm[0]));
    }
    Ok(all)
}

fn by_time(rows: &[(&str, f64)]) -> Result<Vec<(f64, f64)>, String> {
    read(&mut ticks_of(&path(rows), Pace::ByTime, 1000).1)
}

fn recorded(rows: &[(&str, f64)], tick_hz: u32) -> Result<Vec<(f64, f64)>, String> {
    read(&mut ticks_of(&path(rows), Pace::Recorded, tick_hz).1)
}

/// Checks that both are equal except for rounding.
fn same(found: &[(f64, f64)], expected: &[(f64, f64)]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((t, x), (due, place)) in found.iter().zip(expected) {
        let off = (t - due).abs().max((x - place).abs());
        assert!(off < 1e-9, "{found:?}, not {expected:?}");
    }
}

/// Rows one tick apart: the notation of the times does not matter.
#[test]
fn rows_a_tick_apart_are_ticks_bit_for_bit() {
    let x = |row: u32| (f64::from(row) * 0.7).sin();
    let write: [&dyn Fn(u32) -> String; 6] = [
        &|row| format!("{}", f64::from(row) * 1e-3),
        &|row| format!("{:.3}", f64::from(row) * 1e-3),
        &|row| format!("{:e}", f64::from(row) * 1e-3 - 5.0),
        &|row| format!("{}", f64::from(row) / 1000.0 + 1_767_225_600.0),
        &|row| format!("{}", row as f32 / 1000.0),
        &|row| format!("{:.6}", f64::from(row) * 1e-3 + 0.000_000_4),
    ];
    for (variant, write) in write.iter().enumerate() {
        let times: Vec<_> = (0..5_000).map(write).collect();
        let rows: Vec<_> = (0..).zip(&times).map(|(row, t)| (&t[..], x(row))).collect();
        let ticks = by_time(&rows).expect("ticks");
        assert_eq!(ticks.len(), rows.len(), "{variant}");
        for ((t, place), row) in ticks.iter().zip(&rows) {
            let written: f64 = row.0.parse().expect("a time");
            assert_eq!(
                (t.to_bits(), place.to_bits()),
                (written.to_bits(), row.1.to_bits())
            );
        }
    }
}

#[test]
fn positions_between_rows_are_interpolated_linearly() {
    let found = by_time(&[("2", 1.0), ("2.004", 5.0), ("2.006", 4.0)]).expect("ticks");
    let x = [1.0, 2.0, 3.0, 4.0, 5.0, 4.5, 4.0];
    let expected: Vec<_> = (0..7).map(|n| 2.0 + f64::from(n) * 1e-3).zip(x).collect();
    same(&found, &expected);
    // Times between ticks: 1.5 ms, 2.5 ms and 3.9 ms.
    let found = by_time(&[
        ("0", 0.0),
        ("0.0015", 3.0),
        ("0.0025", 7.0),
        ("0.0039", 0.0),
    ]);
    let expected = [(0.0, 0.0), (0.001, 2.0), (0.002, 5.0), (0.003, 4.5)];
    same(&found.expect("ticks"), &expected);
}

/// 100 mm/s is 0.1 mm in each tick, whatever the jitter of the rows.
#[test]
fn steady_speed_survives_jitter() {
    let times = [0.0, 0.0009, 0.0021, 0.0024, 0.0029, 0.0052, 0.006].map(|t: f64| t.to_string());
    let rows: Vec<_> = times
        .iter()
        .map(|t| (&t[..], 100.0 * t.parse::<f64>().expect("s")))
        .collect();
    let expected: Vec<_> = (0..7)
        .map(|n| (f64::from(n) * 1e-3, f64::from(n) * 0.1))
        .collect();
    same(&by_time(&rows).expect("ticks"), &expected);
}

/// A clock that is 0.1 % slow: 10,000 of its rows last 10,010 ticks.
#[test]
fn slow_clock_gains_a_tick_in_a_thousand() {
    let times: Vec<_> = (0..=10_000)
        .map(|row| (f64::from(row) * 1.001e-3).to_string())
        .collect();
    let rows: Vec<_> = times
        .iter()
        .map(|t| (&t[..], t.parse().expect("s")))
        .collect();
    let found = by_time(&rows).expect("ticks");
    assert_eq!(found.len(), 10_011);
    for ((t, x), n) in found.iter().zip(0..) {
        // A row within a hundredth of a tick counts as that tick.
        assert!(
            (t - f64::from(n) * 1e-3).abs() <= 1.01e-5 && (t - x).abs() < 1e-9,
            "{t} {x}"
        );
    }
}

#[test]
fn duration_is_the_same_from_1_hz_to_100_khz() {
    for hz in [
        1_u32, 10, 90, 333, 999, 1_000, 1_001, 3_000, 10_000, 100_000,
    ] {
        let times: Vec<_> = (0..=2 * hz)
            .map(|row| f64::from(row) / f64::from(hz))
            .collect();
        let text: Vec<_> = times.iter().map(f64::to_string).collect();
        let rows: Vec<_> = text
            .iter()
            .zip(&times)
            .map(|(t, x)| (&t[..], 50.0 * x))
            .collect();
        let (_folder, mut ticks) = ticks_of(&path(&rows), Pace::ByTime, 1000);
        let found = read(&mut ticks).expect("ticks");
        assert_eq!(found.len(), 2_001, "{hz} Hz");
        for ((_, x), n) in found.iter().zip(0..) {
            assert!(
                (x - 0.05 * f64::from(n)).abs() < 1.01e-2 * 0.05,
                "{hz} Hz: {x} at {n}"
            );
        }
        assert_eq!(ticks.pace().is_none(), hz == 1_000, "{hz} Hz");
        let remarks = ticks.remarks().join(" ");
        assert_eq!(
            remarks.contains("straight lines"),
            hz < 20,
            "{hz} Hz: {remarks}"
        );
        let not_rendered = "18000 of 20001 rows lie between two ticks and are not rendered";
        assert_eq!(
            remarks.contains(not_rendered),
            hz == 10_000,
            "{hz} Hz: {remarks}"
        );
    }
}

#[test]
fn ticks_end_with_the_last_row_not_after_it() {
    let x = |rows: &[(&str, f64)]| by_time(rows).expect("ticks").len();
    assert_eq!(
        x(&[("0", 0.0), ("0.000991", 1.0)]),
        2,
        "to a hundredth of a tick"
    );
    assert_eq!(x(&[("0", 0.0), ("0.00098", 1.0)]), 1);
    assert_eq!(x(&[("0", 0.0), ("0.00198", 1.0)]), 2);
    assert_eq!(x(&[("5", 0.0)]), 1);
    assert_eq!(x(&[]), 0);
}

#[test]
fn impossible_times_are_errors() {
    for (rows, expected) in [
        (
            &[("0", 0.0), ("0.002", 1.0), ("0.001", 2.0)][..],
            "line 4, column t_s: time decreases from 0.002 s to 0.001 s",
        ),
        (
            &[("0", 0.0), ("0.002", 1.0), ("0.002", 2.0)],
            "line 4, column t_s: two places at 0.002 s",
        ),
        (
            &[("0", 0.0), ("0", 1.0), ("0.002", 2.0)],
            "line 4, column t_s: time begins at 0.002 s, and all rows before",
        ),
        (
            &[("0", 0.0), ("0.001", 1.0), ("2.1", 2.0)],
            "line 4, column t_s: the HIP moves during a gap of 2.099 s",
        ),
        (
            &[("0", 0.0), ("601", 0.0)],
            "line 3, column t_s: a gap of 601 s",
        ),
        // Another clock, and milliseconds since 1970.
        (
            &[("0", 0.0), ("1767225600", 0.0)],
            "line 3, column t_s: a gap",
        ),
        (
            &[("1767225600000", 0.0), ("1767225600001", 0.0)],
            "line 2, column t_s: numbers near 1767225600000 s",
        ),
        // Milliseconds at 100 Hz.
        (
            &[("0", 0.0), ("10", 1.0), ("20", 2.0)],
            "line 3, column t_s: the HIP moves during a gap",
        ),
    ] {
        let message = by_time(rows).expect_err("is wrong");
        assert!(message.contains(expected), "{rows:?}: {message}");
    }
}

#[test]
fn rest_is_rendered_and_repeated_rows_are_omitted() {
    let rows = [
        ("0", 1.0),
        ("0", 1.0),
        ("0.001", 2.0),
        ("0.001", 2.0),
        ("3.001", 2.0),
    ];
    let (_folder, mut ticks) = ticks_of(&path(&rows), Pace::ByTime, 1000);
    let found = read(&mut ticks).expect("ticks");
    assert_eq!(found.len(), 3_002);
    assert!(found[1..].iter().all(|(_, x)| *x == 2.0));
    let remarks = ticks.remarks();
    assert_eq!(
        remarks,
        ["2 rows repeat time and place of the row before, and are left out"]
    );
}

#[test]
fn rows_without_or_with_equal_times_are_ticks() {
    let text = "x_mm,y_mm,z_mm\n5,7,-1\n6,7,-1\n6,7,-1\n";
    let (_folder, mut ticks) = ticks_of(text, Pace::ByTime, 4000);
    let found = read(&mut ticks).expect("ticks");
    assert_eq!(found, [(0.0, 5.0), (0.000_25, 6.0), (0.000_5, 6.0)]);
    let pace = ticks.pace().expect("said");
    assert_eq!(
        pace,
        "one row of the path a tick, 4000 ticks a second: it has no t_s"
    );
    for (rows, x) in [
        (
            &[("3", 5.0), ("3", 5.0), ("3", 6.0), ("3", 6.0)][..],
            &[5.0, 5.0, 6.0, 6.0][..],
        ),
        (&[("3", 5.0), ("3", 6.0), ("3", 5.0)], &[5.0, 6.0, 5.0]),
        (&[("3", 5.0), ("3", 5.0), ("3", 5.0)], &[5.0, 5.0, 5.0]),
    ] {
        let (_folder, mut ticks) = ticks_of(&path(rows), Pace::ByTime, 1000);
        let expected: Vec<_> = (0..)
            .map(|n| 3.0 + f64::from(n) * 1e-3)
            .zip(x.iter().copied())
            .collect();
        same(&read(&mut ticks).expect("ticks"), &expected);
        assert!(
            ticks
                .pace()
                .expect("said")
                .contains("t_s is 3 in all of them")
        );
    }
}

#[test]
fn row_by_row_pace_makes_each_row_one_tick() {
    for times in [["0", "0.01", "0.02"], ["9", "3", "5"], ["0", "0", "1e9"]] {
        let rows = [(times[0], 1.0), (times[1], 2.0), (times[2], 3.0)];
        let (_folder, mut ticks) = ticks_of(&path(&rows), Pace::RowByRow, 1000);
        let begin: f64 = times[0].parse().expect("s");
        let expected = [(begin, 1.0), (begin + 1e-3, 2.0), (begin + 2e-3, 3.0)];
        same(&read(&mut ticks).expect("ticks"), &expected);
        assert_eq!(
            ticks.pace().as_deref(),
            Some("one row of the path a tick, 1000 ticks a second")
        );
    }
    // Right times are kept exactly.
    let rows = [("0.1", 1.0), ("0.1010001", 2.0)];
    let (_folder, mut ticks) = ticks_of(&path(&rows), Pace::RowByRow, 1000);
    assert_eq!(
        read(&mut ticks).expect("ticks"),
        [(0.1, 1.0), (0.101_000_1, 2.0)]
    );
}

#[test]
fn recording_rows_are_whole_ticks_apart() {
    let rows = [("0.25", 1.0), ("0.2501", 2.0), ("0.2504", 8.0)];
    let found = recorded(&rows, 10_000).expect("ticks");
    let expected = [
        (0.25, 1.0),
        (0.2501, 2.0),
        (0.2502, 4.0),
        (0.2503, 6.0),
        (0.2504, 8.0),
    ];
    same(&found, &expected);
    for (rows, tick_hz, expected) in [
        (
            &[("0", 1.0), ("0.00025", 2.0)],
            1000,
            "line 3, column t_s: 0.00025 s is 0.25 ticks after the row before, but the settings state 1000 ticks a second",
        ),
        (&[("0", 1.0), ("0.0015", 2.0)], 1000, "1.5 ticks after"),
        (&[("0", 1.0), ("0.001", 2.0)], 3000, ""),
        (&[("0", 1.0), ("0", 2.0)], 1000, "two places at 0 s"),
        (&[("1", 1.0), ("0.9", 2.0)], 1000, "decreases"),
    ] {
        match recorded(rows, tick_hz) {
            Ok(ticks) => assert_eq!((ticks.len(), expected), (4, "")),
            Err(message) => assert!(
                !expected.is_empty() && message.contains(expected),
                "{message}"
            ),
        }
    }
    // A clock that drifts against the ticks is detected by its fifth row at the latest.
    let times: Vec<_> = (0..9)
        .map(|row| (f64::from(row) * 1.003e-3).to_string())
        .collect();
    let rows: Vec<_> = times.iter().map(|t| (&t[..], 0.0)).collect();
    let message = recorded(&rows, 1000).expect_err("drifts");
    assert!(
        message.contains("line 6, column t_s: 0.004012 s"),
        "{message}"
    );
}

#[test]
fn long_recording_gaps_are_not_interpolated() {
    let rows = [("0", 1.0), ("0.001", 2.0), ("3", 9.0), ("3.002", 11.0)];
    let (_folder, mut ticks) = ticks_of(&path(&rows), Pace::Recorded, 1000);
    let expected = [
        (0.0, 1.0),
        (0.001, 2.0),
        (3.0, 9.0),
        (3.001, 10.0),
        (3.002, 11.0),
    ];
    same(&read(&mut ticks).expect("ticks"), &expected);
    let remarks = ticks.remarks();
    assert_eq!(
        remarks,
        ["1 gaps of the recording are longer than 2 s, and nothing is filled in"]
    );
}

#[test]
fn rows_of_different_placements_are_not_interpolated() {
    let text =
        "t_s,x_mm,y_mm,z_mm,view\n0,1,7,-1,0\n0.002,3,7,-1,0\n0.005,50,7,-1,1\n0.007,60,7,-1,1\n";
    let (_folder, mut ticks) = ticks_of(text, Pace::Recorded, 1000);
    let mut all = Vec::new();
    while let Some(tick) = ticks.next_tick().expect("ticks") {
        all.push((tick.hip_mm[0], tick.view));
    }
    assert_eq!(
        all,
        [
            (1.0, 0),
            (2.0, 0),
            (3.0, 0),
            (50.0, 1),
            (55.0, 1),
            (60.0, 1)
        ]
    );
    // A path without settings has no placements.
    let (_folder, mut ticks) = ticks_of(text, Pace::ByTime, 1000);
    assert_eq!(read(&mut ticks).expect("ticks").len(), 8);
}
