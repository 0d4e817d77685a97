//! Headers as GDAL and Esri's programs write them, and rejected ones.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use crate::{CellUnit, Error, OpenOptions, Raster, RasterError, ReferenceSystem};

/// A file and its header in their own folder.
struct Pair {
    folder: TempDir,
    data: &'static str,
}

impl Pair {
    fn new(data: &'static str, bytes: &[u8], header: &'static str, text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join(data), bytes).expect("written");
        fs::write(folder.path().join(header), text).expect("written");
        Self { folder, data }
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        Path::new(self.folder.path()).join(name)
    }

    fn open(&self, band: Option<u32>) -> Result<Raster, Error> {
        let options = OpenOptions {
            band,
            ..OpenOptions::default()
        };
        Raster::open(self.path(self.data), &options)
    }
}

/// Returns the heights, from the north-western sample on.
fn heights(raster: &Raster) -> Vec<f64> {
    let rows = (0..raster.rows()).rev();
    rows.flat_map(|row| (0..raster.columns()).map(move |column| (column, row)))
        .map(|(column, row)| raster.height(column, row))
        .collect()
}

const FLT: &str = "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 4100000\ncellsize 30\n\
                   NODATA_value -9999\nbyteorder LSBFIRST\n";

fn floats(values: [f32; 6], big: bool) -> Vec<u8> {
    let bytes = values.map(|value| {
        if big {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        }
    });
    bytes.concat()
}

#[test]
fn float_grid_is_read_with_bounds_and_no_data() {
    let stored = [1.5, -2.0, 3.0, -9999.0, 5.25, 6.0];
    for (big, header) in [(false, FLT.to_owned()), (true, FLT.replace("LSB", "MSB"))] {
        let pair = Pair::new("dem.flt", &floats(stored, big), "dem.hdr", &header);
        let wkt = r#"PROJCS["WGS 84 / UTM zone 11N",AUTHORITY["EPSG","32611"]]"#;
        fs::write(pair.path("dem.prj"), wkt).expect("written");
        let raster = pair.open(None).expect("a grid");
        let found = heights(&raster);
        assert_eq!(found[..3], [1.5, -2.0, 3.0]);
        assert!(found[3].is_nan() && raster.summary().no_data == 1);
        let bounds = raster.bounds().expect("placed");
        let sides = [bounds.west, bounds.south, bounds.east, bounds.north];
        assert_eq!(sides, [500_000.0, 4_100_000.0, 500_090.0, 4_100_060.0]);
        assert_eq!(
            raster.reference_system().and_then(ReferenceSystem::code),
            Some(32611)
        );
    }
}

#[test]
fn bands_by_line_by_pixel_and_after_each_other() {
    // Band 1 is 1 to 6, band 2 is -1 to -6.
    let by_line: [i16; 12] = [1, 2, 3, -1, -2, -3, 4, 5, 6, -4, -5, -6];
    let by_pixel: [i16; 12] = [1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6];
    let sequential: [i16; 12] = [1, 2, 3, 4, 5, 6, -1, -2, -3, -4, -5, -6];
    for (name, layout, samples) in [
        ("dem.bil", "BIL", by_line),
        ("dem.bip", "BIP", by_pixel),
        ("dem.bsq", "BSQ", sequential),
    ] {
        let esri = format!(
            "BYTEORDER M\nLAYOUT {layout}\nNROWS 2\nNCOLS 3\nNBANDS 2\nNBITS 16\n\
             PIXELTYPE SIGNEDINT\nULXMAP 10.5\nULYMAP 50\nXDIM 0.25\nYDIM 0.25\nNODATA 5\n"
        );
        let bytes = samples.map(i16::to_be_bytes).concat();
        let pair = Pair::new(name, &bytes, "dem.hdr", &esri);
        let raster = pair.open(None).expect("a grid");
        let first = heights(&raster);
        assert_eq!(first[..4], [1.0, 2.0, 3.0, 4.0], "{esri}");
        assert!(first[4].is_nan(), "{esri}");
        assert!(raster.remarks()[0].contains("2 bands"));
        let second = heights(&pair.open(Some(2)).expect("its second band"));
        assert_eq!(second, [-1.0, -2.0, -3.0, -4.0, -5.0, -6.0], "{esri}");
        assert_eq!(raster.cell().map(|cell| cell.unit), Some(CellUnit::Degree));
        assert_eq!(
            raster.bounds().map(|bounds| (bounds.west, bounds.north)),
            Some((10.375, 50.125))
        );
        let error = pair.open(Some(3)).expect_err("two bands");
        assert!(
            matches!(error.fault(), RasterError::NoSuchPart { .. }),
            "{error}"
        );
        assert!(error.to_string().contains("bands 1 to 2"), "{error}");
    }
}

