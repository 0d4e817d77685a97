//! The hand never waits for a server.

use std::cell::Cell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{Event, Native, Session, Timeouts, Transport};
use hapterra::terrain::{Scale, Terrain, TileBuffer};
use hapterra_core::Vec3;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::Source;
use hapterra_core::terrain::TileKey;
use hapterra_tests::timeouts::{pass, wait_for, wait_until};
use hapterra_url_tests::cog::{cog, in_tiles};
use hapterra_url_tests::has_gdal;
use hapterra_url_tests::http::{Fault, Server};
use heightfield::{OpenOptions, Raster, Wait};

fn height(column: u32, row: u32) -> f32 {
    (column % 100) as f32 + 0.5 * (row % 64) as f32
}

fn hills() -> (tempfile::TempDir, Raster, Server) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("hills.tif");
    std::fs::write(&path, cog(2200, 1800, 3, height)).expect("written");
    let server = Server::of(folder.path());
    let raster = Raster::open(server.url("hills.tif"), &OpenOptions::default());
    (folder, raster.expect("opens"), server)
}

fn terrain(raster: &Raster) -> Terrain<'_> {
    let scale = Scale::new(1.0, 0.05).expect("a scale");
    let terrain = Terrain::new(raster, scale, 0).expect("a terrain");
    terrain.non_blocking()
}

const KEY: TileKey = TileKey::new(0, 20, 20);

/// Returns the bytes of the tile if all of it has arrived.
fn tile(terrain: &Terrain<'_>) -> Option<String> {
    let mut buffer = TileBuffer::default();
    let (heights, status) = terrain.tile(KEY, &mut buffer).expect("there is one");
    status.is_complete().then(|| format!("{heights:?}"))
}

fn wait_for_height(terrain: &Terrain<'_>) -> String {
    wait_for("the tile", || tile(terrain))
}

#[test]
fn unloaded_tile_is_fetched_without_blocking() {
    let (_folder, raster, server) = hills();
    let terrain = terrain(&raster);
    // A wait would never end.
    server.hold(true);
    for _ in 0..5 {
        assert_eq!(tile(&terrain), None);
    }
    server.hold(false);
    let from_server = wait_for_height(&terrain);
    let at = |column: u32, row: u32| f64::from(height(column, 1799 - row));
    assert_eq!(raster.height(640, 640), at(640, 640));
    assert_eq!(tile(&terrain), Some(from_server));
}

#[test]
fn server_outage_is_retried_and_is_not_no_data() {
    let (_folder, raster, server) = hills();
    let terrain = terrain(&raster);
    server.fail(Fault::Error500, usize::MAX);
    for _ in 0..100 {
        assert_eq!(tile(&terrain), None);
        pass(Duration::from_millis(10));
    }
    server.fail(Fault::None, 0);
    wait_for_height(&terrain);
    assert!(raster.check_complete().is_ok(), "the outage is over");
}

/// A block of many chunks in several places of the file.
#[test]
fn all_chunks_of_a_block_are_requested_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = in_tiles(64, [2048, 1024], 3, height);
    std::fs::write(folder.path().join("hills.tif"), bytes).expect("written");
    let server = Server::of(folder.path());
    let raster = Raster::open(server.url("hills.tif"), &OpenOptions::default());
    let raster = raster.expect("opens");
    server.hold(true);
    let before = server.log().0.len();
    assert!(raster.read_height(1500, 500, Wait::Never).0.is_nan());
    wait_until("requests for four rows of chunks", || {
        server.log().0.len() >= before + 4
    });
}

/// The possible names of a world file, for a picture without a georeference.
#[test]
fn world_file_names_are_requested_in_parallel() {
    let folder = tempfile::tempdir().expect("a folder");
    let (side, first) = (40_u32, 8 + 2 + 12 * 9 + 4);
    let mut bytes = [
        b"II*\0".as_slice(),
        &8_u32.to_le_bytes(),
        &9_u16.to_le_bytes(),
    ]
    .concat();
    let bits = 8;
    for (tag, value) in [
        (256, side),
        (257, side),
        (258, bits),
        (259, 1),
        (262, 1),
        (273, first),
        (277, 1),
        (278, side),
        (279, side * side),
    ] {
        bytes.extend([u16::to_le_bytes(tag), 4_u16.to_le_bytes()].concat());
        bytes.extend([1_u32.to_le_bytes(), value.to_le_bytes()].concat());
    }
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend((0..side * side).map(|sample| (sample % 200) as u8));
    std::fs::write(folder.path().join("plain.tif"), bytes).expect("written");
    let server = Server::of(folder.path());
    server.hold_at(&["tfw", "tifw", "tiffw", "tfwx", "wld"]);
    let url = server.url("plain.tif");
    std::thread::scope(|scope| {
        let open = scope.spawn(|| Raster::open(url, &OpenOptions::default()));
        wait_until("six requests at once", || server.max_concurrent() >= 6);
        server.hold(false);
        open.join().expect("no panic").expect("opens");
    });
    let (requests, _) = server.log();
    assert!(requests.iter().any(|line| line.contains("plain.tfw")));
}

