//! Files that only GDAL reads, through a libgdal of the machine: `data/only_gdal.py` makes them.

use std::path::{Path, PathBuf};

use hapterra_tests::{gdal_stand_in, hapterra_binary, memory_limit};
use heightfield::{OpenOptions, Raster, RasterError, files_read_with, gdal};

/// Returns true if there is a libgdal; prints a message otherwise.
fn has_gdal() -> bool {
    gdal()
        .inspect_err(|why| eprintln!("skipped: {why}"))
        .is_ok()
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data/only_gdal")
        .join(name)
}

fn open(name: &str, band: Option<u32>) -> Result<Raster, heightfield::Error> {
    let options = OpenOptions {
        band,
        ..OpenOptions::default()
    };
    Raster::open(file(name), &options)
}

#[test]
fn files_that_only_gdal_reads_are_exact_and_in_place() {
    if !has_gdal() {
        return;
    }
    for (name, bands) in [("erdas.img", 2), ("geomatica.pix", 2), ("saga.sdat", 1)] {
        for band in 1..=bands {
            let raster = open(name, Some(band)).expect(name);
            assert_eq!((raster.columns(), raster.rows()), (5, 4), "{name}");
            assert_eq!(raster.summary().no_data, 1, "{name}");
            for (column, row) in (0..5).flat_map(|column| (0..4).map(move |row| (column, row))) {
                // The file's first row is the northern one.
                let found = raster.height(column, 3 - row);
                let above = 1000.0 * f64::from(band - 1);
                let expected = 100.5 + 7.0 * f64::from(column) - 3.0 * f64::from(row) + above;
                match (column, row) {
                    (3, 1) => assert!(found.is_nan(), "{name}"),
                    _ => assert_eq!(found, expected, "{name} {column} {row}"),
                }
            }
            let bounds = raster.bounds().expect("placed");
            assert_eq!((bounds.west, bounds.south), (400_000.0, 3_799_880.0));
            // Some formats keep a system's parameters but lose its code.
            let degrees = raster.bounds_lonlat().expect("a known projection");
            let west = degrees.west;
            assert!((west + 118.0873).abs() < 1e-3, "{name}: {west}");
        }
        let error = open(name, Some(3)).expect_err("no third band").to_string();
        assert!(error.contains("no band 3"), "{error}");
    }
}

#[test]
fn large_files_stay_on_disk_and_overviews_survey_them() {
    if !has_gdal() {
        return;
    }
    let options = OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    let raster = Raster::open(file("overviews.img"), &options).expect("read");
    assert_eq!((raster.columns(), raster.rows()), (600, 500));
    // The coarsest overview has every fourth sample.
    assert_eq!(raster.summary().examined, 150 * 125);
    for (column, row) in [(0, 0), (599, 499), (17, 300), (512, 33)] {
        let expected = column / 16 + row / 16;
        assert_eq!(raster.height(column, 499 - row), f64::from(expected));
    }
}

#[test]
fn file_unknown_to_gdal_has_the_original_error() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("letter.doc");
    std::fs::write(&path, "Dear friend").expect("written");
    let error = Raster::open(&path, &OpenOptions::default()).expect_err("no terrain");
    assert!(
        matches!(error.fault(), RasterError::UnknownFormat),
        "{error}"
    );
    let cut = folder.path().join("cut.img");
    let bytes = std::fs::read(file("erdas.img")).expect("readable");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("written");
    Raster::open(&cut, &OpenOptions::default()).expect_err("half of a file");
}

#[test]
fn vrt_gaps_without_no_data_are_reported_as_heights() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = vrt(
        folder.path(),
        "gap.vrt",
        &file("erdas.img").display().to_string(),
    );
    let raster = Raster::open(&path, &OpenOptions::default()).expect("read by GDAL");
    assert_eq!((raster.height(0, 7), raster.height(0, 0)), (100.5, 0.0));
    let is_reported = raster
        .remarks()
        .iter()
        .any(|remark| remark.contains("-vrtnodata"));
    assert!(is_reported, "{:?}", raster.remarks());
}

