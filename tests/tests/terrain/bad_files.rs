//! Any file results in an error or a terrain: never a panic, never a hang, never more
//! memory than the file justifies.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use hapterra::synth::Kind;
use hapterra_tests::timeouts::end_of;
use hapterra_tests::{hapterra_binary, shared, terrain_file};
use heightfield::{OpenOptions, Raster, RasterError};

/// Address space of a child. The program itself needs about 100 MB of it.
const MEMORY_KIB: u64 = 1 << 20;

fn files_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    files
}

/// Runs `hapterra info FILE` in limited memory.
fn info(path: &Path) -> Output {
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        shell
            .arg("-c")
            .arg(format!("ulimit -v {MEMORY_KIB}; exec \"$0\" info \"$1\""))
            .arg(hapterra_binary());
        shell
    } else {
        let mut binary = Command::new(hapterra_binary());
        binary.arg("info");
        binary
    };
    let child = command
        .arg(path)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts");
    end_of(child)
}

/// Checks for an exit code of 0 with a report, or of 1 with the fault and a remedy.
fn assert_ends_well(path: &Path) -> bool {
    let output = info(path);
    let reported = String::from_utf8_lossy(&output.stderr);
    let context = format!("{}: {:?}\n{reported}", path.display(), output.status);
    assert!(!reported.contains("panicked"), "{context}");
    match output.status.code() {
        Some(0) => assert!(!output.stdout.is_empty(), "{context}"),
        Some(1) => {
            let is_reported = |line: &str| line.starts_with("error: ");
            // On a slow machine, lines about progress come first.
            assert!(reported.lines().any(is_reported), "{context}");
            assert!(reported.contains("hint: "), "{context}");
            let name = path.file_name().expect("a name").to_string_lossy();
            assert!(reported.contains(name.as_ref()), "which file? {context}");
        }
        _ => panic!("{context}"),
    }
    output.status.success()
}

#[test]
fn every_malformed_file_ends_in_an_error_or_a_terrain() {
    let Some(folder) = shared("terrain_bad") else {
        return;
    };
    let mut opened = Vec::new();
    for path in files_in(&folder) {
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        if assert_ends_well(&path) {
            opened.push(name);
        }
    }
    // Flipped bytes may leave a terrain; truncated, wrong and hostile files must not.
    for name in opened {
        let may_open = name.starts_with("flip") || name.starts_with("made_ok");
        assert!(may_open, "{name} opened as if nothing were wrong with it");
    }
}

#[test]
fn non_terrain_file_is_refused_with_its_specific_fault() {
    let folder = std::env::temp_dir().join(format!("hapterra-bad-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for tries");
    let tries: [(&str, &[u8], &str); 9] = [
        ("empty.tif", b"", "empty"),
        ("notes.txt", b"ncols of cabbage", "unknown file format"),
        ("song.mp3", b"ID3\x03 no terrain", "unknown file format"),
        ("named.tif", b"hello, world", "its name is that of TIFF"),
        ("samples.raw", &[0; 32], "without a stated size"),
        ("odd.hgt", &[0; 31], "no square"),
        ("cut.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", "truncated"),
        (
            "nothing.zip",
            b"PK\x05\x06\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
            "no archive",
        ),
        ("cut.hgt.gz", b"\x1f\x8b\x08\0\0\0\0\0\0\x03", "truncated"),
    ];
    for (name, bytes, expected) in tries {
        let path = folder.join(name);
        std::fs::write(&path, bytes).expect("a file to try");
        assert!(!assert_ends_well(&path), "{name} opened");
        let error = Raster::open(&path, &OpenOptions::default()).expect_err(name);
        assert!(error.to_string().contains(expected), "{error}");
    }
    let missing = Raster::open(folder.join("missing.tif"), &OpenOptions::default());
    assert!(matches!(
        missing.expect_err("missing").fault(),
        RasterError::Unreadable(_)
    ));
    // In a folder the first file by name must be the terrain.
    let itself = Raster::open(&folder, &OpenOptions::default());
    let itself = itself.expect_err("a folder");
    match itself.fault() {
        RasterError::InTile { file, fault } => {
            assert!(file.ends_with("cut.hgt.gz"), "{itself}");
            assert!(fault.to_string().contains("truncated"), "{itself}");
        }
        _ => panic!("{itself}"),
    }
    assert!(!assert_ends_well(&folder));
    std::fs::remove_dir_all(&folder).expect("the tries are removed");
}

/// The program's errors name the fault, the file and the next step.
#[test]
fn error_names_fault_file_and_next_step() {
    let output = Command::new(hapterra_binary())
        .args(["info", "no-such-terrain.tif"])
        .output()
        .expect("the binary runs");
    assert_eq!(output.status.code(), Some(1));
    let reported = String::from_utf8_lossy(&output.stderr);
    assert!(
        reported.contains("error: cannot read the file: "),
        "{reported}"
    );
    assert!(
        reported.contains("(no-such-terrain.tif)\nhint: "),
        "{reported}"
    );

    let usage = Command::new(hapterra_binary())
        .arg("info")
        .output()
        .expect("the binary runs");
    assert_eq!(usage.status.code(), Some(2));
}

/// A seeded generator (xorshift), so that every run damages files in the same way.
struct Random(u64);

impl Random {
    fn roll(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % below.max(1) as u64) as usize
    }
}

