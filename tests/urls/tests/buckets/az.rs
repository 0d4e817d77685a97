//! `az://`

use hapterra_url_tests::azure::{Account, EMULATOR, PRINCIPAL, SURVEYORS, TOKEN, served};
use hapterra_url_tests::bucket::{PUBLIC, Seen, Server};

use crate::opened::{Hills, NAME, assert_fetched_in_parts, assert_refused, hills, mosaic, said};

/// The user's hint.
const HINT: &str = "hint: set what the server wants: AZURE_STORAGE_ACCOUNT_NAME";
/// Times before which a signature is valid.
const ONE_DAY: &str = "2100-01-31T00:00:00Z";
const LONG_AGO: &str = "2020-01-31T00:00:00Z";

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
    fn said(&self, name: &str, environment: &[(&str, &str)]) -> String {
        let server = [
            ("AZURE_STORAGE_ENDPOINT", self.server.endpoint()),
            ("AZURE_ALLOW_HTTP", "true"),
            ("AZURE_STORAGE_ACCOUNT_NAME", self.account.name),
        ];
        said(name, &[&server, environment].concat())
    }

    fn said_with_key(&self, name: &str, key: &str) -> String {
        self.said(name, &[("AZURE_STORAGE_ACCOUNT_KEY", key)])
    }

    /// Opens a file as from an emulator on this computer, usually `Azurite`.
    fn said_by_emulator(&self, name: &str, environment: &[(&str, &str)]) -> String {
        let server = [
            ("AZURE_STORAGE_USE_EMULATOR", "true"),
            ("AZURITE_BLOB_STORAGE_URL", self.server.endpoint()),
        ];
        said(name, &[&server, environment].concat())
    }
}

fn url() -> String {
    format!("az://hills/{NAME}")
}

#[test]
fn a_file_opens_with_the_key_of_its_account_and_is_fetched_in_parts() {
    let microsoft = Microsoft::start(SURVEYORS);
    let output = microsoft.said_with_key(&url(), SURVEYORS.key);
    assert!(output.contains("read GeoTIFF"), "{output}");
    assert_fetched_in_parts(&microsoft.server.take_seen(), microsoft.hills.bytes);
}

/// The variables of Microsoft's own command.
#[test]
fn a_file_opens_with_what_is_set_for_microsofts_command() {
    let microsoft = Microsoft::start(SURVEYORS);
    let environment = [
        ("AZURE_STORAGE_ENDPOINT", microsoft.server.endpoint()),
        ("AZURE_ALLOW_HTTP", "true"),
        ("AZURE_STORAGE_ACCOUNT", SURVEYORS.name),
        ("AZURE_STORAGE_KEY", SURVEYORS.key),
    ];
    let output = said(&url(), &environment);
    assert!(output.contains("read GeoTIFF"), "{output}");
}

#[test]
fn a_file_opens_with_a_shared_access_signature_while_that_holds() {
    let microsoft = Microsoft::start(SURVEYORS);
    let with = |sas: &str| microsoft.said(&url(), &[("AZURE_STORAGE_SAS_TOKEN", sas)]);
    for mark in ["", "?"] {
        let output = with(&format!("{mark}{}", SURVEYORS.sas("hills", ONE_DAY)));
        assert!(output.contains("read GeoTIFF"), "{output}");
    }
    for other in [
        SURVEYORS.sas("hills", LONG_AGO),
        SURVEYORS.sas(PUBLIC, ONE_DAY),
        EMULATOR.sas("hills", ONE_DAY),
    ] {
        let told = with(&other);
        assert_refused(&told, "AuthenticationFailed", HINT);
        assert!(!told.contains("sig="), "{told}");
    }
}

#[test]
fn a_file_opens_with_a_token_and_with_the_secret_of_a_program() {
    let microsoft = Microsoft::start(SURVEYORS);
    let with_token = |token: &str| microsoft.said(&url(), &[("AZURE_STORAGE_TOKEN", token)]);
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
        microsoft.said(&url(), &environment)
    };
    let _ = microsoft.server.take_seen();
    let output = with_secret(secret);
    assert!(output.contains("read GeoTIFF"), "{output}");
    // The file and its possible sidecars share a token.
    let Seen { requests, .. } = microsoft.server.take_seen();
    let changes = requests.iter().filter(|line| line.starts_with("POST"));
    assert_eq!(changes.count(), 1, "{requests:?}");
    let told = with_secret("in the hut");
    assert!(
        told.contains("the key of the environment was refused"),
        "{told}"
    );
    assert!(told.contains("401") && told.contains(HINT), "{told}");
}

