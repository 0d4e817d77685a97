//! The commands in hints for refused files, run unchanged: their output opens. If a command's
//! program or Python package is not installed, the test prints this and is skipped.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra_tests::hapterra_binary;
use heightfield::{OpenOptions, Raster};

fn has_gdal() -> bool {
    let runs = Command::new("gdal_translate").arg("--version").output();
    let runs = runs.is_ok_and(|output| output.status.success());
    if !runs {
        eprintln!("skipped: no gdal_translate is installed");
    }
    runs
}

/// Returns true if Python has these packages.
fn has_python(packages: &str) -> bool {
    let output = shell(Path::new("."), &format!("python3 -c 'import {packages}'"));
    if !output.status.success() {
        eprintln!("skipped: Python has no {packages}");
    }
    output.status.success()
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

/// Creates a file with GDAL's `options`.
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

/// Returns the hint of `hapterra info` for a file.
fn hint(file: &Path) -> String {
    hint_of(&["info"], file)
}

/// Returns the hint of a command that refuses a file, run without a libgdal.
fn hint_of(arguments: &[&str], file: &Path) -> String {
    let output = Command::new(hapterra_binary())
        .args(arguments)
        .arg(file)
        .env("GDAL_LIBRARY", "none")
        .output();
    let output = output.expect("it runs");
    let opens = output.status.success();
    assert!(!opens, "{arguments:?} opens {}", file.display());
    let reported = String::from_utf8_lossy(&output.stderr).into_owned();
    let hint = reported
        .split_once("hint: ")
        .unwrap_or_else(|| panic!("no hint in {reported}"));
    hint.1.trim().to_owned()
}

/// Returns the command in a hint, from its program's name to the end or the next alternative.
fn command<'h>(hint: &'h str, program: &str) -> &'h str {
    let from = hint
        .find(program)
        .unwrap_or_else(|| panic!("no {program} in: {hint}"));
    hint[from..].split("; or ").next().unwrap_or_default()
}