/// Damages a file in one of three ways, half of the time in the header, where it matters most.
fn damage(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    match random.roll(4) {
        0 => damaged.truncate(random.roll(bytes.len())),
        kind => {
            let reach = [bytes.len(), 512.min(bytes.len())][random.roll(2)];
            for _ in 0..=random.roll(8) {
                let place = random.roll(reach);
                let bit = 1 << random.roll(8);
                damaged[place] = if kind == 1 {
                    damaged[place] ^ bit
                } else {
                    random.roll(256) as u8
                };
            }
        }
    }
    damaged
}

/// Thousands of damaged copies of every kind of file, in this process: each results in an error or
/// a terrain, and the error is rarely "the decoder failed".
#[test]
fn damaged_copies_of_good_files_never_panic() {
    let Some(folder) = shared("dem") else {
        return;
    };
    const MAX: u64 = 300_000;
    const COPIES: usize = 60;
    let tries = std::env::temp_dir().join(format!("hapterra-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&tries).expect("a folder for tries");
    let mut random = Random(0x5eed_7e44_a1d0_0001);
    let (mut copies, mut opened, mut panicked) = (0, 0, 0);
    for sub in ["variants", "tiff_ok", "real"] {
        for path in files_in(&folder.join(sub)) {
            let small = path.metadata().expect("its length").len() <= MAX;
            let raw = path.extension().is_some_and(|e| e == "raw" || e == "csv");
            if !small || raw {
                continue;
            }
            let bytes = std::fs::read(&path).expect("readable");
            let copy = tries.join(path.file_name().expect("a name"));
            for _ in 0..COPIES {
                std::fs::write(&copy, damage(&bytes, &mut random)).expect("a copy to try");
                copies += 1;
                match Raster::open(&copy, &OpenOptions::default()) {
                    Ok(_) => opened += 1,
                    Err(error) => {
                        panicked +=
                            usize::from(matches!(error.fault(), RasterError::DecoderFailed(_)));
                    }
                }
            }
        }
    }
    std::fs::remove_dir_all(&tries).expect("the tries are removed");
    println!("{copies} damaged copies: {opened} opened, {panicked} decoders failed");
    assert!(copies > 1000, "only {copies} copies were tried");
    assert!(
        panicked * 50 < copies,
        "{panicked} of {copies} decoders failed"
    );
}

/// Opening a pipe waits for a writer, so it must be refused by its type before.
///
/// Safety: 29.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_unopened() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = |name: &str| {
        let path = folder.path().join(name);
        let made = Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo runs").success());
        path
    };
    let reported = |path: &Path| String::from_utf8_lossy(&info(path).stderr).into_owned();
    for (path, kind) in [
        (pipe("pipe.tif"), "it is a pipe (FIFO)"),
        ("/dev/zero".into(), "it is a character device"),
    ] {
        assert!(!assert_ends_well(&path));
        assert!(reported(&path).contains(kind), "{}", reported(&path));
    }
    // All other input files of commands are refused as well.
    let hills = folder.path().join("hills.tif");
    terrain_file(&hills, Kind::Fractal, 16, 1);
    let [hills, other] = [hills, pipe("pipe.toml")].map(|path| path.display().to_string());
    let run = ["run", &hills, "--device", "native", "--materials", &hills];
    for (arguments, option) in [
        (&["calibrate", "--show"][..], None),
        (&run, Some("--surface")),
        (
            &["flash", "--board", "nucleo-g474re", "--check"],
            Some("--image"),
        ),
        (&["view"], None),
    ] {
        let child = Command::new(hapterra_binary())
            .args(arguments)
            .args(option)
            .arg(&other)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let output = end_of(child.expect("the binary starts"));
        let reported = String::from_utf8_lossy(&output.stderr);
        assert!(
            reported.contains("a pipe (FIFO)"),
            "{arguments:?}: {reported}"
        );
    }
}

