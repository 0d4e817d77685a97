//! `az://`

use hapterra_url_tests::azure::{Account, EMULATOR, PRINCIPAL, SURVEYORS, TOKEN, served};
use hapterra_url_tests::bucket::{PUBLIC, RequestLog, Server};

use crate::buckets::opened::{
    Hills, NAME, assert_fetched_in_parts, assert_refused, hills, mosaic, output_of,
};

/// The user's hint.
const HINT: &str = "hint: set the server's variables: AZURE_STORAGE_ACCOUNT_NAME";
/// Times before which a signature is valid.
const ONE_DAY: &str = "2100-01-31T00:00:00Z";
const EXPIRED: &str = "2020-01-31T00:00:00Z";

/// A server of the containers of an account.
struct Microsoft {
    hills: Hills,
    server: Server,
    account: Account,
}

impl Microsoft {
    fn start(account: Account) -> Self {
        let hills = hills(&["hills", PUBLIC]);
        let server = served(hills.folder.path(), account);
        Self {
            hills,
            server,
            account,
        }
    }

    /// Opens a file with the name of the account and its address in the environment.
    fn output_of(&self, name: &str, environment: &[(&str, &str)]) -> String {
        let server = [
            ("AZURE_STORAGE_ENDPOINT", self.server.endpoint()),
            ("AZURE_ALLOW_HTTP", "true"),
            ("AZURE_STORAGE_ACCOUNT_NAME", self.account.name),
        ];
        output_of(name, &[&server, environment].concat())
    }

    fn output_with_key(&self, name: &str, key: &str) -> String {
        self.output_of(name, &[("AZURE_STORAGE_ACCOUNT_KEY", key)])
    }

    /// Opens a file as from an emulator on this computer, usually `Azurite`.
    fn output_of_emulator(&self, name: &str, environment: &[(&str, &str)]) -> String {
        let server = [
            ("AZURE_STORAGE_USE_EMULATOR", "true"),
            ("AZURITE_BLOB_STORAGE_URL", self.server.endpoint()),
        ];
        output_of(name, &[&server, environment].concat())
    }
}

fn url() -> String {
    format!("az://hills/{NAME}")
}

#[test]
fn file_opens_with_account_key_and_is_fetched_in_parts() {
    let microsoft = Microsoft::start(SURVEYORS);
    let output = microsoft.output_with_key(&url(), SURVEYORS.key);
    assert!(output.contains("read GeoTIFF"), "{output}");
    assert_fetched_in_parts(&microsoft.server.take_log(), microsoft.hills.bytes);
}

/// The variables of Microsoft's own command.
#[test]
fn file_opens_with_the_settings_of_microsofts_command() {
    let microsoft = Microsoft::start(SURVEYORS);
    let environment = [
        ("AZURE_STORAGE_ENDPOINT", microsoft.server.endpoint()),
        ("AZURE_ALLOW_HTTP", "true"),
        ("AZURE_STORAGE_ACCOUNT", SURVEYORS.name),
        ("AZURE_STORAGE_KEY", SURVEYORS.key),
    ];
    let output = output_of(&url(), &environment);
    assert!(output.contains("read GeoTIFF"), "{output}");
}

#[test]
fn file_opens_with_a_valid_shared_access_signature() {
    let microsoft = Microsoft::start(SURVEYORS);
    let with = |sas: &str| microsoft.output_of(&url(), &[("AZURE_STORAGE_SAS_TOKEN", sas)]);
    for mark in ["", "?"] {
        let output = with(&format!("{mark}{}", SURVEYORS.sas("hills", ONE_DAY)));
        assert!(output.contains("read GeoTIFF"), "{output}");
    }
    for other in [
        SURVEYORS.sas("hills", EXPIRED),
        SURVEYORS.sas(PUBLIC, ONE_DAY),
        EMULATOR.sas("hills", ONE_DAY),
    ] {
        let reported = with(&other);
        assert_refused(&reported, "AuthenticationFailed", HINT);
        assert!(!reported.contains("sig="), "{reported}");
    }
}

#[test]
fn file_opens_with_a_token_or_a_principals_secret() {
    let microsoft = Microsoft::start(SURVEYORS);
    let with_token = |token: &str| microsoft.output_of(&url(), &[("AZURE_STORAGE_TOKEN", token)]);
    assert!(with_token(TOKEN).contains("read GeoTIFF"));
    assert_refused(&with_token("eyJ0.other"), "InvalidAuthenticationInfo", HINT);
    let [tenant, name, secret] = PRINCIPAL;
    let with_secret = |secret: &str| {
        let environment = [
            ("AZURE_AUTHORITY_HOST", microsoft.server.endpoint()),
            ("AZURE_TENANT_ID", tenant),
            ("AZURE_CLIENT_ID", name),
            ("AZURE_CLIENT_SECRET", secret),
        ];
        microsoft.output_of(&url(), &environment)
    };
    let _ = microsoft.server.take_log();
    let output = with_secret(secret);
    assert!(output.contains("read GeoTIFF"), "{output}");
    // The file and its possible sidecars share a token.
    let RequestLog { requests, .. } = microsoft.server.take_log();
    let changes = requests.iter().filter(|line| line.starts_with("POST"));
    assert_eq!(changes.count(), 1, "{requests:?}");
    let reported = with_secret("in the hut");
    assert!(
        reported.contains("the key of the environment was refused"),
        "{reported}"
    );
    assert!(
        reported.contains("401") && reported.contains(HINT),
        "{reported}"
    );
}