/// A folder may contain a database or a picture with the name of a header.
#[test]
fn header_beside_a_file_of_another_kind_is_ignored() {
    let header = "NROWS 2\nNCOLS 2\nNBITS 8\n";
    for (data, bytes) in [
        ("f.gpkg", &b"SQLite format 3\0 and more"[..]),
        ("f.img", b"EHFA_HEADER_TAG\0 and more"),
        ("f.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF"),
    ] {
        let opened = Pair::new(data, bytes, "f.hdr", header).open(None);
        assert!(opened.is_err(), "{data}");
        let named_so = Pair::new("f.bil", &bytes[..4], "f.hdr", header).open(None);
        assert!(named_so.is_ok(), "by its name it is samples");
    }
}

/// GTOPO30's `.DEM` is such an image, though USGS models have the same extension.
#[test]
fn header_has_priority_over_the_extension() {
    let header = "BYTEORDER      M\nLAYOUT       BIL\nNROWS         2\nNCOLS         2\n\
                  NBANDS        1\nNBITS         16\nBANDROWBYTES         4\n\
                  TOTALROWBYTES        4\nBANDGAPBYTES         0\nNODATA        -9999\n\
                  ULXMAP        20.00416666666667\nULYMAP        39.99583333333333\n\
                  XDIM          0.00833333333333\nYDIM          0.00833333333333\n";
    let bytes = [12_i16, -9999, -3, 400].map(i16::to_be_bytes).concat();
    let raster = Pair::new("E020N40.DEM", &bytes, "E020N40.HDR", header).open(None);
    let found = heights(&raster.expect("a grid"));
    assert_eq!([found[0], found[2], found[3]], [12.0, -3.0, 400.0]);
    assert!(
        found[1].is_nan(),
        "a negative no-data value means signed samples"
    );
}

/// Interleaved rows, each with its own padding.
#[test]
fn rows_of_bands_may_be_padded() {
    let header = "NROWS 2\nNCOLS 2\nNBANDS 2\nNBITS 8\nLAYOUT BIL\nBANDROWBYTES 3\n";
    let bytes = [1, 2, 0, 5, 6, 0, 3, 4, 0, 7, 8, 0];
    for (band, wanted) in [(1, [1.0, 2.0, 3.0, 4.0]), (2, [5.0, 6.0, 7.0, 8.0])] {
        let pair = Pair::new("a.bil", &bytes, "a.hdr", header);
        let raster = pair.open(Some(band)).expect("a grid");
        assert_eq!(heights(&raster), wanted, "band {band}");
    }
}

#[test]
fn rows_may_be_padded() {
    let header = "NROWS 2\nNCOLS 2\nNBITS 8\nTOTALROWBYTES 5\nSKIPBYTES 1\n";
    let bytes = [9, 1, 2, 0, 0, 0, 3, 4, 0, 0, 0];
    let found = heights(
        &Pair::new("a.bil", &bytes, "a.hdr", header)
            .open(None)
            .expect("a grid"),
    );
    assert_eq!(found, [1.0, 2.0, 3.0, 4.0]);
}

fn reported(data: &'static str, bytes: &[u8], header: &str) -> (String, Error) {
    let error = Pair::new(data, bytes, "a.hdr", header)
        .open(None)
        .expect_err("refused");
    (error.to_string(), error)
}

