//! `hapterra replay` as a command: its format, and its failures.

use std::path::Path;
use std::process::{Command, Output};

use hapterra_tests::hapterra_binary;

const HEADER: &str =
    "t_s,x_mm,y_mm,z_mm,contact,proxy_x_mm,proxy_y_mm,proxy_z_mm,force_x_n,force_y_n,force_z_n";
/// A plane rising by one unit a column, cells of 10 m.
const TERRAIN: &str =
    "ncols 40\nnrows 30\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(trajectory: &str) -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        let row = (0..40).map(|x| (x * 10).to_string()).collect::<Vec<_>>();
        let rows = vec![row.join(" "); 30].join("\n");
        folder.write("terrain.asc", &format!("{TERRAIN}{rows}\n"));
        folder.write("in.csv", trajectory);
        folder
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn replay(&self, more: &[&str]) -> Output {
        Command::new(hapterra_binary())
            .arg("replay")
            .args([self.path("terrain.asc"), self.path("in.csv")])
            .arg("--out")
            .arg(self.path("out.csv"))
            .args(more)
            .output()
            .expect("started")
    }

    /// Returns the rows of a successful replay as text.
    fn replayed(&self, more: &[&str]) -> Vec<Vec<String>> {
        let run = self.replay(more);
        assert!(run.status.success(), "{}", output_text(&run));
        let text = std::fs::read_to_string(self.path("out.csv")).expect("there");
        let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
        let header = lines.next().expect("a header");
        assert!(header == HEADER || header.starts_with(&format!("{HEADER},")));
        lines
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect()
    }

    /// Checks that a replay fails with exit code 1 and leaves no files. Returns its messages.
    fn fails(&self, more: &[&str]) -> String {
        let run = self.replay(more);
        assert_eq!(run.status.code(), Some(1), "{}", output_text(&run));
        let left: Vec<_> = std::fs::read_dir(self.0.path())
            .expect("listed")
            .map(|entry| entry.expect("entry").file_name())
            .filter(|name| name != "terrain.asc" && name != "in.csv")
            .collect();
        assert!(left.is_empty(), "left behind: {left:?}");
        let printed = output_text(&run);
        assert!(
            printed.contains("error: ") && printed.contains("hint: "),
            "{printed}"
        );
        printed
    }
}