/// Runs the command in a hint. Returns its output.
fn follow(folder: &Path, hint: &str, program: &str) -> String {
    let command = command(hint, program);
    let output = shell(folder, command);
    assert!(output.status.success(), "{command}: {output:?}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Opens the output of a command, and deletes it.
fn open_and_delete(path: &Path) -> Raster {
    let raster = Raster::open(path, &OpenOptions::default());
    let raster = raster.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    std::fs::remove_file(path).expect("removed");
    raster
}

/// Runs a Python script that creates files.
fn python(folder: &Path, script: &str) {
    let file = folder.join("make.py");
    std::fs::write(&file, script).expect("written");
    let output = shell(folder, "python3 make.py");
    assert!(output.status.success(), "{script}: {output:?}");
    std::fs::remove_file(file).expect("removed");
}

#[test]
fn hint_converts_formats_that_only_gdal_reads() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (options, name) in [
        ("-ot Byte -co COMPRESS=JPEG", "jpeg.tif"),
        ("-ot UInt16 -co NBITS=12", "bits.tif"),
        ("-of HFA", "erdas.img"),
        (
            "-of VRT -scale 0 1000 0 1000 -exponent 1",
            "a virtual one.vrt",
        ),
        ("-of SAGA", "saga.sdat"),
        ("-of RST -ot Float32", "idrisi.rst"),
    ] {
        let file = made(at, options, name);
        follow(at, &hint(&file), "gdal_translate");
        let stem = Path::new(name)
            .file_stem()
            .expect("a name")
            .to_string_lossy();
        let raster = open_and_delete(&at.join(format!("{stem}-converted.tif")));
        assert_eq!((raster.columns(), raster.rows()), (40, 30), "{name}");
        let off = raster.height(20, 10) - (100.0 + 7.0 * 20.0 - 3.0 * 19.0);
        assert!(name == "jpeg.tif" || off.abs() < 1e-9, "{name}: {off} off");
    }
}

/// Runs `demo` at a longitude and latitude for a file without them, and the command in its hint.
/// Opens the output.
fn brought_to_degrees(folder: &Path, name: &str, program: &str, code: &str) -> Raster {
    let arguments = [
        "demo", "--device", "native", "--at", "173,-41", "--crs", "lonlat",
    ];
    let hint = hint_of(&arguments, &folder.join(name));
    let hint = hint.replace("IN OUT.tif", &format!("{name} brought.tif"));
    follow(folder, &hint.replace("EPSG:CODE", code), program);
    open_and_delete(&folder.join("brought.tif"))
}

#[test]
fn hint_adds_longitudes_to_a_map_without_them() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    // Without the no-data of the field, so that any no-data afterwards is from the command.
    let high = "-srcwin 10 8 30 20 -scale 0 1000 1000 2000 -a_nodata none";
    for (name, projection, ground, lonlat) in [
        (
            "grid.tif",
            "+proj=nzmg +lat_0=-41 +lon_0=173 +x_0=2510000 +y_0=6023150 +ellps=intl",
            "2600000 6030000 2640000 6000000",
            // The middle, converted by gdaltransform.
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
        for (found, expected) in middle.iter().zip(lonlat) {
            assert!((found - expected).abs() < 0.02, "{name}: {bounds:?}");
        }
        // The area beside the turned map is no-data.
        let summary = raster.summary();
        assert!(summary.lowest > 900.0, "{name}: {}", summary.lowest);
        assert!(summary.no_data > 0, "{name}");
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

/// Pictures and numbers that are not heights: the command selects one band unchanged.
#[test]
fn hint_turns_pictures_and_complex_data_into_heights() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let palette = "-ot Byte -scale 0 1000 0 200 -a_nodata none -colorinterp_1 gray -of VRT";
    let grey = made(at, palette, "grey.vrt");
    let text = std::fs::read_to_string(&grey).expect("there");
    let table: String = (0..256)
        .map(|value| {
            format!(
                "<Entry c1=\"{value}\" c2=\"{}\" c3=\"7\" c4=\"255\"/>",
                255 - value
            )
        })
        .collect();
    let interpreted = "<ColorInterp>Gray</ColorInterp>";
    assert!(text.contains(interpreted), "{text}");
    let coloured = format!("<ColorInterp>Palette</ColorInterp><ColorTable>{table}</ColorTable>");
    std::fs::write(at.join("palette.vrt"), text.replace(interpreted, &coloured)).expect("written");
    for (options, name) in [
        ("-of PNG", "palette.png"),
        ("", "palette.tif"),
        (
            "-co NBITS=1 -co PHOTOMETRIC=MINISBLACK -colorinterp_1 gray",
            "bit.tif",
        ),
        ("-ot CFloat32", "complex.tif"),
        ("-ot CInt16", "integers.tif"),
        ("-of EHdr -co NBITS=4 -a_nodata none", "four.bil"),
        ("-of PNG -co NBITS=4 -a_nodata none", "four.png"),
        (
            "-b 1 -b 1 -b 1 -b 1 -co PHOTOMETRIC=CMYK -colorinterp gray,undefined",
            "cmyk.tif",
        ),
    ] {
        let from = if name.starts_with("palette") {
            "palette.vrt"
        } else {
            "grey.vrt"
        };
        let make = format!("gdal_translate -q {options} {from} {name}");
        let output = shell(at, &make);
        assert!(output.status.success(), "{make}: {output:?}");
        follow(at, &hint(&at.join(name)), "gdal_translate");
        let stem = name.split('.').next().expect("a name");
        let raster = open_and_delete(&at.join(format!("{stem}-converted.tif")));
        assert_eq!((raster.columns(), raster.rows()), (40, 30), "{name}");
        assert!(raster.bounds().is_some() || name.ends_with("png"), "{name}");
    }
}

/// A name may contain any character with a meaning in a shell.
#[test]
fn shell_metacharacters_in_names_are_quoted() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["two words.img", "a $HOME's `id`.img", "a \"quoted\".img"] {
        let file = made(folder.path(), "-of HFA", "plain.img");
        let named = folder.path().join(name);
        std::fs::rename(file, &named).expect("renamed");
        follow(folder.path(), &hint(&named), "gdal_translate");
        let stem = name.strip_suffix(".img").expect("the ending");
        let raster = open_and_delete(&folder.path().join(format!("{stem}-converted.tif")));
        assert_eq!(raster.columns(), 40, "{name}");
    }
}

/// `hapterra info` for two copies of a file, one truncated: the command distinguishes them.
#[test]
fn hinted_checksum_distinguishes_damaged_file_from_intact() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let whole = made(at, "-co COMPRESS=DEFLATE", "whole.tif");
    let bytes = std::fs::read(&whole).expect("there");
    let cut = at.join("cut.tif");
    let damaged: Vec<u8> = (bytes.iter().enumerate())
        .map(|(at, byte)| {
            if (500..620).contains(&at) {
                0xa5
            } else {
                *byte
            }
        })
        .collect();
    std::fs::write(&cut, damaged).expect("written");
    let hint = hint(&cut);
    let sum = |reported: &str| {
        let line = reported.lines().find(|line| line.contains("Checksum="));
        line.map(str::trim).map(str::to_owned)
    };
    let of_cut = sum(&follow(at, &hint, "gdalinfo"));
    let there = hint.replace("cut.tif", "whole.tif");
    let of_whole = sum(&follow(at, &there, "gdalinfo"));
    assert!(
        of_whole.is_some() && of_whole != of_cut,
        "{of_whole:?} {of_cut:?}"
    );
}

