//! Redirects of a server: followed if they reveal nothing, refused with the host's name if they
//! would pass on a key.

use hapterra_url_tests::cog::cog;
use hapterra_url_tests::http::Server;
use heightfield::{OpenOptions, Raster};

/// Starts two servers: the first has no files and redirects to the second.
fn servers(name: &str) -> (tempfile::TempDir, [Server; 2]) {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = cog(300, 200, 1, |column, row| (column + row) as f32);
    std::fs::write(folder.path().join("hills.tif"), bytes).expect("written");
    let servers = [Server::of(folder.path()), Server::of(folder.path())];
    servers[0].redirect(&servers[1].url(name));
    (folder, servers)
}

fn open(url: &str) -> Result<Raster, String> {
    Raster::open(url, &OpenOptions::default()).map_err(|error| error.to_string())
}

#[test]
fn redirect_without_key_is_followed_without_referer() {
    let (_folder, [first, second]) = servers("hills.tif");
    let raster = open(&first.url("moved.tif")).expect("redirected");
    assert_eq!(raster.height(7, 199), 7.0);
    let headers = second.headers();
    assert!(headers.contains("range"), "{headers:?}");
    assert!(!headers.contains("referer"), "{headers:?}");
}

#[test]
fn redirect_with_key_to_another_host_is_refused() {
    let (_folder, [first, second]) = servers("hills.tif");
    let why = open(&first.url("moved.tif?sig=SECRET")).expect_err("refused");
    assert!(why.contains("redirects to 127.0.0.1"), "{why}");
    assert!(!why.contains("SECRET"), "{why}");
    assert_eq!(second.log().0.len(), 0, "{:?}", second.log().0);
}

#[test]
fn redirect_with_key_within_the_host_is_followed() {
    let (_folder, [first, _second]) = servers("hills.tif");
    first.redirect("/loop.tif?sig=SECRET");
    let why = open(&first.url("moved.tif?sig=SECRET")).expect_err("a loop");
    assert!(why.contains("again and again"), "{why}");
    assert_eq!(first.log().0.len(), 11);
}

#[test]
fn redirect_to_no_web_server_is_refused() {
    let (_folder, [first, _second]) = servers("hills.tif");
    first.redirect("file:///etc/passwd");
    let why = open(&first.url("moved.tif")).expect_err("refused");
    assert!(why.contains("no URL of a web server"), "{why}");
}