#[test]
fn unloaded_vrt_source_is_incomplete_and_not_no_data() {
    if !has_gdal() {
        return;
    }
    let (folder, _, server) = hills();
    // More than are opened at the start.
    const SOURCES: u32 = 40;
    let source = |number: u32| {
        format!(
            r#"<SimpleSource><SourceFilename>{}?number={number}</SourceFilename>
            <SourceBand>1</SourceBand><SourceProperties RasterXSize="2200" RasterYSize="1800"/>
            <SrcRect xOff="0" yOff="0" xSize="2200" ySize="1800"/>
            <DstRect xOff="{}" yOff="0" xSize="2200" ySize="1800"/></SimpleSource>"#,
            server.url("hills.tif"),
            2200 * number
        )
    };
    let sources: String = (0..SOURCES).map(source).collect();
    let vrt = format!(
        r#"<VRTDataset rasterXSize="{}" rasterYSize="1800">
        <GeoTransform>500000,30,0,4000000,0,-30</GeoTransform>
        <VRTRasterBand dataType="Float32" band="1">{sources}</VRTRasterBand></VRTDataset>"#,
        2200 * SOURCES
    );
    std::fs::write(folder.path().join("hills.vrt"), vrt).expect("written");
    let raster = Raster::open(server.url("hills.vrt"), &OpenOptions::default());
    let raster = raster.expect("opens");
    server.hold(true);
    // A point in each that was not read before: some files are open, and some are not.
    let places = (0..SOURCES).map(|number| (2200 * number + 20, 20));
    let places: Vec<(u32, u32)> = places.collect();
    for (column, row) in &places {
        let (height, status) = raster.read_height(*column, *row, Wait::Never);
        assert!(height.is_nan() && !status.is_complete(), "no hole");
    }
    server.hold(false);
    for (column, row) in places {
        let read = || raster.read_height(column, row, Wait::Never);
        wait_until("the height", || !read().0.is_nan());
        let expected = f64::from(height(column % 2200, 1799 - row));
        assert_eq!(raster.height(column, row), expected);
    }
}

/// A line to a device that may send nothing. The host's time is stopped.
struct Line<'d> {
    device: &'d mut Native,
    is_mute: Rc<Cell<bool>>,
}

impl Transport for Line<'_> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.device.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        match self.is_mute.get() {
            true => Ok(0),
            false => self.device.receive(into, wait),
        }
    }

    fn now(&self) -> Duration {
        Duration::ZERO
    }
}

#[test]
fn device_receives_tiles_only_after_they_are_loaded() {
    let (_folder, raster, server) = hills();
    let terrain = terrain(&raster);
    let home = GridPoint::new([640, 640, 100], Vec3::ZERO);
    let scene = terrain.scene(SurfaceParams::PREMIUM, Source::Points, home);
    let mut device = Native::for_replay().free_running();
    let is_mute = Rc::default();
    let line = Line {
        device: &mut device,
        is_mute: Rc::clone(&is_mute),
    };
    server.hold(true);
    let (mut session, _) =
        Session::open(&terrain, scene, None, Box::new(line), Timeouts::REAL_TIME)
            .expect("it does not wait for the server, either");
    let mut sent = 0;
    let mut read_all = |session: &mut Session<'_>| {
        let mut on = |event: Event<'_>| sent += usize::from(matches!(event, Event::TileSent(_)));
        session
            .poll(Duration::from_millis(5), &mut on)
            .expect("it answers");
        sent
    };
    for _ in 0..100 {
        assert_eq!(read_all(&mut session), 0, "unloaded data is not sent");
    }
    // Requested tiles are sent without another request.
    is_mute.set(true);
    server.hold(false);
    wait_until("a loaded tile", || read_all(&mut session) > 0);
    is_mute.set(false);
    wait_until("more tiles", || read_all(&mut session) > 3);
    session.close(&mut |_| {}).expect("confirmed");
}