/// Both commands for an empty file that is larger than memory, with strips too large to be read one
/// by one.
#[test]
fn hints_crop_or_coarsen_a_raster_larger_than_memory() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let large = "gdal_create -q -ot Float64 -outsize 2000 1100000 -bands 1 -a_srs EPSG:32611 \
                 -a_ullr 400000 3800000 402000 2700000 -co COMPRESS=LZW -co BLOCKYSIZE=4000 \
                 -co SPARSE_OK=TRUE large.tif";
    let output = shell(at, large);
    assert!(output.status.success(), "{large}: {output:?}");
    let hint = hint(&at.join("large.tif"));
    for (program, size) in [
        ("gdal_translate -srcwin", (2_000, 20_000)),
        ("gdal_translate -r average", (200, 110_000)),
    ] {
        follow(at, &hint, program);
        let raster = open_and_delete(&at.join("large-converted.tif"));
        assert_eq!((raster.columns(), raster.rows()), size, "{program}");
    }
}

/// GDAL does not read NumPy's files, so the hint uses Python.
#[test]
fn arrays_are_converted_by_numpy() {
    if !has_python("numpy") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    python(
        at,
        "import numpy as n; a = n.arange(12.).reshape(1, 3, 4); n.save('deep.npy', a); \
         n.savez('deep.npz', a=a); n.save('layers.npy', n.stack([a[0], 2 * a[0]])); \
         n.save('complex.npy', a[0] + 3j); n.save('bits.npy', a[0] > 5); \
         n.save('text.npy', a[0].astype(str)); n.save('line.npy', a[0, 0]); \
         n.save('fields.npy', n.zeros((3, 4), dtype=[('a', 'f4'), ('b', 'f4')]))",
    );
    for (name, highest) in [
        ("deep.npy", 11.0),
        ("deep.npz", 11.0),
        ("layers.npy", 11.0),
        ("complex.npy", 11.0),
        ("bits.npy", 1.0),
    ] {
        follow(at, &hint(&at.join(name)), "python3");
        assert_eq!(
            open_and_delete(&at.join("heights.npy")).height(3, 0),
            highest,
            "{name}"
        );
    }
    // No command converts these to heights.
    for name in ["text.npy", "line.npy", "fields.npy"] {
        assert_eq!(hint(&at.join(name)), "choose a file with heights", "{name}");
    }
}