#[test]
fn invalid_headers_and_truncated_data_are_named() {
    let whole = floats([1.0; 6], false);
    let (text, _) = reported("a.flt", &whole[..23], FLT);
    assert!(
        text.contains("truncated") && text.contains("a.hdr"),
        "{text}"
    );
    for absurd in [
        "ncols 4000000000\nnrows 4000000000\n",
        "ncols 1e300\nnrows 2\n",
        "ncols 3\nnrows 2\nskipbytes 8e15\n",
        "ncols 3\nnrows 4000000000\ntotalrowbytes 0\n",
    ] {
        let (text, _) = reported("a.flt", &whole, absurd);
        assert!(
            text.contains("truncated")
                || text.contains("absurd")
                || text.contains("is 1e300")
                || text.contains("is 1000"),
            "{text}"
        );
    }
    for (header, word) in [
        ("ncols x\nnrows 2\n", "ncols is 'x'"),
        ("ncols 0\nnrows 2\n", "no columns"),
        ("ncols 3\nnrows 2\nlayout up\n", "layout up"),
        ("ncols 3\nnrows 2\nnbits 12\n", "12 bits"),
        (
            "ncols 3\nnrows 2\ncellsize 0\nxllcorner 1\nyllcorner 1\n",
            "no size",
        ),
    ] {
        let (text, _) = reported("a.flt", &whole, header);
        assert!(text.contains(word), "{header}: {text}");
    }
}

#[test]
fn missing_header_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("dem.flt");
    fs::write(&path, [0; 24]).expect("written");
    let error = Raster::open(&path, &OpenOptions::default()).expect_err("no header");
    assert!(
        matches!(error.fault(), RasterError::HeaderMissing(name) if name == "dem.hdr"),
        "{error}"
    );
    // A picture format for radiance has the same extension.
    fs::write(folder.path().join("dem.hdr"), "#?RADIANCE\n").expect("written");
    let error = Raster::open(&path, &OpenOptions::default()).expect_err("another header");
    assert!(
        matches!(error.fault(), RasterError::HeaderMissing(_)),
        "{error}"
    );
}

/// NOAA's ETOPO1 states the type in its own words.
#[test]
fn number_type_and_unit_are_read() {
    let header = "NCOLS 3\nNROWS 2\nXLLCENTER -10\nYLLCENTER 40\nCELLSIZE 0.5\n\
                  NODATA_VALUE -32768\nBYTEORDER LSBFIRST\nZUNITS FEET\n";
    let stored = [367.0, 960.0, -5.0, -32768.0, 1.0, 2.0];
    let shorts: Vec<u8> = stored
        .iter()
        .flat_map(|value| (*value as i16).to_le_bytes())
        .collect();
    let floats = floats(stored.map(|value| value as f32), false);
    for (bytes, number_type) in [
        (&shorts, "NUMBERTYPE 2_BYTE_INTEGER\n"),
        (&floats, "NUMBERTYPE 4_BYTE_FLOAT\n"),
        (&shorts, ""),
        (&floats, ""),
    ] {
        let header = format!("{header}{number_type}");
        let raster = Pair::new("etopo1.bin", bytes, "etopo1.hdr", &header).open(None);
        let raster = raster.expect("a grid");
        let summary = raster.summary();
        assert_eq!(
            (summary.lowest, summary.highest, summary.no_data),
            (-5.0, 960.0, 1)
        );
        assert_eq!(raster.stated_metres_per_vertical_unit(), Some(0.3048));
        let stated = raster.remarks().join(" ");
        assert_eq!(
            stated.contains("states no type"),
            number_type.is_empty(),
            "{stated}"
        );
    }
}

#[test]
fn length_that_contradicts_the_header_is_refused() {
    let header = "NCOLS 3\nNROWS 2\nBYTEORDER LSBFIRST\n";
    let reported = |kind: &str, bytes: usize| {
        let header = format!("{header}{kind}");
        let opened = Pair::new("x.bil", &vec![1; bytes], "x.hdr", &header).open(None);
        opened.map_or_else(|fault| fault.to_string(), |_| String::new())
    };
    let stated = reported("NBITS 16\n", 24);
    assert!(
        stated.contains("byte 12") && stated.contains("has 24"),
        "{stated}"
    );
    assert!(reported("NBITS 8\nNUMBERTYPE 2_BYTE_INTEGER\n", 12).contains("nbits is 8"));
    assert!(reported("NUMBERTYPE 3_BYTE_COLOUR\n", 12).contains("3_byte_colour"));
    // Some programs append less than a row after the samples.
    assert_eq!(reported("NBITS 16\n", 14), "");
}
