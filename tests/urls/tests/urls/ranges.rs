//! Only the requested parts of a file at a URL are fetched; they equal those of the file on disk.

use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use hapterra::terrain::{Scale, Terrain, TileBuffer};
use hapterra_core::terrain::TileKey;
use hapterra_tests::shared;
use hapterra_tests::tiffs::{DATA, floats_in_a_strip, placed, tiff};
use hapterra_url_tests::cog::cog;
use hapterra_url_tests::has_gdal;
use hapterra_url_tests::http::{Fault, Server};
use heightfield::{OpenOptions, Raster, RasterError};

fn height(column: u32, row: u32) -> f32 {
    (column * 7 % 1000) as f32 + 0.25 * (row % 400) as f32
}

fn open(path: impl AsRef<Path>) -> Raster {
    Raster::open(path, &OpenOptions::default()).expect("opens")
}

fn in_blocks(path: &Path) -> Raster {
    let options = OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    Raster::open(path, &options).expect("opens")
}

/// Creates a folder with a file of these bytes, and a server for it.
fn served(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf, Server) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    let server = Server::of(folder.path());
    (folder, path, server)
}

fn same_tiles(one: &Raster, other: &Raster, level: u8) {
    let scale = Scale::new(1.0, 0.01).expect("a scale");
    let [one, other] = [one, other].map(|raster| Terrain::new(raster, scale, level));
    let (one, other) = (one.expect("a terrain"), other.expect("a terrain"));
    assert_eq!(one.fingerprint(), other.fingerprint());
    let mut buffers = [TileBuffer::default(), TileBuffer::default()];
    let [a, b] = &mut buffers;
    for (column, row) in [(0, 0), (3, 1), (1, 2)] {
        let key = TileKey::new(level, column, row);
        assert_eq!(one.tile(key, a), other.tile(key, b), "{key:?}");
    }
}

#[test]
fn remote_cog_matches_local_file_and_opens_with_few_bytes() {
    let bytes = cog(3000, 2000, 3, height);
    let (_folder, path, server) = served("hills.tif", &bytes);
    let (here, remote) = (in_blocks(&path), open(server.url("hills.tif")));
    let (requests, fetched) = server.log();
    assert!(requests.len() <= 8, "{requests:?}");
    assert!(fetched < bytes.len() / 8, "{fetched} of {}", bytes.len());
    assert_eq!(here.format(), remote.format());
    assert_eq!(here.reference_system(), remote.reference_system());
    for level in 0..4 {
        same_tiles(&here, &remote, level);
    }
    for (column, row) in [(0, 0), (2999, 1999), (1500, 3), (255, 256), (256, 255)] {
        assert_eq!(remote.height(column, row), here.height(column, row));
        assert_eq!(
            remote.height(column, row),
            f64::from(height(column, 1999 - row))
        );
    }
    let (before, _) = server.log();
    assert_eq!(remote.height(1500, 3), here.height(1500, 3));
    assert_eq!(server.log().0, before, "stored data is not fetched again");
}

#[test]
fn neighbours_of_a_remote_file_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
    let heights: Vec<u8> = (0..600 * 500_u32)
        .flat_map(|index| height(index % 600, index / 600).to_le_bytes())
        .collect();
    let header = "ncols 600\nnrows 500\nxllcorner 500000\nyllcorner 4000000\ncellsize 30\nbyteorder LSBFIRST\n";
    let system = r#"PROJCS["WGS 84 / UTM zone 11N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],PARAMETER["central_meridian",-117],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],PARAMETER["false_northing",0],UNIT["metre",1]]"#;
    write("hills.flt", &heights).expect("written");
    write("hills.hdr", header.as_bytes()).expect("written");
    write("hills.prj", system.as_bytes()).expect("written");
    let server = Server::of(folder.path());
    let here = open(folder.path().join("hills.flt"));
    // A key after the path is sent with all of them.
    let remote = open(server.url("hills.flt?key=a/b.c"));
    assert_eq!(remote.format(), here.format());
    assert!(remote.reference_system().is_some());
    assert_eq!(remote.reference_system(), here.reference_system());
    assert_eq!(remote.height(599, 0), f64::from(height(599, 499)));
    let (requests, _) = server.log();
    assert!(
        requests.iter().all(|line| line.ends_with("?key=a/b.c")),
        "{requests:?}"
    );
}