#[test]
fn archives_are_unpacked_by_the_hint() {
    if !has_python("zipfile, lzma") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for name in ["one.tif", "two.tif"] {
        std::fs::copy(data("lerc_i16.tif"), at.join(name)).expect("copied");
    }
    python(
        at,
        "import zipfile as z\n\
         with z.ZipFile('two files.zip', 'w') as f: f.write('one.tif'); f.write('two.tif')\n\
         with z.ZipFile('packed.zip', 'w', z.ZIP_LZMA) as f: f.write('one.tif')\n",
    );
    std::fs::remove_file(at.join("one.tif")).expect("removed");
    for name in ["two files.zip", "packed.zip"] {
        follow(at, &hint(&at.join(name)), "python3");
        assert_eq!(open_and_delete(&at.join("one.tif")).columns(), 40, "{name}");
    }
    if !has_gdal() {
        return;
    }
    // A refused file inside: unpacked, it has a hint of its own.
    let picture = made(at, "-ot Byte -co COMPRESS=JPEG", "picture.tif");
    assert!(shell(at, "gzip picture.tif").status.success());
    follow(at, &hint(&at.join("picture.tif.gz")), "gzip");
    follow(at, &hint(&picture), "gdal_translate");
    assert_eq!(
        open_and_delete(&at.join("picture-converted.tif")).rows(),
        30
    );
}

/// Point clouds: their ground points, on a grid in their own reference system.
#[test]
fn points_become_a_grid_by_the_hint() {
    if !has_python("laspy, lazrs, pyproj") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    python(
        at,
        "import laspy, numpy as n, pyproj\n\
         def write(name, crs, corner, classes):\n    \
             h = laspy.LasHeader(point_format=6, version='1.4')\n    \
             h.offsets, h.scales = [*corner, 0], [0.001] * 3\n    \
             if crs: h.add_crs(pyproj.CRS.from_user_input(crs))\n    \
             y, x = n.mgrid[0:12, 0:20] + 0.5\n    \
             x, y = [n.repeat(v.ravel(), 2) for v in (x, y)]\n    \
             keep = ~((x == 5.5) & (y == 3.5))\n    \
             z = 100 + 2 * x + y\n    \
             z[1::2] += 30\n    \
             p = laspy.LasData(h)\n    \
             p.x, p.y, p.z = corner[0] + x[keep], corner[1] + y[keep], z[keep]\n    \
             p.classification = n.resize(classes, x.size)[keep]\n    \
             p.write(name)\n\
         write('trees.laz', 'EPSG:32611', (400000, 3800000), [2, 5])\n\
         write('feet.las', 'EPSG:2229+6360', (6490000, 1870000), [2, 5])\n\
         write('unknown.las', None, (-130, -7), [1, 1])\n",
    );
    for (name, system, lifted) in [
        ("trees.laz", Some(32611), 0.0),
        ("feet.las", Some(2229), 0.0),
        // Without points marked as ground, all of them count.
        ("unknown.las", None, 15.0),
    ] {
        follow(at, &hint(&at.join(name)), "python3");
        let stem = name.split('.').next().expect("a name");
        let raster = open_and_delete(&at.join(format!("{stem}-converted.asc")));
        assert_eq!((raster.columns(), raster.rows()), (20, 12), "{name}");
        assert_eq!(raster.summary().no_data, 1, "{name}");
        assert!(raster.height(5, 3).is_nan(), "{name}");
        let off = raster.height(7, 4) - (100.0 + 15.0 + 4.5 + lifted);
        assert!(off.abs() < 1e-3, "{name}: {off}");
        let found = raster.reference_system().and_then(|system| system.code());
        assert_eq!(found, system, "{name}");
        if name == "feet.las" {
            let foot = raster.metres_per_vertical_unit();
            assert!((foot - 1200.0 / 3937.0).abs() < 1e-9, "{foot}");
        }
    }
}

/// Files that GDAL does not read have no hint for GDAL.
#[test]
fn hint_omits_gdal_for_files_that_gdal_cannot_read() {
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
