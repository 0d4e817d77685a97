//! Reads a file that the test writes through this machine's libgdal; without one, reports that.

use std::path::Path;

use heightfield_gdal::{Band, Error, Library, Mask, SampleType, Settings, Version, Window};

fn gdal() -> Option<Library> {
    Library::load(Settings::default())
        .inspect_err(|why| eprintln!("skipped: {why}; {}", Error::how_to_install()))
        .ok()
}

/// Writes ENVI's raw samples and their header: 4 × 3 floats, one of them no-data.
fn write(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("field.dat");
    let samples = (0..12).map(|at| if at == 5 { -1.0 } else { at as f32 });
    let bytes: Vec<u8> = samples.flat_map(f32::to_le_bytes).collect();
    std::fs::write(&path, bytes).expect("written");
    let header = "ENVI\nsamples = 4\nlines = 3\nbands = 1\ndata type = 4\ninterleave = bsq\n\
                  byte order = 0\ndata ignore value = -1\nheader offset = 0\n";
    std::fs::write(folder.join("field.hdr"), header).expect("written");
    path
}

#[test]
fn samples_and_their_metadata_are_read() {
    let Some(gdal) = gdal() else { return };
    assert!(gdal.version() >= Version::OLDEST, "{gdal:?}");
    assert!(gdal.drivers().iter().any(|driver| driver.name == "ENVI"));
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = gdal.open(&write(folder.path()), &[]).expect("opened");
    assert_eq!((dataset.driver().as_str(), dataset.bands()), ("ENVI", 1));
    let band = dataset.band(1).expect("there");
    assert_eq!((band.size(), band.block_size()), ([4, 3], [4, 1]));
    assert_eq!(band.sample_type(), Ok(SampleType::F32));
    assert_eq!((band.no_data(), band.mask()), (Some(-1.0), Mask::None));
    let window = Window {
        column: 1,
        row: 1,
        columns: 2,
        rows: 2,
    };
    let mut samples = [0.0_f64; 4];
    band.read(window, &mut samples).expect("read");
    assert_eq!(samples, [-1.0, 6.0, 9.0, 10.0]);
}

#[test]
fn dataset_can_be_used_on_another_thread() {
    let Some(gdal) = gdal() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = gdal.open(&write(folder.path()), &[]).expect("opened");
    let bands = std::thread::spawn(move || dataset.bands()).join();
    assert_eq!(bands.expect("no panic"), 1);
}

#[test]
fn windows_and_buffers_of_wrong_size_are_refused() {
    let Some(gdal) = gdal() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let dataset = gdal.open(&write(folder.path()), &[]).expect("opened");
    let band = dataset.band(1).expect("there");
    let refused = |[column, row, columns, rows]: [u32; 4], room: usize| {
        let window = Window {
            column,
            row,
            columns,
            rows,
        };
        let result = Band::read(&band, window, &mut vec![0_u8; room]);
        assert!(matches!(result, Err(Error::Window { .. })), "{result:?}");
    };
    refused([0, 0, 4, 3], 11);
    refused([0, 0, 4, 3], 13);
    refused([1, 0, 4, 3], 12);
    refused([u32::MAX, 0, 4, 3], 12);
    refused([0, 0, 0, 3], 0);
    let error = dataset.band(2).err().map(|error| error.to_string());
    assert_eq!(
        error.as_deref(),
        Some("there is no band 2: the file has only band 1")
    );
    assert!(dataset.band(0).is_err());
}

#[test]
fn failed_open_reports_its_path_or_a_zero_byte() {
    let Some(gdal) = gdal() else { return };
    let error = gdal.open("/no/such/file".as_ref(), &[]).expect_err("none");
    assert!(error.to_string().contains("/no/such/file"), "{error}");
    let zero = gdal.open("a\0b".as_ref(), &[]).expect_err("no path");
    assert!(matches!(zero, Error::ZeroByte(_)), "{zero}");
}

/// Writes a VRT of one file, referenced as `source`.
fn vrt(folder: &Path, source: &str) -> std::path::PathBuf {
    let path = folder.join("named.vrt");
    let text = format!(
        "<VRTDataset rasterXSize=\"4\" rasterYSize=\"3\"><VRTRasterBand dataType=\"Float32\" band=\"1\">\
         <SimpleSource><SourceFilename relativeToVRT=\"1\">{source}</SourceFilename></SimpleSource>\
         </VRTRasterBand></VRTDataset>"
    );
    std::fs::write(&path, text).expect("written");
    path
}

#[test]
fn vrt_sources_are_checked_before_opening() {
    let Some(gdal) = gdal() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path());
    let dataset = gdal
        .open(&vrt(folder.path(), "field.dat"), &[])
        .expect("a file");
    let files = dataset.files();
    let is_named = |file: &std::path::PathBuf| file.ends_with("field.dat");
    assert!(files.iter().any(is_named), "{files:?}");
    for source in ["NETCDF:&quot;http://localhost/a.nc&quot;:z", "/dev/zero"] {
        let refused = gdal
            .open(&vrt(folder.path(), source), &[])
            .expect_err("refused");
        let is_known = matches!(refused, Error::NotOpened { .. });
        assert!(is_known || !cfg!(unix), "{source}: {refused}");
    }
}

#[test]
fn unknown_open_options_are_refused() {
    let Some(gdal) = gdal() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let refused = gdal
        .open(&write(folder.path()), &["NO_SUCH=1"])
        .expect_err("unknown");
    assert!(matches!(refused, Error::OpenOption { .. }), "{refused}");
}
