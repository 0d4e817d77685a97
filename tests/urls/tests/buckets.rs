//! A file in a bucket of a server that speaks S3.

use std::process::{Command, Output};

use hapterra::raster::{OpenOptions, Raster};
use hapterra_url_tests::cog::cog;
use hapterra_url_tests::s3::{KEY, Server};

/// Names the file that the second process opens.
const VARIABLE: &str = "HAPTERRA_TEST_BUCKET";

fn height(column: u32, row: u32) -> f32 {
    (column + 1000 * (row % 10)) as f32
}

/// Opens the file with keys in the environment, which another process has of its own.
fn opened(endpoint: &str, url: &str, key: &str) -> Output {
    Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "in_another_process", "--nocapture"])
        .env(VARIABLE, url)
        .env("AWS_ENDPOINT_URL", endpoint)
        .env("AWS_ALLOW_HTTP", "true")
        .env("AWS_ACCESS_KEY_ID", KEY[0])
        .env("AWS_SECRET_ACCESS_KEY", key)
        .output()
        .expect("it runs")
}

/// The other half of the tests below.
#[test]
fn in_another_process() {
    let Ok(url) = std::env::var(VARIABLE) else {
        return;
    };
    let raster = Raster::open(&url, &OpenOptions::default());
    let raster = raster.unwrap_or_else(|error| panic!("told: {error}"));
    for (column, row) in [(0, 0), (1500, 900), (1999, 1199)] {
        let expected = f64::from(height(column, 1199 - row));
        assert_eq!(raster.height(column, row), expected);
    }
    println!("felt {}", raster.format());
}

#[test]
fn a_file_in_a_bucket_opens_with_its_key_and_with_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let bucket = folder.path().join("hills");
    std::fs::create_dir(&bucket).expect("a bucket");
    std::fs::write(bucket.join("north.tif"), cog(2000, 1200, 2, height)).expect("written");
    let server = Server::of(folder.path());
    let said = |url: &str, key: &str| {
        let output = opened(server.endpoint(), url, key);
        let words = [output.stdout, output.stderr].concat();
        String::from_utf8_lossy(&words).into_owned()
    };
    let felt = said("s3://hills/north.tif", KEY[1]);
    assert!(felt.contains("felt GeoTIFF"), "{felt}");
    let missing = said("s3://hills/south.tif", KEY[1]);
    assert!(missing.contains("there is no such file"), "{missing}");
    let forbidden = said("s3://hills/north.tif", "sand");
    assert!(forbidden.contains("without a key"), "{forbidden}");
}
