//! `hapterra-lab stability` as a command.

use std::process::{Command, Output};

fn stability(words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hapterra-lab"));
    let output = command.arg("stability").args(words).output();
    output.expect("it runs")
}

fn output_text(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}

#[test]
fn stability_prints_limits_and_writes_trials_and_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let [csv, png] = ["trials.csv", "limits.png"].map(|name| folder.path().join(name));
    let [to_csv, to_png] = [&csv, &png].map(|path| path.to_str().expect("text"));
    let words = ["--rate", "2000,1000", "--stiffness", "0.5", "-o", to_csv];
    let output = stability(&[&words[..], &["-o", to_png]].concat());
    assert!(output.status.success(), "{}", output_text(&output));
    for part in [
        "  1000 Hz, no damping:                0.1 of the arm's friction: light 0.5 / 0.5 / none",
        "  1000 Hz, no damping:                1 of the arm's friction: light 0.5 / 0.5 / none",
        "  1000 Hz, controller:                0.1 of the arm's friction: light 0.5 / 0.5 / 0.5",
        "  1000 Hz, controller:                1 of the arm's friction: light 0.5 / 0.5 / 0.5",
        "  2000 Hz, no damping:",
        "Colgate",
    ] {
        assert!(
            output_text(&output).contains(part),
            "{}",
            output_text(&output)
        );
    }
    let rows = std::fs::read_to_string(csv).expect("a table");
    assert_eq!(rows.lines().count(), 1 + 2 * 2 * 2 * 3, "{rows}");
    assert!(
        rows.lines()
            .nth(1)
            .is_some_and(|row| row.starts_with("1000,0.0,false,light,0.5,200,0.1,none,0,0,still,"))
    );
    let picture = std::fs::read(png).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 10_000);
}

#[test]
fn invalid_options_and_unwritable_outputs_are_refused() {
    let twice = stability(&["-o", "a.csv", "-o", "b.csv"]);
    assert!(
        output_text(&twice).contains("two files with the same ending"),
        "{}",
        output_text(&twice)
    );
    for (words, code, part) in [
        (["--rate", "1500"], 2, "whole kilohertz"),
        (["--stiffness", "0"], 2, "N/mm"),
        (["--stiffness", "nan"], 2, "N/mm"),
        (["--delay", "20ms"], 2, "from 0 to 0.01 s"),
        (["--delay-us", "200"], 2, "is now --delay 200us"),
        (["--picture", "a.png"], 2, "is now -o FILE.png"),
        (["-o", "both"], 2, ".csv (all figures) or .png (a picture)"),
        (["--damping", "21"], 2, "0 to 20 N·s/m"),
        (["--damping", "nan"], 2, "a damping"),
        (["--passivity", "auto"], 2, "off, on"),
        (
            ["-o", "/nowhere/at/all.csv"],
            1,
            "cannot write /nowhere/at/all.csv",
        ),
        (["-o", "/nowhere/at/all.png"], 1, "/nowhere/at/all.png"),
    ] {
        let output = stability(&words);
        assert_eq!(output.status.code(), Some(code), "{}", output_text(&output));
        assert!(
            output_text(&output).contains(part),
            "{}",
            output_text(&output)
        );
    }
}