#[test]
fn emulator_file_opens_only_with_the_well_known_key() {
    let microsoft = Microsoft::start(EMULATOR);
    let output = microsoft.output_of_emulator(&url(), &[]);
    assert!(output.contains("read GeoTIFF"), "{output}");
    let other = [("AZURE_STORAGE_ACCOUNT_KEY", SURVEYORS.key)];
    let reported = microsoft.output_of_emulator(&url(), &other);
    assert_refused(&reported, "AuthenticationFailed", HINT);
}

#[test]
fn only_public_container_opens_without_a_key() {
    let microsoft = Microsoft::start(EMULATOR);
    let anonymous = [("AZURE_SKIP_SIGNATURE", "true")];
    let output = microsoft.output_of(&format!("az://{PUBLIC}/{NAME}"), &anonymous);
    assert!(output.contains("read GeoTIFF"), "{output}");
    let reported = microsoft.output_of(&url(), &anonymous);
    assert_refused(&reported, "NoAuthenticationInformation", HINT);
    // In most accounts nothing is public, and the answer has the status of a conflict.
    let microsoft = Microsoft::start(SURVEYORS);
    let reported = microsoft.output_of(&url(), &anonymous);
    assert_refused(&reported, "PublicAccessNotPermitted", HINT);
}

#[test]
fn missing_file_is_reported() {
    let microsoft = Microsoft::start(SURVEYORS);
    let missing = microsoft.output_with_key("az://hills/south.tif", SURVEYORS.key);
    assert!(
        missing.contains("there is no such file (az://hills/south.tif)"),
        "{missing}"
    );
}

#[test]
fn wrong_key_is_refused_and_no_data_is_sent() {
    let microsoft = Microsoft::start(SURVEYORS);
    let reported = microsoft.output_with_key(&url(), EMULATOR.key);
    assert_refused(&reported, "AuthenticationFailed", HINT);
    let log = microsoft.server.take_log();
    assert_eq!(log.bytes, 0, "{log:?}");
}

#[test]
fn environment_error_names_variable_and_sends_no_request() {
    let microsoft = Microsoft::start(SURVEYORS);
    let over_http = [
        ("AZURE_STORAGE_ENDPOINT", microsoft.server.endpoint()),
        ("AZURE_STORAGE_ACCOUNT_NAME", SURVEYORS.name),
        ("AZURE_STORAGE_ACCOUNT_KEY", SURVEYORS.key),
    ];
    for (reported, why) in [
        (
            output_of(&url(), &[]),
            "the environment names no storage account (az://hills",
        ),
        (
            microsoft.output_of(&url(), &[]),
            "the environment contains no key, and this computer has none of its own (az://hills",
        ),
        (
            microsoft.output_with_key(&url(), "not base 64"),
            "error: cannot read the URL's content: Invalid Access Key",
        ),
        (output_of(&url(), &over_http), "URL scheme is not allowed"),
    ] {
        assert!(reported.contains(why), "{reported}");
        assert!(reported.contains(HINT), "{reported}");
    }
    assert!(microsoft.server.take_log().requests.is_empty());
}

#[test]
fn refused_connection_error_names_cause_and_hint() {
    let nowhere = [
        ("AZURE_STORAGE_ENDPOINT", "http://127.0.0.1:1"),
        ("AZURE_ALLOW_HTTP", "true"),
        ("AZURE_STORAGE_ACCOUNT_NAME", SURVEYORS.name),
        ("AZURE_STORAGE_ACCOUNT_KEY", SURVEYORS.key),
    ];
    let reported = output_of(&url(), &nowhere);
    assert!(reported.contains("Connection refused"), "{reported}");
    assert!(
        reported.contains(
            "hint: check the network, AZURE_STORAGE_ACCOUNT_NAME, and AZURE_STORAGE_ENDPOINT"
        ),
        "{reported}"
    );
}

/// A file on disk never leads to a server.
#[test]
fn local_mosaic_that_names_a_container_is_refused() {
    let microsoft = Microsoft::start(SURVEYORS);
    let files = [
        "/vsiaz/hills/north ridge/hills-1.tif",
        "/vsiaz/open/50% #2.tif",
    ];
    let mosaic = mosaic(microsoft.hills.folder.path(), files);
    let reported = microsoft.output_with_key(&mosaic, SURVEYORS.key);
    assert!(
        reported.contains("it names /vsiaz/hills/north ridge/hills-1.tif"),
        "{reported}"
    );
}
