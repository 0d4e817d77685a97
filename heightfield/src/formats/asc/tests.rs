//! Layouts of Esri ASCII grids from other programs, and rejected ones.

use super::decode;
use crate::input::FileBytes;
use crate::{CellUnit, Raster, RasterError, Samples};

fn open(text: &str) -> Result<Raster, RasterError> {
    let input = FileBytes::unpacked("test.asc", text.as_bytes().to_vec());
    Raster::checked(decode(&input)?, None)
}

fn heights(text: &str) -> Vec<f64> {
    let raster = open(text).unwrap_or_else(|fault| panic!("{fault}"));
    let rows = (0..raster.rows()).rev();
    rows.flat_map(|row| (0..raster.columns()).map(move |column| (column, row)))
        .map(|(column, row)| raster.height(column, row))
        .collect()
}

#[test]
fn header_accepts_any_white_space_case_and_order() {
    let text = "\u{feff}NROWS\t2\r\n  nCols 3\r\nYLLCenter 5\r\nXLLCENTER 5\r\nCellSize 10\r\n\
                NODATA_value -1\r\n1 2\r\n3\r\n\r\n4\t5   -1.000\r\n\u{1a}";
    let found = heights(text);
    assert_eq!(found[..5], [1.0, 2.0, 3.0, 4.0, 5.0]);
    assert!(found[5].is_nan());
}

#[test]
fn numbers_are_read_in_each_notation() {
    let text = "ncols 2\nnrows 3\ncellsize 1\n+1.5 1e3\n1,25 -.5\nNaN -9999";
    let found = heights(text);
    assert_eq!(found[..4], [1.5, 1000.0, 1.25, -0.5]);
    assert!(found[4].is_nan(), "not a number is no-data");
    assert!(
        found[5].is_nan(),
        "-9999 is Esri's no-data where none is stated"
    );
}

#[test]
fn samples_use_the_narrowest_exact_type() {
    let typed = |values: &str| {
        let text = format!("ncols 2\nnrows 2\ncellsize 1\nnodata_value -32768\n{values}");
        open(&text)
            .expect("a grid")
            .samples()
            .cloned()
            .expect("in memory")
    };
    assert_eq!(typed("1 2 3 -32768"), Samples::I16(vec![1, 2, 3, -32768]));
    assert_eq!(typed("1 2 3 70000"), Samples::I32(vec![1, 2, 3, 70_000]));
    assert_eq!(typed("1 2 3.5 4"), Samples::F32(vec![1.0, 2.0, 3.5, 4.0]));
    assert_eq!(
        typed("1 70000 3.5 4"),
        Samples::F32(vec![1.0, 70_000.0, 3.5, 4.0])
    );
    let wide = [16_777_217.0, 0.5, 0.0, 1.0];
    assert_eq!(typed("16777217 0.5 0 1"), Samples::F64(wide.to_vec()));
}

#[test]
fn cell_unit_is_inferred_from_place_and_size() {
    let cell = |header: &str| {
        let text = format!("ncols 2\nnrows 2\n{header}\n1 2 3 4");
        open(&text).expect("a grid").cell().expect("a cell")
    };
    let degrees = cell("xllcorner -105.5\nyllcorner 40\ncellsize 0.001");
    assert_eq!(degrees.unit, CellUnit::Degree);
    assert!((degrees.latitude.expect("a latitude") - 40.001).abs() < 1e-9);
    let metre = CellUnit::Length { metres: 1.0 };
    assert_eq!(cell("xllcorner 0\nyllcorner 0\ncellsize 0.01").unit, metre);
    assert_eq!(
        cell("xllcorner 5e5\nyllcorner 4e6\ncellsize 0.25").unit,
        metre
    );
    assert_eq!(cell("dx 2\ndy 5").metres(), (2.0, 5.0));
}

#[test]
fn parse_error_names_its_cause() {
    let reported = |text: &str| open(text).expect_err("refused").to_string();
    let square = "ncols 2\nnrows 2\ncellsize 1\n";
    assert!(reported(&format!("{square}1 2 3")).contains("3 follow"));
    assert!(reported(&format!("{square}1 2 3 4 5")).contains("more numbers"));
    assert!(reported(&format!("{square}1 2 3 x4")).contains("row 1, column 1: 'x4'"));
    assert!(reported("nrows 2\ncellsize 1\n1 2 3 4").contains("no ncols"));
    assert!(reported("ncols 2.5\nnrows 2\ncellsize 1\n1 2").contains("ncols is 2.5"));
    assert!(reported("ncols 2\nnrows 2\ncellsize\n").contains("ends after"));
    assert!(reported("ncols 2\nnrows 2\ncolour 3\ncellsize 1\n1 2 3 4").contains("'colour'"));
    let huge = "ncols 2000000000\nnrows 2000000000\ncellsize 1\n1 2 3";
    assert!(
        reported(huge).contains("truncated"),
        "and no room was made for them"
    );
    assert!(reported(&format!("{square}{}", "7".repeat(4000))).contains("more than 128 bytes"));
}

#[test]
fn infinite_nan_and_nodata_samples_are_no_data() {
    let square = "ncols 3\nnrows 2\ncellsize 1\n";
    for (header, samples, holes, remark) in [
        ("", "1 2 3 4 inf -inf", 2, "infinite"),
        ("", "1 2 3 4 1.#QNAN -1.#IND", 2, ""),
        ("nodata_value null\n", "1 2 3 4 null -9999", 2, "'null'"),
        ("nodata_value None\n", "1 2 3 4 5 None", 1, "'None'"),
        ("nodata_value -9999,0\n", "1 2 3 4 5 -9999.00", 1, ""),
    ] {
        let raster = open(&format!("{square}{header}{samples}")).expect("a grid");
        assert_eq!(raster.summary().no_data, holes, "{header}{samples}");
        assert_eq!(raster.summary().lowest, 1.0, "{header}{samples}");
        let remarks = raster.remarks().join(" ");
        assert!(remarks.contains(remark), "{remarks}");
        assert_eq!(remarks.is_empty(), remark.is_empty(), "{remarks}");
    }
    let fortran = open(&format!("{square}1.0D+02 2 3 4 5 6")).expect("a grid");
    assert_eq!(fortran.height(0, 1), 100.0);
}
