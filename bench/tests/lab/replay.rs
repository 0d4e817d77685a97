//! `hapterra-lab replay` as a command.

use std::path::Path;
use std::process::Command;

use hapterra::synth::Kind;
use hapterra_tests::terrain_file;

fn replay(folder: &Path, trajectory: &str, out: &str, words: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hapterra-lab"));
    command.current_dir(folder);
    command.args(["replay", "hills.tif", trajectory, "-o", out]);
    let output = command.args(words).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    std::fs::read_to_string(folder.join(out)).expect("written")
}

fn rows(recording: &str) -> Vec<&str> {
    let lines = recording.lines();
    lines.filter(|line| !line.starts_with('#')).collect()
}

#[test]
fn paper_rule_is_printed_recorded_and_replayed() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    terrain_file(&folder.join("hills.tif"), Kind::Fractal, 64, 1);
    let mut path = "t_s,x_mm,y_mm,z_mm\n".to_owned();
    for tick in 0..400 {
        let at = f64::from(tick);
        path += &format!(
            "{},{},{},{}\n",
            1e-3 * at,
            20.0 + 0.05 * at,
            20.0 + 0.03 * at,
            60.0 - 0.3 * at
        );
    }
    std::fs::write(folder.join("in.csv"), path).expect("written");
    let swept = replay(folder, "in.csv", "swept.csv", &[]);
    let paper = replay(folder, "in.csv", "paper.csv", &["--contact", "paper"]);
    assert_ne!(rows(&swept), rows(&paper));
    assert!(paper.contains("paper") && !swept.contains("paper"));
    // A recording has its own rule, and a stated one has priority.
    let repeated = replay(folder, "paper.csv", "again.csv", &[]);
    assert_eq!(rows(&repeated), rows(&paper));
    let other = replay(folder, "paper.csv", "other.csv", &["--contact", "swept"]);
    assert_eq!(rows(&other), rows(&swept));
}
