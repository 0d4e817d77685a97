//! Faults of a server or the connection to it: they are reported, and no wrong terrain is rendered.

use hapterra::place::{Coordinates, PlaceError, Placement, PlacementOptions, Reach, Target};
use hapterra::terrain::{HapticCells, HapticGrid};
use hapterra_core::phantom::Calibration;
use hapterra_tests::timeouts::wait_for;
use hapterra_url_tests::cog::cog;
use hapterra_url_tests::has_gdal;
use hapterra_url_tests::http::{Fault, Server};
use heightfield::{OpenOptions, Raster, RasterError, Wait};

const SIZE: [u32; 2] = [2500, 2100];

fn height(column: u32, row: u32) -> f32 {
    (3 * column + 10_000 * (row % 100)) as f32
}

fn hills() -> (tempfile::TempDir, Server) {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = cog(SIZE[0], SIZE[1], 3, height);
    std::fs::write(folder.path().join("hills.tif"), bytes).expect("written");
    let server = Server::of(folder.path());
    (folder, server)
}

fn open(server: &Server, name: &str) -> Result<Raster, String> {
    let opened = Raster::open(server.url(name), &OpenOptions::default());
    opened.map_err(|error| match error.fault() {
        RasterError::Remote(_) => error.to_string(),
        other => panic!("{other:?}"),
    })
}

fn expected(column: u32, row: u32) -> f64 {
    f64::from(height(column, SIZE[1] - 1 - row))
}

#[test]
fn temporary_server_errors_are_retried() {
    for fault in [Fault::Error500, Fault::Cut] {
        let (_folder, server) = hills();
        server.fail(fault, 2);
        let raster = open(&server, "hills.tif").expect("in the end");
        server.fail(fault, 2);
        assert_eq!(raster.height(1200, 700), expected(1200, 700), "{fault:?}");
    }
}

#[test]
fn permanent_server_error_names_file_and_reason() {
    let (_folder, server) = hills();
    let reported = open(&server, "valleys.tif").expect_err("none");
    assert!(reported.contains("there is no such file"), "{reported}");
    assert!(reported.contains("valleys.tif"), "{reported}");
    server.fail(Fault::Forbidden, 1);
    let reported = open(&server, "hills.tif").expect_err("forbidden");
    assert!(reported.contains("requires a key"), "{reported}");
    server.fail(Fault::Error500, usize::MAX);
    let reported = open(&server, "hills.tif").expect_err("broken");
    assert!(reported.contains("500"), "{reported}");
    drop(server);
    let no_server = "http://127.0.0.1:1/hills.tif";
    let error = Raster::open(no_server, &OpenOptions::default()).expect_err("no server");
    assert!(matches!(error.fault(), RasterError::Remote(_)), "{error}");
    for (url, why) in [
        ("ftp://h/hills.tif", "ftp://"),
        ("https://h h/hills.tif", "cannot read the URL's content"),
        ("s3://", "no such file"),
    ] {
        let error = Raster::open(url, &OpenOptions::default()).expect_err(url);
        assert!(error.to_string().contains(why) || url == "s3://", "{error}");
    }
}

/// Safety: 29.
#[test]
fn long_error_page_is_not_read_to_its_end() {
    let (_folder, server) = hills();
    server.fail(Fault::LongError, usize::MAX);
    let reported = open(&server, "hills.tif").expect_err("none");
    assert!(reported.contains("there is no such file"), "{reported}");
    let (requests, bytes) = server.log();
    // Besides the data in the system's buffers.
    assert!(
        bytes <= requests.len() * (16 << 20),
        "{bytes} bytes arrived"
    );
}

#[test]
fn responses_of_wrong_range_or_length_are_rejected() {
    for fault in [Fault::OtherRange, Fault::Short, Fault::Endless] {
        let (_folder, server) = hills();
        server.fail(fault, usize::MAX);
        let reported = open(&server, "hills.tif").expect_err("from the beginning");
        let why = match fault {
            Fault::Short => "bytes of",
            Fault::Endless => "more than",
            _ => "Requested",
        };
        assert!(reported.contains(why), "{reported}");
        server.fail(Fault::None, 0);
        let raster = open(&server, "hills.tif").expect("a right answer");
        server.fail(fault, usize::MAX);
        let (height, status) = raster.read_height(1200, 700, Wait::UntilRead);
        assert!(height.is_nan() && !status.is_complete(), "{fault:?}");
        server.fail(Fault::None, 0);
        let known = wait_for_height(&raster, 1200, 700);
        assert_eq!(known, expected(1200, 700), "{fault:?}");
    }
}