#[test]
fn plain_samples_are_fetched_only_around_reads() {
    const SIZE: [u32; 2] = [5000, 3000];
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
    let heights: Vec<u8> = (0..SIZE[0] * SIZE[1])
        .flat_map(|index| height(index % SIZE[0], index / SIZE[0]).to_le_bytes())
        .collect();
    let header = "ncols 5000\nnrows 3000\nxllcorner 500000\nyllcorner 4000000\ncellsize 30\nbyteorder LSBFIRST\n";
    write("hills.flt", &heights).expect("written");
    write("hills.hdr", header.as_bytes()).expect("written");
    let server = Server::of(folder.path());
    let (here, remote) = (
        in_blocks(&folder.path().join("hills.flt")),
        open(server.url("hills.flt")),
    );
    for (column, row) in [(0, 0), (4999, 2999), (2500, 777)] {
        let expected = f64::from(height(column, SIZE[1] - 1 - row));
        assert_eq!(here.height(column, row), expected);
        assert_eq!(remote.height(column, row), expected);
    }
    let (_, fetched) = server.log();
    assert!(
        fetched < heights.len() / 4,
        "{fetched} of {}",
        heights.len()
    );
    for level in [0, 3] {
        same_tiles(&here, &remote, level);
    }
}

#[test]
fn single_strip_is_fetched_only_around_rows_read() {
    const SIZE: [u32; 2] = [5000, 3000];
    let heights: Vec<u8> = (0..SIZE[0] * SIZE[1])
        .flat_map(|index| height(index % SIZE[0], index / SIZE[0]).to_le_bytes())
        .collect();
    let mut image = floats_in_a_strip(SIZE, DATA);
    image.extend(placed([500_000.0, 4_000_000.0], 30.0, 32611));
    let bytes = tiff(&heights, &[image]);
    let (_folder, path, server) = served("strip.tif", &bytes);
    let (here, remote) = (in_blocks(&path), open(server.url("strip.tif")));
    for (column, row) in [(0, 0), (4999, 2999), (2500, 777)] {
        let expected = f64::from(height(column, SIZE[1] - 1 - row));
        assert_eq!(here.height(column, row), expected);
        assert_eq!(remote.height(column, row), expected);
    }
    let (_, fetched) = server.log();
    assert!(fetched < bytes.len() / 4, "{fetched} of {}", bytes.len());
    for level in [0, 3] {
        same_tiles(&here, &remote, level);
    }
}

