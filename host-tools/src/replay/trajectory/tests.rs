//! Tests with trajectories written by hand, by programs, and by this program.

use super::*;

fn rows(text: &str) -> Result<Vec<Row>, TrajectoryError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("t.csv");
    std::fs::write(&path, text).expect("written");
    rows_of(&path)
}

fn rows_of(path: &Path) -> Result<Vec<Row>, TrajectoryError> {
    let scale = Scale::new(1.0, 1.0).expect("valid");
    let mut trajectory = Trajectory::open(path)?;
    let mut rows = Vec::new();
    while let Some(row) = trajectory.next_row()? {
        trajectory.to_grid(row.hip_mm, &scale)?;
        rows.push(row);
    }
    Ok(rows)
}

fn message(text: &str) -> String {
    rows(text).expect_err("is wrong").to_string()
}

#[test]
fn white_space_line_ends_and_byte_order_marks_are_ignored() {
    let plain = rows("t_s,x_mm,y_mm,z_mm\n0,1,2.5,-3e1\n0.001,4,5,6\n").expect("plain");
    assert_eq!(plain.len(), 2);
    assert_eq!(plain[0].hip_mm, [1.0, 2.5, -30.0]);
    for same in [
        "t_s,x_mm,y_mm,z_mm\r\n0,1,2.5,-3e1\r\n0.001,4,5,6",
        "\u{feff}t_s,x_mm,y_mm,z_mm\n0,1,2.5,-3e1\n\n0.001,4,5,6\n",
        " t_s , x_mm,y_mm ,z_mm\n 0, 1,\t2.5 ,-3e1 \n0.001,4,5,6\n",
        "t_s,x_mm,y_mm,z_mm,note\n0,1,2.5,-3e1,a\n0.001,4,5,6,\n",
        "# a remark\n#\nt_s,x_mm,y_mm,z_mm\n0,1,2.5,-3e1\n# another\n0.001,4,5,6\n",
        "\"t_s\",\"x_mm\",\"y_mm\",\"z_mm\"\n\"0\",1,2.5,-3e1\n0.001,4,5,6\n",
    ] {
        assert_eq!(rows(same).expect(same), plain, "{same:?}");
    }
    assert_eq!(rows("t_s,x_mm,y_mm,z_mm").expect("header only"), []);
}

#[test]
fn trajectory_may_have_no_times() {
    let plain = rows("x_mm,y_mm,z_mm\n1,2.5,-3e1\n4,5,6\n").expect("plain");
    let places: Vec<_> = plain.iter().map(|row| (row.t_s, row.hip_mm)).collect();
    assert_eq!(places, [(None, [1.0, 2.5, -30.0]), (None, [4.0, 5.0, 6.0])]);
    let more = rows("x_mm,y_mm,z_mm,view,t_s\n1,2,3,7,9\n").expect("further columns");
    assert_eq!((more[0].t_s, more[0].view), (None, 7));
    let wrong = message("x_mm,y_mm,z_mm\n1,2\n");
    assert!(
        wrong.contains("line 2 has 2 columns where the header has 3"),
        "{wrong}"
    );
    let wrong = message("x_mm,y_mm,z_mm\n1,2,high\n");
    assert!(wrong.contains("line 2, column z_mm: `high`"), "{wrong}");
}

#[test]
fn earlier_state_names_are_updated() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("t.csv");
    let text = "t_s,x_mm,y_mm,z_mm,contact,state\n0,1,2,3,0,waiting\n1,1,2,3,0,letting go\n2,1,2,3,0,unseeded\n3,1,2,3,0,free\n";
    std::fs::write(&path, text).expect("written");
    let read = RecordedColumns::read(&path).expect("a recording");
    let states = ["unseeded", "releasing", "unseeded", "free"].map(String::from);
    let last = read.columns.last();
    assert_eq!(
        last,
        Some(&("state".into(), ColumnValues::Texts(states.into())))
    );
}