/// Returns a height as soon as it has arrived.
fn wait_for_height(raster: &Raster, column: u32, row: u32) -> f64 {
    wait_for("the height", || {
        let height = raster.height(column, row);
        (!height.is_nan()).then_some(height)
    })
}

#[test]
fn unreadable_mask_is_an_error_unless_forbidden() {
    let (_folder, server) = hills();
    server.fail_at(".msk", Fault::Error500, usize::MAX);
    let reported = open(&server, "hills.tif").expect_err("the mask is unknown");
    assert!(reported.contains("500"), "{reported}");
    // A server answers "forbidden" about a missing file to a user without list permission.
    server.fail_at(".msk", Fault::Forbidden, usize::MAX);
    open(&server, "hills.tif").expect("no mask");
}

#[test]
fn notes_beside_a_url_are_read_like_those_of_a_file() {
    let (folder, server) = hills();
    let lowest = height(0, 0);
    let notes = format!(
        "<PAMDataset><PAMRasterBand band='1'><NoDataValue>{lowest}</NoDataValue>\
         <Scale>0.5</Scale><UnitType>ft</UnitType></PAMRasterBand></PAMDataset>"
    );
    let beside = folder.path().join("hills.tif.aux.xml");
    std::fs::write(beside, notes).expect("written");
    let here = Raster::open(folder.path().join("hills.tif"), &OpenOptions::default());
    let (here, remote) = (
        here.expect("opens"),
        open(&server, "hills.tif").expect("opens"),
    );
    for raster in [&here, &remote] {
        assert_eq!(raster.no_data(), Some(f64::from(lowest)));
        assert_eq!(raster.scale_and_offset(), (0.5, 0.0));
        assert_eq!(raster.stated_metres_per_vertical_unit(), Some(0.3048));
    }
    let [column, row] = [1200, 700];
    assert_eq!(remote.height(column, row), 0.5 * expected(column, row));
    assert!(remote.height(0, SIZE[1] - 1).is_nan() && here.height(0, SIZE[1] - 1).is_nan());
    let (requests, _) = server.log();
    let sidecar_requests = requests.iter().filter(|line| line.ends_with(".aux.xml"));
    assert_eq!(sidecar_requests.count(), 1, "{requests:?}");
    server.fail_at(".aux.xml", Fault::Error500, usize::MAX);
    let reported = open(&server, "hills.tif").expect_err("no-data is unknown");
    assert!(reported.contains("500"), "{reported}");
}

/// The error is the server's, and not a lack of data.
#[test]
fn placement_reports_server_error_instead_of_no_data() {
    let (_folder, server) = hills();
    let raster = open(&server, "hills.tif").expect("opens");
    let grid = HapticGrid::new(&raster, HapticCells::Stored);
    server.fail(Fault::Error500, usize::MAX);
    for target in [
        Target::At([527_015.0, 3_958_015.0], Coordinates::Own),
        Target::Box(
            [503_015.0, 3_940_015.0, 504_215.0, 3_941_215.0],
            Coordinates::Own,
        ),
    ] {
        let options = PlacementOptions {
            target,
            ..PlacementOptions::default()
        };
        let reach = Reach::of(&Calibration::PREMIUM_1_5);
        let fault = Placement::new(&grid, &reach, &options).expect_err("not read");
        assert!(matches!(fault, PlaceError::Unread { .. }), "{fault}");
        let reported = raster.check_complete().expect_err("it did not arrive");
        assert!(
            matches!(reported.fault(), RasterError::Remote(_)),
            "{reported}"
        );
    }
}

#[test]
fn page_for_every_name_is_no_neighbour() {
    let (_folder, server) = hills();
    let here = open(&server, "hills.tif").expect("opens");
    for neighbour in [".msk", ".ovr"] {
        server.fail_at(neighbour, Fault::Page, usize::MAX);
        let raster = open(&server, "hills.tif").expect("without it");
        assert_eq!(raster.format(), here.format());
        assert_eq!(raster.height(1200, 700), expected(1200, 700));
    }
}