#[test]
fn vrt_and_its_files_may_be_remote() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
    let server = Server::of(folder.path());
    for (name, first) in [("west.tif", 0), ("east.tif", 800)] {
        let tile = cog(800, 600, 1, |column, row| height(first + column, row));
        write(name, &tile).expect("written");
    }
    let source = |name: &str, is_beside: u8, first: u32| {
        format!(
            r#"<SimpleSource><SourceFilename relativeToVRT="{is_beside}">{name}</SourceFilename>
            <SourceBand>1</SourceBand><SourceProperties RasterXSize="800" RasterYSize="600"/>
            <SrcRect xOff="0" yOff="0" xSize="800" ySize="600"/>
            <DstRect xOff="{first}" yOff="0" xSize="800" ySize="600"/></SimpleSource>"#
        )
    };
    let vrt = |west: &str, is_beside: u8| {
        let east = format!("/vsicurl/{}", server.url("east.tif"));
        format!(
            r#"<VRTDataset rasterXSize="1600" rasterYSize="600">
            <GeoTransform>500000,30,0,4000000,0,-30</GeoTransform>
            <VRTRasterBand dataType="Float32" band="1">{}{}</VRTRasterBand></VRTDataset>"#,
            source(west, is_beside, 0),
            source(&east, 0, 800)
        )
    };
    write("there.vrt", vrt("west.tif", 1).as_bytes()).expect("written");
    let raster = open(server.url("there.vrt"));
    for (column, row) in [(0, 0), (799, 599), (800, 3), (1599, 300)] {
        let expected = f64::from(height(column, 599 - row));
        assert_eq!(raster.height(column, row), expected, "{column} {row}");
    }
    // A file on disk that refers to a server is another matter.
    let here = folder.path().join("here.vrt");
    std::fs::write(&here, vrt(&server.url("west.tif"), 0)).expect("written");
    let refused = Raster::open(&here, &OpenOptions::default()).expect_err("an address");
    let refused = refused.to_string();
    assert!(
        refused.contains(&server.url("")) && refused.contains("open its URL"),
        "{refused}"
    );
}

#[test]
fn server_without_ranges_sends_the_whole_file() {
    let bytes = cog(700, 500, 1, height);
    let (_folder, path, server) = served("hills.tif", &bytes);
    server.fail(Fault::NoRanges, usize::MAX);
    let (here, remote) = (in_blocks(&path), open(server.url("hills.tif")));
    same_tiles(&here, &remote, 0);
}

/// All formats, also packed or with a sidecar.
#[test]
fn real_files_are_the_same_from_a_server() {
    let Some(folder) = shared("dem/real") else {
        return;
    };
    let compared = same_from_a_server(&folder);
    assert!(compared > 10, "{compared} files");
}

#[test]
fn files_that_gdal_reads_are_the_same_from_a_server() {
    if !has_gdal() {
        return;
    }
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data");
    for (name, files) in [("by_gdal", 9), ("netcdf", 9), ("only_gdal", 4)] {
        let compared = same_from_a_server(&data.join(name));
        assert!(compared >= files, "{compared} files of {name}");
    }
}

#[test]
fn archives_are_the_same_from_a_server() {
    if !has_gdal() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
    let heights = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n4 5 6\n";
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(heights.as_bytes()).expect("packed");
    write("hills.asc.gz", &gzip.finish().expect("packed")).expect("written");
    write("hills.tar", &tar("hills.asc", heights.as_bytes())).expect("written");
    assert_eq!(same_from_a_server(folder.path()), 2);
    let server = Server::of(folder.path());
    assert_eq!(open(server.url("hills.tar")).height(2, 1), 3.0);
}

#[test]
fn remote_files_reference_no_local_file() {
    if !has_gdal() {
        return;
    }
    let local = tempfile::tempdir().expect("a folder");
    let secret = local.path().join("secret.asc");
    let heights = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\n1 2 3\n4 5 6\n";
    std::fs::write(&secret, heights).expect("written");
    let secret = secret.display();
    let mrf = format!(
        "<MRF_META><Raster><Size x='3' y='2' c='1'/><PageSize x='3' y='2' c='1'/>\
         <Compression>NONE</Compression><DataType>Byte</DataType>\
         <DataFile>{secret}</DataFile></Raster></MRF_META>"
    );
    let vrt = format!(
        "<VRTDataset rasterXSize='3' rasterYSize='2'><VRTRasterBand dataType='Float32' band='1'>\
         <SimpleSource><SourceFilename relativeToVRT='0'>{secret}</SourceFilename></SimpleSource>\
         </VRTRasterBand></VRTDataset>"
    );
    for (name, bytes) in [
        ("there.mrf", mrf.clone().into_bytes()),
        ("there.vrt", vrt.clone().into_bytes()),
        ("mrf.tar", tar("in.mrf", mrf.as_bytes())),
        ("vrt.tar", tar("in.vrt", vrt.as_bytes())),
    ] {
        let (_folder, _, server) = served(name, &bytes);
        let reported = Raster::open(server.url(name), &OpenOptions::default());
        let reported = reported.expect_err(name).to_string();
        let words = "on this computer";
        assert!(
            reported.contains(words) || reported.contains("beside it"),
            "{name}: {reported}"
        );
    }
}

