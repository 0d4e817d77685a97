//! `gs://`

use hapterra_url_tests::bucket::{PUBLIC, Server};
use hapterra_url_tests::gcs::{SURVEYOR, TOKEN, UNPRIVILEGED, served};

use crate::buckets::opened::{
    Hills, NAME, assert_fetched_in_parts, assert_refused, hills, mosaic, output_of,
};

/// The user's hint.
const HINT: &str = "hint: set the server's variables: GOOGLE_APPLICATION_CREDENTIALS";

/// A server of buckets, and a file for a key.
struct Google {
    hills: Hills,
    server: Server,
    key: String,
}

impl Google {
    fn start() -> Self {
        let hills = hills(&["hills", PUBLIC]);
        let server = served(hills.folder.path());
        let key = hills.folder.path().join("key.json").display().to_string();
        std::fs::write(&key, SURVEYOR.file()).expect("written");
        Self { hills, server, key }
    }

    fn output_of(&self, name: &str, environment: &[(&str, &str)]) -> String {
        let server = [("GOOGLE_BASE_URL", self.server.endpoint())];
        output_of(name, &[&server, environment].concat())
    }

    fn output_with_key(&self, name: &str, key: &str) -> String {
        std::fs::write(&self.key, key).expect("written");
        self.output_of(name, &[("GOOGLE_APPLICATION_CREDENTIALS", &self.key)])
    }
}

fn url() -> String {
    format!("gs://hills/{NAME}")
}

#[test]
fn service_account_key_opens_a_file_fetched_in_parts() {
    let google = Google::start();
    let output = google.output_with_key(&url(), &SURVEYOR.file());
    assert!(output.contains("read GeoTIFF"), "{output}");
    assert_fetched_in_parts(&google.server.take_log(), google.hills.bytes);
}

/// A token from `gcloud auth print-access-token`, or from the metadata server of Google's cloud.
#[test]
fn file_opens_with_a_token() {
    let google = Google::start();
    let address = google.server.endpoint().trim_start_matches("http://");
    for given in [
        ("GOOGLE_BEARER_TOKEN", TOKEN),
        ("GCE_METADATA_HOST", address),
    ] {
        let output = google.output_of(&url(), &[given]);
        assert!(output.contains("read GeoTIFF"), "{given:?}: {output}");
    }
    let other = google.output_of(&url(), &[("GOOGLE_BEARER_TOKEN", "ya29.other")]);
    assert_refused(&other, "AuthenticationRequired", HINT);
}

#[test]
fn unsigned_access_opens_only_public_buckets() {
    let google = Google::start();
    let anonymous = [("GOOGLE_SKIP_SIGNATURE", "true")];
    let output = google.output_of(&format!("gs://{PUBLIC}/{NAME}"), &anonymous);
    assert!(output.contains("read GeoTIFF"), "{output}");
    assert_refused(&google.output_of(&url(), &anonymous), "AccessDenied", HINT);
}

#[test]
fn missing_file_error_names_its_url() {
    let google = Google::start();
    let missing = google.output_with_key("gs://hills/south.tif", &SURVEYOR.file());
    assert!(
        missing.contains("there is no such file (gs://hills/south.tif)"),
        "{missing}"
    );
}

#[test]
fn rejected_key_error_names_the_server_code() {
    let google = Google::start();
    let stranger = google.output_with_key(&url(), &UNPRIVILEGED.file());
    assert_refused(&stranger, "AccessDenied", HINT);
    let forged = SURVEYOR.file_with_key_of(&UNPRIVILEGED);
    let forged = google.output_with_key(&url(), &forged);
    assert_refused(&forged, "AuthenticationRequired", HINT);
    let log = google.server.take_log();
    assert_eq!(log.bytes, 0, "{log:?}");
}

#[test]
fn credential_environment_errors_include_a_hint() {
    let google = Google::start();
    let none = google.output_of(&url(), &[]);
    let no_file = google.output_of(
        &url(),
        &[("GOOGLE_APPLICATION_CREDENTIALS", "/nowhere/key.json")],
    );
    let no_key = google.output_with_key(&url(), r#"{"type":"service_account"}"#);
    for (reported, why) in [
        (
            none,
            "the environment contains no key, and this computer has none of its own (gs://hills",
        ),
        (
            no_file,
            "error: cannot read the URL's content: Unable to open service account file from /nowhere/key.json",
        ),
        (no_key, "missing field `private_key`"),
    ] {
        assert!(reported.contains(why), "{reported}");
        assert!(reported.contains(HINT), "{reported}");
    }
    assert!(google.server.take_log().requests.is_empty());
}

#[test]
fn unreachable_server_error_names_cause_and_hint() {
    let nowhere = [
        ("GOOGLE_BASE_URL", "http://127.0.0.1:1"),
        ("GOOGLE_BEARER_TOKEN", TOKEN),
    ];
    let reported = output_of(&url(), &nowhere);
    assert!(reported.contains("Connection refused"), "{reported}");
    assert!(
        reported.contains("hint: check the network, and GOOGLE_BASE_URL"),
        "{reported}"
    );
}

/// A file on disk never leads to a server.
#[test]
fn local_mosaic_that_names_a_bucket_is_refused() {
    let google = Google::start();
    let public = format!("/vsigs/{PUBLIC}/50% #2.tif");
    let files = ["/vsigs/hills/north ridge/hills-1.tif", &public];
    let mosaic = mosaic(google.hills.folder.path(), files);
    let reported = google.output_with_key(&mosaic, &SURVEYOR.file());
    assert!(
        reported.contains("it names /vsigs/hills/north ridge/hills-1.tif"),
        "{reported}"
    );
}
