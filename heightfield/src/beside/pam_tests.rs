//! Notes beside small grids.

use super::*;
use crate::{Certainty, OpenOptions, Raster};

#[test]
fn notes_of_the_requested_band_are_read() {
    let text = r#"<PAMDataset>
        <SRS dataAxisToSRSAxisMapping="1,2">EPSG:32632</SRS>
        <PAMRasterBand band="1"><NoDataValue>-9.999E3</NoDataValue><UnitType>ft</UnitType></PAMRasterBand>
        <PAMRasterBand band="2"><Scale>0.5</Scale><Offset>10</Offset></PAMRasterBand>
    </PAMDataset>"#;
    let first = Notes::of(text, 1).expect("notes");
    assert_eq!((first.no_data, first.scale), (Some(-9999.0), None));
    assert_eq!(first.unit.as_deref(), Some("ft"));
    assert_eq!(first.system.as_deref(), Some("EPSG:32632"));
    let second = Notes::of(text, 2).expect("notes");
    assert_eq!((second.scale, second.offset), (Some(0.5), Some(10.0)));
    assert_eq!(second.no_data, None);
}

/// Opens a grid of the heights 1 to 6 with notes beside it.
fn noted(notes: &str, options: &OpenOptions) -> Raster {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.asc");
    let grid = "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 5000000\ncellsize 30\n1 2 3 4 5 6";
    std::fs::write(&path, grid).expect("written");
    std::fs::write(folder.path().join("x.asc.aux.xml"), notes).expect("written");
    Raster::open(&path, options).expect("a grid")
}

fn in_band(notes: &str) -> String {
    format!("<PAMDataset><PAMRasterBand band='1'>{notes}</PAMRasterBand></PAMDataset>")
}

#[test]
fn notes_beside_a_file_are_used() {
    let notes = in_band(
        "<NoDataValue>6</NoDataValue><Scale>2</Scale><Offset>1</Offset><UnitType>ft</UnitType>",
    );
    let system = "<PAMDataset><SRS>EPSG:32632</SRS>";
    let notes = notes.replace("<PAMDataset>", system);
    let raster = noted(&notes, &OpenOptions::default());
    let summary = raster.summary();
    assert_eq!(
        (summary.lowest, summary.highest, summary.no_data),
        (3.0, 11.0, 1)
    );
    assert_eq!(raster.stated_metres_per_vertical_unit(), Some(0.3048));
    let code = raster.reference_system().and_then(ReferenceSystem::code);
    assert_eq!(code, Some(32632));
    assert_eq!(
        raster.cell().expect("a cell").certainty,
        Certainty::FromCode
    );
    // The user's value has priority.
    let options = OpenOptions {
        no_data: Some(1.0),
        ..OpenOptions::default()
    };
    assert_eq!(noted(&notes, &options).summary().lowest, 5.0);
}

#[test]
fn notes_that_contradict_the_file_are_reported() {
    let placed = "<PAMDataset><GeoTransform>0, 2, 0, 9, 0, -2</GeoTransform></PAMDataset>";
    let raster = noted(placed, &OpenOptions::default());
    assert_eq!(raster.bounds().expect("placed").west, 0.0);
    let stated = raster.remarks().join(" ");
    assert!(
        stated.contains("x.asc.aux.xml beside it differ"),
        "{stated}"
    );
    let raster = noted(
        &in_band("<NoDataValue>2</NoDataValue>"),
        &OpenOptions::default(),
    );
    let stated = raster.remarks().join(" ");
    assert!(
        stated.contains("the file states -9999") && raster.summary().no_data == 1,
        "{stated}"
    );
}

#[test]
fn notes_that_cannot_be_read_are_named() {
    for notes in ["<PAMDataset>", "no XML", &"<a>".repeat(400_000)] {
        let stated = noted(notes, &OpenOptions::default()).remarks().join(" ");
        assert!(stated.contains("x.asc.aux.xml beside it"), "{stated}");
    }
}