fn output_text(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

fn number(text: &str) -> f64 {
    text.parse()
        .unwrap_or_else(|_| panic!("`{text}` is a number"))
}

const PRESS: &str = "t_s,x_mm,y_mm,z_mm\n0,10.1,7.3,14\n0.001,10.1,7.3,9.6\n0.002,10.1,7.3,0.1e1\n0.003,10.123456789012345,7.3,13\n";

#[test]
fn replay_writes_one_row_per_input_row_with_stated_columns() {
    let folder = Folder::new(PRESS);
    let rows = folder.replayed(&["--scale", "1mm/cell"]);
    assert_eq!(rows.len(), 4);
    let contacts: Vec<_> = rows.iter().map(|row| row[4].as_str()).collect();
    assert_eq!(contacts, ["0", "1", "1", "0"]);
    // The input returns as the same number, and out of contact the proxy is the HIP.
    let went_in: f64 = "10.123456789012345".parse().expect("a number");
    assert_eq!(number(&rows[3][1]).to_bits(), went_in.to_bits());
    for row in [&rows[0], &rows[3]] {
        assert_eq!(row[1..4], row[5..8]);
        assert!(row[8..11].iter().all(|force| number(force) == 0.0));
    }
    // The plane rises by 10 units of 1 m on cells of 10 m: 45° at true proportions. Pressed down by
    // d at a point, the proxy is d/2 up and d/2 west, the force 0.5 N/mm times that.
    for row in &rows[1..3] {
        let [x, z] = [number(&row[1]), number(&row[3])];
        let half = 0.5 * (x - z);
        assert!((number(&row[5]) - (x - half)).abs() < 1e-5, "{row:?}");
        assert!((number(&row[6]) - 7.3).abs() < 1e-5, "{row:?}");
        assert!((number(&row[7]) - (z + half)).abs() < 1e-5, "{row:?}");
        assert!((number(&row[8]) + 0.5 * half).abs() < 1e-5, "{row:?}");
        assert!((number(&row[10]) - 0.5 * half).abs() < 1e-5, "{row:?}");
    }
}

#[test]
fn scale_stiffness_and_limit_are_as_stated() {
    let press = "t_s,x_mm,y_mm,z_mm\n0,20,10,90\n0.001,20,10,10\n0.002,20,10,-60\n";
    let folder = Folder::new(press);
    let flat = ["--scale", "2mm/cell", "--exaggeration", "0mm/unit"];
    let replayed = |more: &[&str]| folder.replayed(&[&flat, more].concat());
    // With all heights zero there is a table at zero.
    let rows = replayed(&["--stiffness", "0.125", "--max-force", "5"]);
    assert_eq!(rows[1][4], "0");
    assert_eq!(number(&rows[2][7]), 0.0);
    assert!(
        (number(&rows[2][10]) - 5.0).abs() < 1e-5,
        "limited: {:?}",
        rows[2]
    );
    let rows = replayed(&["--stiffness", "0.125", "--max-force", "50"]);
    assert!((number(&rows[2][10]) - 7.5).abs() < 1e-5, "{:?}", rows[2]);
}

#[test]
fn replay_is_deterministic_and_accepts_its_own_output() {
    let folder = Folder::new(PRESS);
    let first = folder.replayed(&[]);
    let bytes = std::fs::read(folder.path("out.csv")).expect("there");
    assert_eq!(folder.replayed(&[]), first);
    assert_eq!(std::fs::read(folder.path("out.csv")).expect("there"), bytes);
    std::fs::copy(folder.path("out.csv"), folder.path("in.csv")).expect("copied");
    assert_eq!(folder.replayed(&[]), first);
}

#[test]
fn empty_trajectory_gives_empty_recording() {
    let folder = Folder::new("t_s,x_mm,y_mm,z_mm\r\n");
    assert!(folder.replayed(&[]).is_empty());
}

#[test]
fn invalid_trajectory_is_refused_with_line_and_column() {
    for (rows, expected) in [
        ("0,1,2,3\n1,2,3\n", "line 3 has 3 columns"),
        ("0,1,2,3\n1,2,NaN,4\n", "line 3, column y_mm"),
        ("0,1,2,3\n1,2,3,high\n", "line 3, column z_mm: `high`"),
        ("0,1e12,2,3\n", "line 2, column x_mm"),
    ] {
        let folder = Folder::new(&format!("t_s,x_mm,y_mm,z_mm\n{rows}"));
        let printed = folder.fails(&[]);
        assert!(printed.contains("in.csv: "), "{printed}");
        assert!(printed.contains(expected), "{printed}");
    }
    let printed = Folder::new("time,x,y,z\n0,1,2,3\n").fails(&[]);
    assert!(printed.contains("line 1 is not the header"), "{printed}");
}

#[test]
fn failed_replay_keeps_the_old_output() {
    let folder = Folder::new("t_s,x_mm,y_mm,z_mm\n0,1,2,3\n0,1,2,x\n");
    folder.write("out.csv", "precious");
    let run = folder.replay(&[]);
    assert_eq!(run.status.code(), Some(1));
    let kept = std::fs::read_to_string(folder.path("out.csv"));
    assert_eq!(kept.expect("there"), "precious");
}

#[test]
fn impossible_options_are_errors_before_anything_runs() {
    let folder = Folder::new(PRESS);
    for (more, expected) in [
        (&["--exaggeration", "1e9mm/unit"][..], "heights reach"),
        (&["--stiffness", "-1"], "not below 0"),
        (&["--level", "9"], "level 9 leaves nothing"),
    ] {
        let more: Vec<String> = match more {
            [name, value] => vec![format!("{name}={value}")],
            _ => unreachable!("a name and a value"),
        };
        let more: Vec<&str> = more.iter().map(String::as_str).collect();
        let printed = folder.fails(&more);
        assert!(printed.contains(expected), "{more:?}: {printed}");
    }
    let missing = folder.path("no-such-image.elf");
    let device = format!("--device=emulated:{}", missing.display());
    let printed = folder.fails(&[&device]);
    assert!(printed.contains("no-such-image.elf"), "{printed}");
    assert!(printed.contains("cargo xtask demo"), "{printed}");
}

#[test]
fn missing_device_error_names_address_and_hint() {
    let folder = Folder::new(PRESS);
    let run = |device: &str| {
        let run = Command::new(hapterra_binary())
            .args([Path::new("run"), &folder.path("terrain.asc")])
            .args(["--device", device])
            .output()
            .expect("started");
        assert_eq!(run.status.code(), Some(1), "{}", output_text(&run));
        output_text(&run)
    };
    // Port 9 (discard) normally has no server.
    let tcp = run("tcp:127.0.0.1:9");
    assert!(
        tcp.contains("127.0.0.1:9") && tcp.contains("hint: "),
        "{tcp}"
    );
    let Some(usb) = std::env::var_os("HAPTERRA_NO_BOARD").map(|_| run("usb")) else {
        eprintln!(
            "skipped: a board may be plugged in here; HAPTERRA_NO_BOARD=1 states that there is none"
        );
        return;
    };
    assert!(usb.contains("1209:0001") && usb.contains("hint: "), "{usb}");
}