/// Returns a tar file of one file.
fn tar(name: &str, bytes: &[u8]) -> Vec<u8> {
    let mut header = [0_u8; 512];
    let size = format!("{:011o}", bytes.len());
    for (at, text) in [
        (0, name),
        (100, "0000644"),
        (108, "0000000"),
        (116, "0000000"),
        (124, &size),
        (136, "00000000000"),
        (148, "        "),
        (156, "0"),
        (257, "ustar"),
        (263, "00"),
    ] {
        header[at..][..text.len()].copy_from_slice(text.as_bytes());
    }
    let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
    header[148..155].copy_from_slice(format!("{sum:06o}\0").as_bytes());
    let mut tar = [&header[..], bytes].concat();
    tar.resize(tar.len().next_multiple_of(512) + 1024, 0);
    tar
}

#[test]
fn remote_stac_is_refused_with_its_list_of_files() {
    if !has_gdal() {
        return;
    }
    let item = |id: &str, href: &str| {
        format!(r#"{{"id":"{id}","assets":{{"data":{{"href":"{href}","type":"image/tiff"}}}}}}"#)
    };
    let items = [item("a", "./west.tif"), item("b", "https://other/east.tif")].join(",");
    let stac = format!(r#"{{"type":"FeatureCollection","features":[{items}]}}"#);
    let (_folder, _, server) = served("items.json", stac.as_bytes());
    let refused = Raster::open(server.url("items.json?key=a"), &OpenOptions::default());
    let error = refused.expect_err("a STAC");
    let RasterError::NeedsVrt { files, .. } = error.fault() else {
        panic!("{error}");
    };
    let west = format!("/vsicurl/{}", server.url("west.tif"));
    assert_eq!(*files, [&west, "/vsicurl/https://other/east.tif"]);
}

/// Compares the files of a folder with the same files from a server. Returns the number opened.
fn same_from_a_server(folder: &Path) -> u32 {
    let server = Server::of(folder);
    let mut compared = 0;
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let entry = entry.expect("an entry");
        let size = entry.metadata().expect("its size").len();
        if size > 16 << 20 || !entry.path().is_file() {
            continue;
        }
        let name = entry.file_name().to_string_lossy().replace(' ', "%20");
        let here = Raster::open(entry.path(), &OpenOptions::default());
        let remote = Raster::open(server.url(&name), &OpenOptions::default());
        let (here, remote) = match (here, remote) {
            (Ok(here), Ok(remote)) => (here, remote),
            (Err(here), Err(remote)) => {
                let [here, remote] = [here, remote].map(|error| error.fault().to_string());
                assert_eq!(here, remote, "{name}");
                continue;
            }
            (here, remote) => panic!("{name}: {:?}, and there {:?}", here.err(), remote.err()),
        };
        assert_eq!(here.format(), remote.format(), "{name}");
        assert_eq!(here.cell(), remote.cell(), "{name}");
        assert_eq!(here.reference_system(), remote.reference_system(), "{name}");
        let (columns, rows) = (here.columns(), here.rows());
        assert_eq!((columns, rows), (remote.columns(), remote.rows()), "{name}");
        for step in 0..200 {
            let (column, row) = (step * 7919 % columns, step * 104_729 % rows);
            let [here, remote] = [&here, &remote].map(|raster| raster.height(column, row));
            assert_eq!(here.to_bits(), remote.to_bits(), "{name} {column} {row}");
        }
        compared += 1;
    }
    compared
}
