//! Tests of messages about several devices.

use clap::Parser;

use super::*;
use crate::cli::{Cli, Command};

fn args(more: &str) -> Args {
    let line = format!("hapterra run hills.tif {more}");
    match Cli::parse_from(line.split_whitespace()).command {
        Command::Run(args) => args,
        other => panic!("{other:?}"),
    }
}

fn devices(more: &str) -> Vec<OneDevice> {
    match of(&args(more)) {
        Ok(devices) => devices,
        Err(failure) => panic!("{more}: {}", failure.text()),
    }
}

fn refused(more: &str) -> String {
    match of(&args(more)) {
        Ok(_) => panic!("{more} was taken"),
        Err(failure) => failure.text(),
    }
}

#[test]
fn single_device_keeps_the_file_name_and_has_no_console_name() {
    for more in ["", "--device native", "--device usb"] {
        let [only] = &devices(&format!("{more} --out felt.csv"))[..] else {
            panic!("{more}");
        };
        assert_eq!(only.record.as_deref(), Some(Path::new("felt.csv")));
        assert_eq!(only.device_console.name(), None);
    }
}

#[test]
fn several_devices_have_numbered_names_and_recordings() {
    let devices = devices(
        "--device native --device usb:7 --device native --device tcp:h:1 --out out/felt.x.csv",
    );
    let names: Vec<_> = devices
        .iter()
        .map(|device| device.device_console.name())
        .collect();
    let expected = ["[1 native]", "[2 usb:7]", "[3 native]", "[4 tcp:h:1]"];
    assert_eq!(names, expected.map(Some));
    for (device, number) in devices.iter().zip(1..) {
        let file = PathBuf::from(format!("out/felt.x-{number}.csv"));
        assert_eq!(device.record, Some(file));
    }
    assert_eq!(of_device(Path::new("felt"), 2), Path::new("felt-2"));
    // Paths that cannot be written are unchanged, so that messages name them.
    assert_eq!(of_device(Path::new("-"), 2), Path::new("-"));
    assert_eq!(of_device(Path::new(".."), 2), Path::new(".."));
}

#[test]
fn device_named_twice_is_refused_also_by_alias() {
    for (more, expected) in [
        ("--device usb:7 --device usb:7", "are both usb:7"),
        ("--device usb --device usb:7", "usb:SERIAL"),
        ("--device usb --device usb", "usb:SERIAL"),
        (
            "--device tcp:h:1 --device native --device tcp:h:1",
            "devices 1 and 3 are both tcp:h:1",
        ),
        (
            "--device tcp:localhost:4000 --device tcp:127.0.0.1:4000",
            "are the same",
        ),
    ] {
        let reported = refused(more);
        assert!(
            reported.contains(expected) && reported.contains("hint: "),
            "{reported}"
        );
    }
    for more in [
        "--device native --device native",
        "--device usb --device native",
        "--device usb:7 --device usb:8",
        "--device tcp:localhost:4000 --device tcp:localhost:4001",
    ] {
        assert_eq!(devices(more).len(), 2, "{more}");
    }
}

#[test]
fn plant_line_is_part_of_an_emulated_boards_name() {
    let plants = |more: &str| -> Vec<_> {
        let devices = devices(more);
        devices.into_iter().map(|device| device.plant).collect()
    };
    assert_eq!(plants("--device tcp:h:1"), [None]);
    let (one, other) = ("--device tcp:h:1+plant:h:3", "--device tcp:h:2");
    let both = plants(&format!("{one} --device native {other}+plant:h:4"));
    assert_eq!(both, [Some("h:3".into()), None, Some("h:4".into())]);
    for (more, expected) in [
        (format!("{one} {other}"), "1 of 2 devices"),
        (format!("{one} {other}+plant:h:3"), "two devices have"),
    ] {
        let reported = refused(&more);
        assert!(
            reported.contains(expected) && reported.contains("hint: "),
            "{reported}"
        );
    }
    for bad in ["native+plant:h:3", "tcp:h:1+plant:h", "tcp:h:1+plant:"] {
        assert!(bad.parse::<ServedDevice>().is_err(), "{bad}");
    }
}

#[test]
fn view_of_several_devices_and_a_tenth_device_are_refused() {
    let reported = refused("--device native --device native --view");
    assert!(reported.contains("hint: leave --view out"), "{reported}");
    let ten = " --device native".repeat(10);
    let reported = refused(&ten);
    assert!(reported.contains("10 devices; at most 9"), "{reported}");
    assert_eq!(devices(&" --device native".repeat(9)).len(), 9);
}