/// Writes a VRT of 5 × 8 samples; a file has their northern half.
fn vrt(folder: &Path, name: &str, of: &str) -> PathBuf {
    let text = format!(
        "<VRTDataset rasterXSize=\"5\" rasterYSize=\"8\"><VRTRasterBand dataType=\"Float32\" band=\"1\">\
         <SimpleSource><SourceFilename relativeToVRT=\"1\">{of}</SourceFilename><SourceBand>1</SourceBand>\
         <SrcRect xOff=\"0\" yOff=\"0\" xSize=\"5\" ySize=\"4\"/><DstRect xOff=\"0\" yOff=\"0\" xSize=\"5\" ySize=\"4\"/>\
         </SimpleSource></VRTRasterBand></VRTDataset>"
    );
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path
}

#[test]
fn vrts_name_files_beside_them_and_other_vrts() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).expect("a folder");
    std::fs::copy(file("erdas.img"), inner.join("ground.img")).expect("copied");
    vrt(&inner, "first.vrt", "ground.img");
    let second = vrt(folder.path(), "second.vrt", "inner/first.vrt");
    let raster = Raster::open(&second, &OpenOptions::default()).expect("a VRT of a VRT");
    assert_eq!(raster.height(0, 7), 100.5);
    let read = files_read_with(&second);
    assert!(read.contains(&second) && read.len() == 2, "{read:?}");
}

/// Opening a pipe waits forever, so no pipe is opened: not as the file, a sidecar, or a name in a
/// VRT.
#[cfg(unix)]
#[test]
fn pipes_are_not_opened_under_any_name() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let pipe = |name: &str| {
        let path = at.join(name);
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo runs").success());
        path
    };
    let named = pipe("pipe").display().to_string();
    let mut files: Vec<_> = [
        ("plain", "pipe"),
        ("entity", "pip&#101;"),
        ("whole", named.as_str()),
        ("driver", "NETCDF:&quot;pipe&quot;:z"),
        ("part", "/vsisubfile/0_100,pipe"),
        ("nested", "plain.vrt"),
        (
            "inline",
            "&lt;VRTDataset&gt;&lt;a&gt;pipe&lt;/a&gt;&lt;/VRTDataset&gt;",
        ),
    ]
    .map(|(name, of)| vrt(at, &format!("{name}.vrt"), of))
    .into();
    std::fs::copy(file("erdas.img"), at.join("beside.img")).expect("copied");
    pipe("beside.img.aux.xml");
    files.push(at.join("beside.img"));
    for path in files {
        let error = Raster::open(&path, &OpenOptions::default()).expect_err("a pipe");
        assert!(error.to_string().contains("a pipe (FIFO)"), "{error}");
    }
}

fn packed(folder: &Path, command: &str) {
    let done = std::process::Command::new("sh")
        .args(["-c", command])
        .current_dir(folder)
        .status();
    assert!(done.expect("a shell").success(), "{command}");
}

#[test]
fn archives_of_one_raster_are_opened_and_of_several_it_is_named() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (from, to) in [("erdas.img", "a.img"), ("overviews.img", "b.img")] {
        std::fs::copy(file(from), at.join(to)).expect("copied");
    }
    std::fs::write(at.join("README.txt"), "read me").expect("written");
    packed(
        at,
        "tar -cf one.tar a.img README.txt; tar -czf one.tgz ./a.img README.txt; gzip -k a.img; \
         tar -cf two.tar a.img b.img; tar -cf none.tar README.txt; tar -cf nested.tar one.tar",
    );
    for name in ["one.tar", "one.tgz", "a.img.gz"] {
        let raster = Raster::open(at.join(name), &OpenOptions::default());
        let raster = raster.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(
            (raster.columns(), raster.height(0, 3)),
            (5, 100.5),
            "{name}"
        );
    }
    let refused = |name: &str| {
        let error = Raster::open(at.join(name), &OpenOptions::default()).expect_err(name);
        error.to_string()
    };
    let why = refused("two.tar");
    assert!(why.contains("a.img, b.img"), "{why}");
    let chosen = OpenOptions {
        variable: Some("b.img".into()),
        ..OpenOptions::default()
    };
    let raster = Raster::open(at.join("two.tar"), &chosen).expect("b.img");
    assert_eq!(raster.columns(), 600);
    for name in ["none.tar", "nested.tar"] {
        assert!(refused(name).contains("no terrain file"), "{name}");
    }
}

