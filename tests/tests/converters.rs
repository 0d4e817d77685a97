//! The commands that hints name for files that are refused, run as they stand: what
//! they write opens. Where GDAL is not installed this says so and is skipped.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra::raster::{OpenOptions, Raster};
use hapterra_tests::hapterra_binary;

fn has_gdal() -> bool {
    let runs = Command::new("gdal_translate").arg("--version").output();
    let runs = runs.is_ok_and(|output| output.status.success());
    if !runs {
        eprintln!("skipped: no gdal_translate is installed");
    }
    runs
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data/by_gdal")
        .join(name)
}

fn shell(folder: &Path, command: &str) -> Output {
    let output = Command::new("sh")
        .args(["-c", command])
        .current_dir(folder)
        .output();
    output.expect("a shell")
}

/// Makes a file with GDAL's `options`.
fn made(folder: &Path, options: &str, name: &str) -> PathBuf {
    let path = folder.join(name);
    let from = data("lerc_i16.tif");
    let command = format!(
        "gdal_translate -q {options} '{}' '{}'",
        from.display(),
        path.display()
    );
    let output = shell(folder, &command);
    assert!(output.status.success(), "{command}: {output:?}");
    path
}

/// The hint that `hapterra info` gives for a file.
fn hint(file: &Path) -> String {
    let output = Command::new(hapterra_binary())
        .arg("info")
        .arg(file)
        .output();
    let output = output.expect("it runs");
    assert!(!output.status.success(), "{} opens", file.display());
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    let hint = told
        .split_once("hint: ")
        .unwrap_or_else(|| panic!("no hint in {told}"));
    hint.1.trim().to_owned()
}

/// Runs the command in a hint, from its program's name to the end or to a semicolon.
fn follow(folder: &Path, hint: &str, program: &str) {
    let from = hint
        .find(program)
        .unwrap_or_else(|| panic!("no {program} in: {hint}"));
    let command = hint[from..].split(';').next().unwrap_or_default();
    let output = shell(folder, command);
    assert!(output.status.success(), "{command}: {output:?}");
}

#[test]
fn what_gdal_reads_and_this_does_not_is_converted_by_the_hint() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (options, name) in [
        ("-ot Byte -co COMPRESS=JPEG", "jpeg.tif"),
        ("-ot UInt16 -co NBITS=12", "bits.tif"),
        ("-of HFA", "erdas.img"),
        ("-of VRT", "a virtual one.vrt"),
        ("-of SAGA", "saga.sdat"),
        ("-of RST -ot Float32", "idrisi.rst"),
    ] {
        let file = made(at, options, name);
        let hint = hint(&file);
        follow(at, &hint, "gdal_translate");
        let stem = Path::new(name)
            .file_stem()
            .expect("a name")
            .to_string_lossy();
        let converted = at.join(format!("{stem}-converted.tif"));
        let raster = Raster::open(&converted, &OpenOptions::default());
        let raster = raster.unwrap_or_else(|error| panic!("{name}: {hint}: {error}"));
        assert_eq!((raster.columns(), raster.rows()), (40, 30), "{name}");
        let off = raster.height(20, 10) - (100.0 + 7.0 * 20.0 - 3.0 * 19.0);
        assert!(name == "jpeg.tif" || off.abs() < 1e-9, "{name}: {off} off");
    }
}

/// The hint of a command that fails.
fn hint_of(words: &[&str], file: &Path) -> String {
    let output = Command::new(hapterra_binary())
        .args(words)
        .arg(file)
        .output()
        .expect("it runs");
    assert!(!output.status.success(), "{words:?}");
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    let hint = told.split_once("hint: ").expect("a hint");
    hint.1.trim().to_owned()
}

/// Runs `demo` at a longitude and latitude where none is known, and the command in its
/// hint; opens what that writes.
fn brought_to_degrees(folder: &Path, name: &str, program: &str, code: &str) -> Raster {
    let words = ["demo", "--device", "native", "--at-lonlat", "173,-41"];
    let hint = hint_of(&words, &folder.join(name));
    let hint = hint.replace("IN OUT.tif", &format!("{name} brought.tif"));
    follow(folder, &hint.replace("EPSG:CODE", code), program);
    let brought = folder.join("brought.tif");
    let raster = Raster::open(&brought, &OpenOptions::default()).expect("opens");
    std::fs::remove_file(brought).expect("removed");
    raster
}