#[test]
fn cut_recording_has_the_rows_before_the_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("t.csv");
    let whole =
        "# a remark\nt_s,x_mm,y_mm,z_mm,contact,state\n0,1,2,3,0,free\n0.001,4,5,6,1,touching\n";
    // Not after the last comma: there the missing text would not be noticed.
    let last_row = whole.len() - "0.001,4,5,6,1,touching\n".len();
    let last_comma = whole.len() - "touching\n".len();
    for end in last_row + 1..last_comma {
        std::fs::write(&path, &whole[..end]).expect("written");
        let mut trajectory = Trajectory::open(&path).expect("a header");
        let mut next = || trajectory.next_row().expect("whole rows");
        assert_eq!(next().map(|row| row.hip_mm), Some([1.0, 2.0, 3.0]));
        assert_eq!(next(), None, "{:?}", &whole[..end]);
        assert!(trajectory.was_cut());
    }
    // In the middle of a file a short row is an error, and so it is in a file written by hand.
    for wrong in [
        "t_s,x_mm,y_mm,z_mm,contact\n0,1,2\n0.001,4,5,6,1\n",
        "t_s,x_mm,y_mm,z_mm,contact\n0,1,2\n",
        "t_s,x_mm,y_mm,z_mm\n0,1,2",
    ] {
        std::fs::write(&path, wrong).expect("written");
        let error = rows_of(&path).expect_err("is wrong").to_string();
        assert!(error.contains("line 2 has 3 columns"), "{error}");
    }
    assert_eq!(rows(whole).expect("whole").len(), 2);
}

#[test]
fn parse_error_names_file_line_and_column() {
    let cases = [
        ("", "line 1 is not the header"),
        ("0,1,2,3\n", "line 1 is not the header"),
        ("t_s,x_mm,z_mm,y_mm\n", "line 1 is not the header"),
        ("0,1,2\n", "line 2 has 3 columns where the header has 4"),
        ("0,1,2,3\n0,1,2,3,4\n", "line 3 has 5 columns"),
        ("0,1,2,3\n\n0,one,2,3\n", "line 4, column x_mm: `one`"),
        ("0,1,2,3\r\n0,1,2,x\r\n", "line 3, column z_mm: `x`"),
        ("0,1,nan,3\n", "line 2, column y_mm: `nan`"),
        (
            "# a\n0,1,2,3\n# b\n\n0,1,nan,3\n",
            "line 6, column y_mm: `nan`",
        ),
        ("inf,1,2,3\n", "line 2, column t_s: `inf`"),
        ("0,1,2,\n", "line 2, column z_mm: ``"),
        (
            "0,1,-6e8,3\n",
            "line 2, column y_mm: -600000000 mm is farther",
        ),
        ("0,1,2,1e300\n", "line 2, column z_mm"),
    ];
    for (text, expected) in cases {
        let whole = match expected.contains("header") && !expected.contains("has") {
            true => text.to_owned(),
            false => format!("t_s,x_mm,y_mm,z_mm\n{text}"),
        };
        let message = message(&whole);
        assert!(message.contains("t.csv: "), "{message}");
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn header_error_after_comments_has_its_line() {
    let wrong = message("# one\n# two\ntime,x,y,z\n");
    assert!(wrong.contains("line 3 is not the header"), "{wrong}");
}

#[test]
fn later_settings_format_is_refused_and_remarks_are_ignored() {
    let later = message("# hapterra-recording = 9\nt_s,x_mm,y_mm,z_mm\n");
    assert!(later.contains("format 9"), "{later}");
    assert_eq!(
        rows("# anything = ]\nt_s,x_mm,y_mm,z_mm\n").expect("none"),
        []
    );
}

#[test]
fn file_with_only_the_parquet_magic_is_refused() {
    let wrong = message("PAR1 and so on");
    assert!(wrong.contains("cannot read the trajectory"), "{wrong}");
}
