//! The same trajectory in this program and on the emulated Cortex-M4F: the bits must be identical.
//! No tolerance is needed: both compile the same single-precision arithmetic, which IEEE 754
//! defines to the last bit.

use std::process::Command;
use std::time::Duration;

use hapterra::link::{Emulator, Timeouts};
use hapterra::replay::{OfflineDevice, on_native};
use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::{Pattern, Shading, SurfaceParams, Texture};
use hapterra_core::scene::TickRecord;
use hapterra_tests::emulation::emulated_board;
use hapterra_tests::hapterra_binary;
use hapterra_tests::random_paths::wander;
use hapterra_tests::timeouts::pass;
use heightfield::Raster;

/// The compared part of a result: all but work and time, which depend on the arrival of tiles.
type Answer = (
    [i32; 3],
    [u32; 3],
    [i32; 3],
    [u32; 3],
    [u32; 3],
    ContactState,
);

fn rendered(sample: &TickRecord) -> Answer {
    let bits = |v: hapterra_core::Vec3| v.to_array().map(f32::to_bits);
    (
        sample.hip.cell(),
        bits(sample.hip.frac()),
        sample.proxy.cell(),
        bits(sample.proxy.frac()),
        bits(sample.force_n),
        sample.state,
    )
}

fn walk(replayer: &mut OfflineDevice<'_>, path: &[[f64; 3]]) -> Vec<Answer> {
    let scale = *replayer.terrain().scale();
    let mut step = |mm: &[f64; 3]| {
        let hip = scale.to_grid(*mm).expect("addressable");
        rendered(&replayer.step(hip).expect("rendered"))
    };
    path.iter().map(&mut step).collect()
}

fn holed() -> Raster {
    Raster::from_fn(130, 90, |x, y| {
        let hole = (x / 11 + y / 9) % 5 == 0;
        let height = (x as f32 * 0.31).sin() * 4.0 + (y as f32 * 0.17).cos() * 6.0;
        if hole { f32::NAN } else { height }
    })
    .expect("raster")
}

#[test]
fn replay_is_bit_identical_on_the_emulated_board() {
    let Some((qemu, image)) = emulated_board() else {
        return;
    };
    let made = |kind| Synth::new(kind, 3, 25.0).raster(150, 140).expect("raster");
    let plain = SurfaceParams::PREMIUM;
    let with = |pattern| SurfaceParams {
        shading: Shading::Smooth,
        texture: Texture {
            pattern,
            amplitude_mm: 0.2,
            wavelength_mm: 1.7,
            direction_deg: 33.0,
            seed: 9,
        },
        ..plain
    };
    for (name, raster, params) in [
        ("fractal", made(Kind::Fractal), plain),
        ("steps", made(Kind::Steps), with(Pattern::Grating)),
        ("holes", holed(), with(Pattern::Grain)),
    ] {
        let scale = Scale::new(0.8, 0.9).expect("scale");
        let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
        let path = wander(&terrain, 17, 300, -2.0);
        let mut native = on_native(&terrain, params).expect("opened");
        let expected = walk(&mut native, &path);
        let (emulator, lines) = Emulator::start(&qemu, &image).expect("started");
        let _plant = lines.plant;
        let link = Box::new(lines.link);
        let mut board =
            OfflineDevice::open(&terrain, params, link, Timeouts::EMULATED).expect("opened");
        assert_eq!(board.device().board.as_str(), "mps2-an386");
        let got = walk(&mut board, &path);
        for (i, (expected, got)) in expected.iter().zip(&got).enumerate() {
            assert_eq!(expected, got, "{name}: row {i} at {:?}", path[i]);
        }
        let touched = got
            .iter()
            .filter(|rendered| rendered.5 == ContactState::Touching)
            .count();
        assert!(touched > 50, "{name}: the walk hardly touches");
        board.close().expect("reported");
        emulator.finish().expect("the board ended well");
    }
}

/// The same for the closed loop of encoders, currents and the arm between them.
#[test]
fn emulated_demo_equals_native_and_is_never_late() {
    let Some((qemu, image)) = emulated_board() else {
        return;
    };
    let device = format!("emulated:{}", image.display());
    let folder = tempfile::tempdir().expect("a folder");
    let demo = |out: &str, more: &[&std::ffi::OsStr]| {
        let out = folder.path().join(out);
        let run = Command::new(hapterra_binary())
            .env("HAPTERRA_QEMU", &qemu)
            .args(["demo", "--duration", "5.5s", "--out"])
            .arg(&out)
            .args(more)
            .output()
            .expect("started");
        let output = String::from_utf8_lossy(&run.stdout).into_owned();
        let errors = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{output}{errors}");
        assert!(out.join("fractal.png").exists());
        (
            std::fs::read(out.join("fractal.csv")).expect("there"),
            output,
        )
    };
    let (native, _) = demo("native", &["--device".as_ref(), "native".as_ref()]);
    let (emulated, output) = demo("emulated", &["--device".as_ref(), device.as_ref()]);
    assert!(output.contains(", 0 late"), "{output}");
    assert!(output.contains("0 lost on the link, 0 dropped"), "{output}");
    let lines = |csv: &[u8]| csv.iter().filter(|b| **b == b'\n').count();
    assert!(lines(&native) > 5400, "{} lines", lines(&native));
    // All but the device, which the recording names.
    let reported = String::from_utf8_lossy(&emulated).into_owned();
    assert!(
        reported.contains("# board = \"mps2-an386\""),
        "it names its board"
    );
    let as_native = reported.replacen("\"mps2-an386\"", "\"native\"", 1);
    assert!(native == as_native.as_bytes(), "the recordings differ");
}

/// Ctrl-C reaches every process of a terminal, including the emulator: this is a normal end, and
/// the samples until then are kept.
#[cfg(unix)]
#[test]
fn interrupted_emulated_demo_ends_in_order() {
    use std::io::BufRead;
    use std::os::unix::process::CommandExt;

    let Some((qemu, image)) = emulated_board() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut demo = Command::new(hapterra_binary())
        .args(["demo", "--rounds", "50", "--out"])
        .arg(folder.path())
        .arg(format!("--device=emulated:{}", image.display()))
        .env("HAPTERRA_QEMU", &qemu)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .process_group(0)
        .spawn()
        .expect("started");
    let mut lines = std::io::BufReader::new(demo.stdout.take().expect("piped")).lines();
    let device = lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("device")));
    assert!(device.is_some(), "no device is named");
    pass(Duration::from_secs(1));
    let group = format!("-{}", demo.id());
    let signal = Command::new("kill").args(["-INT", "--", &group]).status();
    assert!(signal.expect("kill runs").success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    let ended = demo.wait_with_output().expect("it ends");
    let reported = rest.join("\n") + &String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{reported}");
    for word in ["report", "panicked", "signal", "error: "] {
        assert!(!reported.contains(word), "{word} in {reported}");
    }
    assert!(
        reported.contains("fractal.csv") && reported.contains("fractal.png"),
        "{reported}"
    );
    assert!(folder.path().join("fractal.csv").is_file());
}