#[test]
fn a_map_without_longitudes_gets_them_by_the_hint() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    // Without the hole of the field: what is one afterwards is the command's.
    let high = "-srcwin 10 8 30 20 -scale 0 1000 1000 2000 -a_nodata none";
    for (name, projection, ground, lonlat) in [
        (
            "grid.tif",
            "+proj=nzmg +lat_0=-41 +lon_0=173 +x_0=2510000 +y_0=6023150 +ellps=intl",
            "2600000 6030000 2640000 6000000",
            // Of the middle, by gdaltransform.
            [174.31, -41.07],
        ),
        (
            "grinten.tif",
            "+proj=vandg +lon_0=0 +R=6371000",
            "3000000 5030000 3040000 5000000",
            [28.93, 42.22],
        ),
    ] {
        made(
            at,
            &format!("{high} -a_srs '{projection}' -a_ullr {ground}"),
            name,
        );
        let raster = brought_to_degrees(at, name, "gdalwarp", "");
        let bounds = raster.bounds_lonlat().expect("known");
        let middle = [
            0.5 * (bounds.west + bounds.east),
            0.5 * (bounds.south + bounds.north),
        ];
        for (found, wanted) in middle.iter().zip(lonlat) {
            assert!((found - wanted).abs() < 0.02, "{name}: {bounds:?}");
        }
        // What lies beside the turned map is no ground.
        let summary = raster.summary();
        assert!(summary.lowest > 900.0, "{name}: {}", summary.lowest);
        assert!(summary.holes > 0, "{name}");
    }
    made(
        at,
        "-of AAIGrid -a_ullr 400000 3801200 401600 3800000",
        "own.asc",
    );
    std::fs::remove_file(at.join("own.prj")).expect("GDAL had written one");
    let raster = brought_to_degrees(at, "own.asc", "gdal_translate", "EPSG:32611");
    let bounds = raster.bounds_lonlat().expect("known");
    assert!((bounds.west + 118.087).abs() < 1e-3, "{bounds:?}");
}

/// GDAL knows nothing of NumPy's files; the hint is Python's.
#[test]
fn arrays_are_converted_by_numpy() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let make = "import numpy as n; a = n.arange(12.).reshape(1, 3, 4); n.save('deep.npy', a); \
                n.savez('deep.npz', a=a)";
    let output = shell(at, &format!("python3 -c \"{make}\""));
    if !output.status.success() {
        eprintln!("skipped: no numpy is installed");
        return;
    }
    for name in ["deep.npy", "deep.npz"] {
        let hint = hint(&at.join(name));
        let from = hint
            .find("python3")
            .unwrap_or_else(|| panic!("no python3 in: {hint}"));
        let output = shell(at, &hint[from..]);
        assert!(output.status.success(), "{hint}: {output:?}");
        let raster = Raster::open(at.join("heights.npy"), &OpenOptions::default());
        assert_eq!(raster.expect("opens").height(3, 0), 11.0, "{name}");
        std::fs::remove_file(at.join("heights.npy")).expect("removed");
    }
}

/// What GDAL does not read is not sent to GDAL.
#[test]
fn no_hint_names_a_converter_that_cannot_read_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in [
        "points.las",
        "array.npy",
        "arrays.npz",
        "packed.zip",
        "samples.r16",
    ] {
        let file = folder.path().join(name);
        for bytes in [
            &b"LASF and no grid"[..],
            b"PK\x05\x06",
            b"\x93NUMPY\x01\0\xff\xff{",
        ] {
            std::fs::write(&file, bytes).expect("written");
            let hint = hint(&file);
            assert!(
                !hint.contains("gdal_") && !hint.contains("gdalinfo"),
                "{name}: {hint}"
            );
        }
    }
}