/// A planned path over terrain that does not arrive must fail with a message.
#[test]
fn check_complete_reports_failed_reads_once() {
    let (_folder, server) = hills();
    let raster = open(&server, "hills.tif").expect("opens");
    assert!(raster.check_complete().is_ok());
    server.fail(Fault::Error500, usize::MAX);
    let (requests, _) = server.log();
    for column in (0..SIZE[0]).step_by(100) {
        assert!(raster.height(column, 700).is_nan());
    }
    let later_requests = server.log().0.len() - requests.len();
    assert!(
        later_requests < 40,
        "{later_requests} requests to a server that does not answer"
    );
    let reported = raster.check_complete().expect_err("it did not arrive");
    assert!(
        matches!(reported.fault(), RasterError::Remote(_)),
        "{reported}"
    );
    assert!(raster.check_complete().is_ok(), "and nothing since");
}

#[test]
fn missing_vrt_source_is_no_data_and_other_sources_are_read() {
    if !has_gdal() {
        return;
    }
    let (folder, server) = hills();
    let source = |name: &str, first: u32| {
        format!(
            r#"<SimpleSource><SourceFilename relativeToVRT="1">{name}</SourceFilename>
            <SourceBand>1</SourceBand><SourceProperties RasterXSize="2500" RasterYSize="2100"/>
            <SrcRect xOff="0" yOff="0" xSize="2500" ySize="2100"/>
            <DstRect xOff="{first}" yOff="0" xSize="2500" ySize="2100"/></SimpleSource>"#
        )
    };
    let vrt = format!(
        r#"<VRTDataset rasterXSize="5000" rasterYSize="2100">
        <GeoTransform>500000,30,0,4000000,0,-30</GeoTransform>
        <VRTRasterBand dataType="Float32" band="1">{}{}</VRTRasterBand></VRTDataset>"#,
        source("./hills.tif", 0),
        source("gone/../valleys.tif", 2500)
    );
    std::fs::write(folder.path().join("both.vrt"), vrt).expect("written");
    let url = server.url("both.vrt");
    // A file that is read as a whole is refused if a part is missing.
    let refused = Raster::open(&url, &OpenOptions::default()).expect_err("small");
    assert!(refused.to_string().contains("valleys.tif"), "{refused}");
    let in_blocks = OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    let raster = Raster::open(&url, &in_blocks).expect("one of two");
    assert_eq!(raster.height(1200, 700), expected(1200, 700));
    let (height, status) = raster.read_height(3700, 700, Wait::UntilRead);
    assert!(
        height.is_nan() && status.is_complete(),
        "its absence is certain"
    );
}

#[test]
fn unreadable_overview_is_an_error_instead_of_no_data() {
    let (_folder, server) = hills();
    server.fail_beyond(Fault::Error500);
    let reported = open(&server, "hills.tif").expect_err("its overview is beyond");
    assert!(reported.contains("500"), "{reported}");
}

#[test]
fn changed_file_is_not_mixed_with_cached_blocks() {
    let (_folder, server) = hills();
    let raster = open(&server, "hills.tif").expect("opens");
    assert_eq!(raster.height(100, 2000), expected(100, 2000));
    server.change();
    let (height, status) = raster.read_height(2400, 100, Wait::UntilRead);
    assert!(
        height.is_nan() && !status.is_complete(),
        "unknown, and not no-data"
    );
    assert_eq!(
        raster.height(100, 2000),
        expected(100, 2000),
        "the stored data"
    );
    let again = open(&server, "hills.tif").expect("the file as it is now");
    assert_eq!(again.height(2400, 100), expected(2400, 100));
}

#[test]
fn truncated_file_is_an_error_from_disk_and_from_url() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = cog(SIZE[0], SIZE[1], 3, height);
    std::fs::write(folder.path().join("cut.tif"), &bytes[..900_000]).expect("written");
    std::fs::write(folder.path().join("empty.tif"), b"").expect("written");
    let server = Server::of(folder.path());
    let fault = |path: &str| {
        let opened = Raster::open(path, &OpenOptions::default());
        opened
            .map(|_| ())
            .map_err(|error| error.fault().to_string())
    };
    let here = fault(&folder.path().join("cut.tif").to_string_lossy());
    assert!(here.is_err(), "{here:?}");
    let remote = fault(&server.url("cut.tif"));
    assert!(remote.is_err(), "{remote:?}");
    assert!(fault(&server.url("empty.tif")).is_err());
}