/// A gzip file of a gigabyte of zeros is a megabyte.
#[test]
fn archives_that_unpack_to_gigabytes_are_refused() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    packed(
        folder.path(),
        "head -c 1100000000 /dev/zero | gzip -1 > bomb.img.gz",
    );
    let error = Raster::open(folder.path().join("bomb.img.gz"), &OpenOptions::default());
    let error = error.expect_err("too large").to_string();
    assert!(error.contains("1024 MB"), "{error}");
}

#[test]
fn labels_beside_planetary_images_are_opened() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let label = "PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = 8\r\n\
                 FILE_RECORDS = 3\r\n^IMAGE = \"MOON.IMG\"\r\nOBJECT = IMAGE\r\nLINES = 3\r\n\
                 LINE_SAMPLES = 4\r\nSAMPLE_TYPE = LSB_INTEGER\r\nSAMPLE_BITS = 16\r\nBANDS = 1\r\n\
                 END_OBJECT = IMAGE\r\nEND\r\n";
    std::fs::write(folder.path().join("MOON.LBL"), label).expect("written");
    let samples: Vec<u8> = (0..12_i16).flat_map(i16::to_le_bytes).collect();
    let image = folder.path().join("MOON.IMG");
    std::fs::write(&image, samples).expect("written");
    let raster = Raster::open(&image, &OpenOptions::default()).expect("by its label");
    assert_eq!((raster.height(0, 2), raster.height(3, 0)), (0.0, 11.0));
    let remarks = raster.remarks().join(" ");
    assert!(remarks.contains("MOON.LBL"), "{remarks}");
}

/// ENVI's samples have any extension, and a unit beside a zone is the unit of the coordinates.
#[test]
fn envi_file_is_placed_in_its_own_unit() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let samples: Vec<u8> = (1..=4_u16).flat_map(u16::to_le_bytes).collect();
    for (unit, metres) in [("Meters", 1.0), ("Feet", 0.3048)] {
        for (name, header) in [("a.dat", "a.hdr"), ("b", "b.hdr"), ("c.bil", "c.bil.hdr")] {
            let text = format!(
                "ENVI\nsamples = 2\nlines = 2\nbands = 1\nheader offset = 0\ndata type = 12\n\
                 interleave = bsq\nbyte order = 0\nmap info = {{UTM, 1, 1, {}, {}, {}, {}, 32, North, \
                 WGS-84, units={unit}}}\n",
                500_000.0 / metres,
                5_000_000.0 / metres,
                30.0 / metres,
                30.0 / metres
            );
            let path = folder.path().join(name);
            std::fs::write(&path, &samples).expect("written");
            std::fs::write(folder.path().join(header), text).expect("written");
            let raster = Raster::open(&path, &OpenOptions::default());
            let raster = raster.unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(raster.height(0, 1), 1.0, "{name}");
            let west = raster.bounds_lonlat().expect("known").west;
            assert!((west - 9.0).abs() < 1e-4, "{name} {unit}: {west}");
            let cell = raster.cell().expect("a cell").metres().0;
            assert!((cell - 30.0).abs() < 0.05, "{name} {unit}: {cell}");
        }
    }
}

