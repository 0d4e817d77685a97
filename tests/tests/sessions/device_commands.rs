//! The device commands for a new user: without a device, and with wrong arguments.

use std::process::{Command, Output, Stdio};

use hapterra_tests::hapterra_binary;

fn hapterra(arguments: &[&str]) -> Output {
    Command::new(hapterra_binary())
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("it runs")
}

fn output_text(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}

/// Runs a command that must fail with `code` and print each of these.
fn fails(arguments: &[&str], code: i32, expected: &[&str]) {
    let output = hapterra(arguments);
    let text = output_text(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    for part in expected {
        assert!(text.contains(part), "{arguments:?}: no {part:?} in\n{text}");
    }
}

#[test]
fn list_names_boards_probes_and_addresses_searched() {
    // Port 1 is unused.
    let output = hapterra(&["list", "--tcp", "127.0.0.1:1"]);
    let text = output_text(&output);
    assert!(output.status.success(), "{text}");
    for part in [
        "nucleo-g474re",
        "STM32H743ZITx",
        "boards on USB",
        "debug probes",
        "none at tcp:127.0.0.1:1",
    ] {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
}

#[test]
fn moved_subcommand_is_named_with_its_new_program() {
    for (word, new) in [
        ("bench", "contact"),
        ("stability", "stability"),
        ("synth", "synth"),
    ] {
        fails(
            &[word, "--help"],
            2,
            &[&format!("hint: hapterra {word} is now hapterra-lab {new}")],
        );
    }
}

/// `run` does not emulate a board for a terrain, and prints what it does instead.
#[test]
fn run_prints_the_rendering_of_an_emulated_board() {
    fails(
        &["run", "hills.tif", "--device", "emulated"],
        2,
        &[
            "hapterra demo --device emulated",
            "tcp:HOST:PORT",
            "+plant:HOST:PORT",
        ],
    );
}

#[test]
fn status_of_the_native_device_lists_its_blockers() {
    let output = hapterra(&["status", "--device", "native"]);
    let text = output_text(&output);
    assert!(output.status.success(), "{text}");
    for part in [
        "native",
        "Disarmed",
        "NOT_ZEROED",
        "NO_SCENE",
        "HOST_DISARMED",
        "fault          none",
        "protocol",
    ] {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
}

#[test]
fn calibration_record_round_trips_through_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("arm.toml");
    let file = file.to_str().expect("a plain path");
    let base = ["calibrate", "--device", "native", "--measure", "none"];
    let write = [&base[..], &["--set", "ratio-2=10.5", "--out", file]].concat();
    let output = hapterra(&write);
    assert!(output.status.success(), "{}", output_text(&output));
    let again = folder.path().join("again.toml");
    let again = again.to_str().expect("a plain path");
    let read = [&base[..], &["--from", file, "--out", again]].concat();
    let output = hapterra(&read);
    assert!(output.status.success(), "{}", output_text(&output));
    let bytes = |path: &str| std::fs::read(path).expect("written");
    assert_eq!(bytes(file), bytes(again));
    let whole = bytes(file);
    std::fs::write(file, &whole[..whole.len() / 2]).expect("written");
    let read = [&base[..], &["--from", file]].concat();
    fails(&read, 1, &["no calibration file", "arm.toml", "hint:"]);
}

/// A Premium 1.0's ratios have no source: a record without measured ratios needs explicit consent.
///
/// Safety: images.
#[test]
fn guessed_ratios_need_measurement_or_explicit_consent() {
    let base = ["calibrate", "--device", "native", "--no-store", "--yes"];
    for model in ["premium-1.0", "premium-3.0", "omni"] {
        for skip in ["none", "zero,gravity"] {
            let arguments = [&base[..], &["--model", model, "--measure", skip]].concat();
            fails(&arguments, 1, &["a guess", "guessed-ratios"]);
        }
    }
    let agreed = ["--model", "premium-1.0", "--measure", "none,guessed-ratios"];
    let known = ["--model", "premium-1.5", "--measure", "none"];
    let measured = [
        "--model",
        "premium-1.0",
        "--measure",
        "none",
        "--set",
        "ratio-1=7.2",
    ];
    for arguments in [&agreed[..], &known[..], &measured[..]] {
        let output = hapterra(&[&base[..], arguments].concat());
        assert!(output.status.success(), "{}", output_text(&output));
    }
}

#[test]
fn record_above_absolute_limit_is_refused_before_sending() {
    let base = [
        "calibrate",
        "--device",
        "native",
        "--measure",
        "none",
        "--set",
    ];
    for (setting, part) in [
        ("peak-current-1=20A", "5.5 A"),
        ("max-force=20N", "8.5 N"),
        ("torque-constant-2=5mNm/A", "check the ratio"),
    ] {
        fails(&[&base[..], &[setting]].concat(), 1, &[part, "hint:"]);
    }
}

#[test]
fn wrong_arguments_have_an_error_with_a_remedy() {
    fails(
        &["status", "--device", "serial"],
        2,
        &["usb, usb:SERIAL, tcp:HOST:PORT, native, emulated or emulated:ELF"],
    );
    fails(
        &["status", "--device", "tcp:127.0.0.1:1"],
        1,
        &["127.0.0.1:1", "hint:"],
    );
    fails(
        &["status", "--device", "emulated:/no/such"],
        1,
        &["/no/such", "hint:"],
    );
    fails(&["flash", "--board", "uno"], 2, &["nucleo-g474re"]);
    fails(&["flash", "--board", "mps2-an386"], 2, &["emulated"]);
    fails(
        &["flash", "--board", "nucleo-g474re", "--image", "/no/such"],
        1,
        &["hint:"],
    );
    let calibrate = |set: &'static str| {
        [
            "calibrate",
            "--device",
            "native",
            "--measure",
            "none",
            "--set",
            set,
        ]
    };
    fails(&calibrate("l1=3mm"), 1, &["30 to 1000 mm", "hint:"]);
    fails(&calibrate("length=3"), 2, &["l1, l2"]);
    fails(&calibrate("l1=long"), 2, &["a number in mm"]);
    fails(&calibrate("l1-mm=3"), 2, &["l1=215mm"]);
    fails(
        &["calibrate", "--device", "native", "--from", "/no/such"],
        1,
        &["/no/such", "hint:"],
    );
}
