//! A STAC at a URL: its items name files beside it, and each is fetched when it is touched.

use hapterra_url_tests::cog::cog;
use hapterra_url_tests::http::{Fault, Server};
use heightfield::{OpenOptions, Raster};

/// Samples of a tile each way, and the side of a cell, metres.
const SIDE: u32 = 300;
const CELL: f64 = 30.0;
/// The corner that every tile of `cog` states.
const CORNER: [f64; 2] = [500_000.0, 4_000_000.0];

fn height(column: u32, row: u32) -> f32 {
    (column * 7 % 1000) as f32 + 0.25 * (row % 400) as f32
}

/// An item that says where its file lies, so that nobody has to look into it.
fn item(id: &str, href: &str) -> String {
    let [x, y] = CORNER;
    format!(
        r#"{{"type":"Feature","stac_version":"1.0.0","id":"{id}","geometry":null,
        "properties":{{"datetime":"2021-04-22T00:00:00Z","proj:code":"EPSG:32611",
        "proj:shape":[{SIDE},{SIDE}],"proj:transform":[{CELL},0,{x},0,-{CELL},{y}]}},"links":[],
        "assets":{{"data":{{"href":"{href}","roles":["data"],"type":"image/tiff; application=geotiff"}}}}}}"#
    )
}

#[test]
fn an_item_collection_and_a_catalog_lead_to_files_at_their_server() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, bytes).expect("written");
    };
    write("tiles/hills.tif", &cog(SIDE, SIDE, 1, height));
    let server = Server::of(folder.path());
    let beside = item("hills", "./tiles/hills.tif");
    let absolute = item("hills", &server.url("tiles/hills.tif"));
    let collection = |item: &str| format!(r#"{{"type":"FeatureCollection","features":[{item}]}}"#);
    write("items.json", collection(&beside).as_bytes());
    write("absolute.json", collection(&absolute).as_bytes());
    write(
        "deep/item.json",
        item("hills", "../tiles/hills.tif").as_bytes(),
    );
    let catalog = r#"{"type":"Catalog","stac_version":"1.0.0","id":"c","description":"d",
        "links":[{"rel":"item","href":"./deep/item.json"}]}"#;
    write("catalog.json", catalog.as_bytes());
    let on_disk = folder.path().join("absolute.json");
    let named = [
        "items.json",
        "absolute.json",
        "deep/item.json",
        "catalog.json",
    ];
    let sources = named.map(|name| server.url(name).into());
    for source in sources.into_iter().chain([on_disk]) {
        let raster = Raster::open(&source, &OpenOptions::default());
        let raster = raster.unwrap_or_else(|error| panic!("{}: {error}", source.display()));
        assert_eq!((raster.columns(), raster.rows()), (SIDE, SIDE));
        for (column, row) in [(0, 0), (299, 299), (17, 203)] {
            let expected = f64::from(height(column, SIDE - 1 - row));
            assert_eq!(raster.height(column, row), expected, "{}", source.display());
        }
    }
}

#[test]
fn a_file_that_an_item_names_and_nobody_has_is_an_error_or_a_hole_with_a_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = Server::of(folder.path());
    let items = format!(
        r#"{{"type":"FeatureCollection","features":[{}]}}"#,
        item("hills", "./nowhere.tif")
    );
    std::fs::write(folder.path().join("items.json"), items).expect("written");
    let error = Raster::open(server.url("items.json"), &OpenOptions::default());
    let error = error.expect_err("there is nothing to feel").to_string();
    assert!(error.contains("nowhere.tif"), "{error}");
}

#[test]
fn a_catalog_that_does_not_come_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("catalog.json"), "{}").expect("written");
    let server = Server::of(folder.path());
    server.fail(Fault::Forbidden, usize::MAX);
    let error = Raster::open(server.url("catalog.json"), &OpenOptions::default());
    let error = error.expect_err("nobody may read it").to_string();
    assert!(
        error.contains("without a key") && error.contains("catalog.json"),
        "{error}"
    );
}