#[test]
fn a_file_of_an_emulator_opens_with_the_key_that_everybody_knows() {
    let microsoft = Microsoft::start(EMULATOR);
    let output = microsoft.said_by_emulator(&url(), &[]);
    assert!(output.contains("read GeoTIFF"), "{output}");
    let other = [("AZURE_STORAGE_ACCOUNT_KEY", SURVEYORS.key)];
    let told = microsoft.said_by_emulator(&url(), &other);
    assert_refused(&told, "AuthenticationFailed", HINT);
}

#[test]
fn a_file_of_a_public_container_opens_without_a_key_and_no_other_does() {
    let microsoft = Microsoft::start(EMULATOR);
    let nobody = [("AZURE_SKIP_SIGNATURE", "true")];
    let output = microsoft.said(&format!("az://{PUBLIC}/{NAME}"), &nobody);
    assert!(output.contains("read GeoTIFF"), "{output}");
    let told = microsoft.said(&url(), &nobody);
    assert_refused(&told, "NoAuthenticationInformation", HINT);
    // In most accounts nothing is public, and the answer has the status of a conflict.
    let microsoft = Microsoft::start(SURVEYORS);
    let told = microsoft.said(&url(), &nobody);
    assert_refused(&told, "PublicAccessNotPermitted", HINT);
}

#[test]
fn a_file_that_is_not_there_is_told_so() {
    let microsoft = Microsoft::start(SURVEYORS);
    let missing = microsoft.said_with_key("az://hills/south.tif", SURVEYORS.key);
    assert!(
        missing.contains("there is no such file (az://hills/south.tif)"),
        "{missing}"
    );
}

#[test]
fn a_key_that_does_not_open_it_is_told_so() {
    let microsoft = Microsoft::start(SURVEYORS);
    let told = microsoft.said_with_key(&url(), EMULATOR.key);
    assert_refused(&told, "AuthenticationFailed", HINT);
    let seen = microsoft.server.take_seen();
    assert_eq!(seen.bytes, 0, "{seen:?}");
}

#[test]
fn what_is_wrong_with_the_environment_is_told_with_what_to_set() {
    let microsoft = Microsoft::start(SURVEYORS);
    let over_http = [
        ("AZURE_STORAGE_ENDPOINT", microsoft.server.endpoint()),
        ("AZURE_STORAGE_ACCOUNT_NAME", SURVEYORS.name),
        ("AZURE_STORAGE_ACCOUNT_KEY", SURVEYORS.key),
    ];
    for (told, why) in [
        (
            said(&url(), &[]),
            "the environment names no storage account (az://hills",
        ),
        (
            microsoft.said(&url(), &[]),
            "the environment holds no key, and this computer has none of its own (az://hills",
        ),
        (
            microsoft.said_with_key(&url(), "not base 64"),
            "error: cannot read what is there: Invalid Access Key",
        ),
        (said(&url(), &over_http), "URL scheme is not allowed"),
    ] {
        assert!(told.contains(why), "{told}");
        assert!(told.contains(HINT), "{told}");
    }
    assert!(microsoft.server.take_seen().requests.is_empty());
}

#[test]
fn a_server_that_is_not_there_is_told_with_the_cause_and_where_to_look() {
    let nowhere = [
        ("AZURE_STORAGE_ENDPOINT", "http://127.0.0.1:1"),
        ("AZURE_ALLOW_HTTP", "true"),
        ("AZURE_STORAGE_ACCOUNT_NAME", SURVEYORS.name),
        ("AZURE_STORAGE_ACCOUNT_KEY", SURVEYORS.key),
    ];
    let told = said(&url(), &nowhere);
    assert!(told.contains("Connection refused"), "{told}");
    assert!(
        told.contains(
            "hint: check the network, AZURE_STORAGE_ACCOUNT_NAME, and AZURE_STORAGE_ENDPOINT"
        ),
        "{told}"
    );
}

/// A file on disk never leads to a server.
#[test]
fn a_mosaic_here_that_names_a_container_is_refused() {
    let microsoft = Microsoft::start(SURVEYORS);
    let files = [
        "/vsiaz/hills/north ridge/hills-1.tif",
        "/vsiaz/open/50% #2.tif",
    ];
    let mosaic = mosaic(microsoft.hills.folder.path(), files);
    let told = microsoft.said_with_key(&mosaic, SURVEYORS.key);
    assert!(
        told.contains("it names /vsiaz/hills/north ridge/hills-1.tif"),
        "{told}"
    );
}
