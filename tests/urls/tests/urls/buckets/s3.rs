//! `s3://`

use hapterra_url_tests::s3::{KEY, Server};

use crate::buckets::opened::{NAME, hills, output_of};

fn output_with(server: &Server, url: &str, key: [&str; 2]) -> String {
    let environment = [
        ("AWS_ENDPOINT_URL", server.endpoint()),
        ("AWS_ALLOW_HTTP", "true"),
        ("AWS_ACCESS_KEY_ID", key[0]),
        ("AWS_SECRET_ACCESS_KEY", key[1]),
    ];
    output_of(url, &environment)
}

#[test]
fn bucket_file_opens_only_with_its_key() {
    let hills = hills(&["hills"]);
    let server = Server::of(hills.folder.path());
    let url = format!("s3://hills/{NAME}");
    let output = output_with(&server, &url, KEY);
    assert!(output.contains("read GeoTIFF"), "{output}");
    let missing = output_with(&server, "s3://hills/south.tif", KEY);
    assert!(missing.contains("there is no such file"), "{missing}");
    let forbidden = output_with(&server, &url, [KEY[0], "sand"]);
    assert!(forbidden.contains("requires a key"), "{forbidden}");
}