/// Without a libgdal the message names the format, the package to install by system, and the
/// command that works then; if libgdal is too old, its version is named.
#[test]
fn formats_are_named_where_there_is_no_libgdal() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (name, head, format) in [
        ("a.nc", &b"CDF\x01"[..], "NetCDF"),
        ("a.img", b"EHFA_HEADER_TAG", "Erdas Imagine"),
        ("a.asc", b"north: 5\nsouth: 0\n", "GRASS ASCII"),
        ("a.dt2", b"UHL1", "DTED"),
        ("a.dem", b"a quadrangle", "USGS DEM"),
        ("a.vrt", b"<VRTDataset/>", "VRT"),
        ("a.json", b"{\"type\":\"FeatureCollection\"}", "STAC"),
        ("a.zip", b"PK\x03\x04", "ZIP"),
        ("a.jp2", b"\0\0\0\x0cjP  \r\n\x87\n", "JPEG 2000"),
    ] {
        let path = at.join(name);
        std::fs::write(&path, head).expect("written");
        let output = memory_limit::info_without_gdal(&path, &[]);
        let reported = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{reported}");
        for part in [
            format,
            "read through GDAL",
            "apt install",
            "then this works",
        ] {
            assert!(reported.contains(part), "{name}: {part} in {reported}");
        }
    }
    let old = std::process::Command::new(hapterra_binary())
        .arg("info")
        .arg(at.join("a.nc"))
        .env("GDAL_LIBRARY", gdal_stand_in::library(at))
        .env("STAND_IN_VERSION", "3030200")
        .output()
        .expect("it runs");
    let reported = String::from_utf8_lossy(&old.stderr).into_owned();
    for part in ["is GDAL 3.3.2", "from 3.4.0"] {
        assert!(reported.contains(part), "{reported}");
    }
}

/// GDAL reads the no-data mark as a height of 0: such a file is refused, and one with a no-data
/// number is read.
#[test]
fn grass_null_mark_is_refused_and_no_data_number_is_read() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("grass.asc");
    let header = "north: 20\nsouth: 0\neast: 30\nwest: 0\nrows: 2\ncols: 3\n";
    std::fs::write(&path, format!("{header}1 2 3\n4 * 6\n")).expect("written");
    let error = Raster::open(&path, &OpenOptions::default()).expect_err("a star");
    assert!(error.to_string().contains("null_value"), "{error}");
    std::fs::write(&path, format!("{header}1 2 3\n4 -9999 6\n")).expect("written");
    let options = OpenOptions {
        no_data: Some(-9999.0),
        ..OpenOptions::default()
    };
    let raster = Raster::open(&path, &options).expect("numbers");
    assert_eq!((raster.height(0, 1), raster.summary().no_data), (1.0, 1));
}

/// A libgdal that needs 300 ms for each block delays no tick: until the blocks arrive the coarse
/// fallback is under the hand, not no-data.
///
/// Safety: 29.
#[test]
fn slow_libgdal_delays_no_tick() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let recording = at.join("felt.csv");
    let output = std::process::Command::new(hapterra_binary())
        .arg("run")
        .arg(gdal_stand_in::terrain(at))
        .args(["--device", "native", "--input", "in-memory=0MB"])
        .args(["--scale", "1mm/cell", "--exaggeration", "0.1mm/unit"])
        .args(["--duration", "1s", "--out"])
        .arg(&recording)
        .env("GDAL_LIBRARY", gdal_stand_in::library(at))
        .env("STAND_IN_SLEEP_MS", "300")
        .stdin(std::process::Stdio::null())
        .output()
        .expect("it runs");
    let reported = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{reported}");
    let mut rows = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(&recording)
        .expect("a recording");
    let names = rows.headers().expect("names").clone();
    let column = |name: &str| names.iter().position(|own| own == name).expect("there");
    let (tick, late, limits) = (column("tick"), column("late"), column("limits"));
    let rows: Vec<_> = rows.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 1000);
    for (number, row) in (1..).zip(&rows) {
        assert_eq!(
            &row[tick],
            number.to_string().as_str(),
            "no tick is missing"
        );
        assert_eq!(&row[late], "0", "tick {number}");
        // Before the first one the device has no terrain at all.
        let is_no_data = number > 1 && row[limits].contains("TERRAIN_MISSING");
        assert!(!is_no_data, "tick {number}: {}", &row[limits]);
    }
    let coarse = rows
        .iter()
        .filter(|row| row[limits].contains("TERRAIN_COARSE"));
    assert!(coarse.count() > 0, "all blocks were there at once");
}
