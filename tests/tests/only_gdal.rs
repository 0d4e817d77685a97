//! Files that nothing but GDAL reads here, through a libgdal of the machine:
//! `data/only_gdal.py` makes them.

use std::path::{Path, PathBuf};

use heightfield::{BadRaster, OpenOptions, Raster, gdal};

/// Whether there is a libgdal; says so where not.
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
            assert_eq!(raster.summary().holes, 1, "{name}");
            for (column, row) in (0..5).flat_map(|column| (0..4).map(move |row| (column, row))) {
                // The file's first row is the northern one.
                let found = raster.height(column, 3 - row);
                let above = 1000.0 * f64::from(band - 1);
                let wanted = 100.5 + 7.0 * f64::from(column) - 3.0 * f64::from(row) + above;
                match (column, row) {
                    (3, 1) => assert!(found.is_nan(), "{name}"),
                    _ => assert_eq!(found, wanted, "{name} {column} {row}"),
                }
            }
            let bounds = raster.bounds().expect("placed");
            assert_eq!((bounds.west, bounds.south), (400_000.0, 3_799_880.0));
            // Some formats keep a system's parameters and lose its code.
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
        most_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    let raster = Raster::open(file("overviews.img"), &options).expect("read");
    assert_eq!((raster.columns(), raster.rows()), (600, 500));
    // The coarsest overview has every fourth sample.
    assert_eq!(raster.summary().looked_at, 150 * 125);
    for (column, row) in [(0, 0), (599, 499), (17, 300), (512, 33)] {
        let wanted = column / 16 + row / 16;
        assert_eq!(raster.height(column, 499 - row), f64::from(wanted));
    }
}

#[test]
fn what_gdal_does_not_know_keeps_its_own_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("letter.doc");
    std::fs::write(&path, "Dear friend").expect("written");
    let error = Raster::open(&path, &OpenOptions::default()).expect_err("no terrain");
    assert!(matches!(error.fault(), BadRaster::UnknownFormat), "{error}");
    let cut = folder.path().join("cut.img");
    let bytes = std::fs::read(file("erdas.img")).expect("readable");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("written");
    Raster::open(&cut, &OpenOptions::default()).expect_err("half of a file");
}

#[test]
fn gaps_of_a_vrt_that_gdal_reads_are_said_to_be_heights() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("smoothed.vrt");
    // Filters are not read here.
    let text = format!(
        "<VRTDataset rasterXSize=\"5\" rasterYSize=\"8\"><VRTRasterBand dataType=\"Float32\" band=\"1\">\
         <KernelFilteredSource><SourceFilename>{}</SourceFilename><SourceBand>1</SourceBand>\
         <SrcRect xOff=\"0\" yOff=\"0\" xSize=\"5\" ySize=\"4\"/><DstRect xOff=\"0\" yOff=\"0\" xSize=\"5\" ySize=\"4\"/>\
         <Kernel><Size>1</Size><Coefs>1</Coefs></Kernel></KernelFilteredSource>\
         </VRTRasterBand></VRTDataset>",
        file("erdas.img").display()
    );
    std::fs::write(&path, text).expect("written");
    let raster = Raster::open(&path, &OpenOptions::default()).expect("read by GDAL");
    assert_eq!((raster.height(0, 7), raster.height(0, 0)), (100.5, 0.0));
    let said = raster
        .remarks()
        .iter()
        .any(|remark| remark.contains("-vrtnodata"));
    assert!(said, "{:?}", raster.remarks());
}