/// Texts in a file, the file's own name, and the user's input must not control a terminal.
#[cfg(unix)]
#[test]
fn texts_of_files_reach_the_terminal_without_control_characters() {
    const WICKED: &str = "x\u{1b}]0;owned\u{7}\u{9b}31m\u{202e}\u{7f}";
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let grid = "ncols 3\nnrows 2\nxllcorner 5e5\nyllcorner 5e6\ncellsize 10\n1 2 3\n4 5 6\n";
    std::fs::write(at("hills.asc"), grid).expect("written");
    let wkt = format!(
        "PROJCS[\"{WICKED}\",GEOGCS[\"{WICKED}\",DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,298.257223563]],\
         PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],\
         PARAMETER[\"False_Easting\",500000],PARAMETER[\"False_Northing\",0],PARAMETER[\"Central_Meridian\",9],\
         PARAMETER[\"Scale_Factor\",0.9996],PARAMETER[\"Latitude_Of_Origin\",0],UNIT[\"Meter\",1]]"
    );
    std::fs::write(at("hills.prj"), wkt).expect("written");
    let named = at(&format!("{WICKED}.asc"));
    std::fs::write(&named, grid).expect("written");
    std::fs::write(at("table.toml"), format!("[class.1]\n\"{WICKED}\" = 1\n")).expect("written");
    std::fs::write(at("path.csv"), format!("t_s,{WICKED}\n")).expect("written");
    let paths = ["hills.asc", "table.toml", "path.csv"].map(|name| at(name).display().to_string());
    let [hills, table, csv] = paths;
    let named = named.display().to_string();
    for arguments in [
        &["info", &hills][..],
        &["info", "--json", &hills],
        &["info", &named],
        &["info", "--json", &named],
        &["info", &format!("{named}.none")],
        &[
            "run",
            &hills,
            "--device",
            "native",
            "--duration",
            "0.1s",
            "--materials",
            &hills,
            "--surface",
            &table,
        ],
        &["replay", &hills, &csv, "-o", &format!("{named}.csv")],
        &["replay", &hills, &format!("{csv}{WICKED}"), "-o", "-"],
        &["calibrate", "--show", &csv],
        &["info", &hills, "--input", &format!("no-data={WICKED}")],
    ] {
        let output = Command::new(hapterra_binary()).args(arguments).output();
        let output = output.expect("it runs");
        let reported = [output.stdout, output.stderr].concat();
        let reported = String::from_utf8(reported).expect("text");
        let controls = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(!reported.contains(controls), "{arguments:?}: {reported:?}");
        assert!(!reported.is_empty(), "{arguments:?}");
    }
}
