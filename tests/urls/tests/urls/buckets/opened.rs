//! A file that another process opens, with keys in its environment.

use std::path::Path;
use std::process::Command;

use hapterra::cli::failure::Failure;
use hapterra_url_tests::bucket::RequestLog;
use hapterra_url_tests::cog::cog;
use heightfield::{OpenOptions, Raster};

/// Variable with the name of the file that the second process opens.
const VARIABLE: &str = "HAPTERRA_TEST_BUCKET";
/// Samples of a file here.
const SIZE: [u32; 2] = [2000, 1200];

fn height(column: u32, row: u32) -> f32 {
    (column % SIZE[0] + 1000 * (row % 10)) as f32
}

/// A folder of buckets with the file `NAME`, and its expected values.
pub(crate) struct Hills {
    pub(crate) folder: tempfile::TempDir,
    /// Bytes of the file.
    pub(crate) bytes: usize,
}

/// The file in each bucket, by its key in a URL. The request to the server has other escapes.
pub(crate) const NAME: &str = "north%20ridge/hills-1.tif";

/// Creates a folder of buckets with these names, each with the file.
pub(crate) fn hills(buckets: &[&str]) -> Hills {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = cog(SIZE[0], SIZE[1], 2, height);
    for bucket in buckets {
        let within = folder.path().join(bucket).join("north ridge");
        std::fs::create_dir_all(&within).expect("a bucket");
        std::fs::write(within.join("hills-1.tif"), &bytes).expect("written");
        // A name with characters that have a meaning in a URL.
        let other = folder.path().join(bucket).join("50% #2.tif");
        std::fs::write(other, &bytes).expect("written");
    }
    Hills {
        folder,
        bytes: bytes.len(),
    }
}

/// Writes a mosaic of two adjacent files. Returns its path.
pub(crate) fn mosaic(folder: &Path, files: [&str; 2]) -> String {
    let [width, rows] = SIZE;
    let source = |(index, file): (u32, &str)| {
        format!(
            r#"<SimpleSource><SourceFilename relativeToVRT="0">{file}</SourceFilename><SourceBand>1</SourceBand>
            <SourceProperties RasterXSize="{width}" RasterYSize="{rows}" DataType="Float32"/>
            <SrcRect xOff="0" yOff="0" xSize="{width}" ySize="{rows}"/>
            <DstRect xOff="{}" yOff="0" xSize="{width}" ySize="{rows}"/></SimpleSource>"#,
            width * index
        )
    };
    let sources: String = (0..).zip(files).map(source).collect();
    let vrt = format!(
        r#"<VRTDataset rasterXSize="{}" rasterYSize="{rows}"><GeoTransform>500000,30,0,4000000,0,-30</GeoTransform>
        <VRTRasterBand dataType="Float32" band="1">{sources}</VRTRasterBand></VRTDataset>"#,
        2 * width
    );
    let path = folder.join("hills.vrt");
    std::fs::write(&path, vrt).expect("written");
    path.display().to_string()
}

/// Returns the output of the second process: a note that it rendered the file, or the messages of a
/// failed command.
pub(crate) fn output_of(name: &str, environment: &[(&str, &str)]) -> String {
    let mut process = Command::new(std::env::current_exe().expect("this program"));
    process.args([
        "--exact",
        "buckets::opened::child_process_opens_and_reads_the_file",
        "--nocapture",
    ]);
    // The user who runs the tests may have keys as well.
    for (key, _) in std::env::vars_os() {
        let key = key.to_string_lossy();
        if ["AWS_", "AZURE_", "GOOGLE_"]
            .iter()
            .any(|theirs| key.starts_with(theirs))
        {
            process.env_remove(&*key);
        }
    }
    let empty_home = std::env::temp_dir().join("hapterra-anonymous");
    process.env("HOME", empty_home);
    // No keys are at these addresses, as on a computer outside of a cloud.
    process.env("GCE_METADATA_HOST", "127.0.0.1:1");
    process.env("GCE_METADATA_IP", "127.0.0.1:1");
    process.env("AWS_METADATA_ENDPOINT", "http://127.0.0.1:1");
    process.env(
        "AZURE_MSI_ENDPOINT",
        "http://127.0.0.1:1/metadata/identity/oauth2/token",
    );
    process.envs(environment.iter().copied());
    let output = process.env(VARIABLE, name).output().expect("it runs");
    let words = [output.stdout, output.stderr].concat();
    String::from_utf8_lossy(&words).into_owned()
}

/// Checks that only parts of the file were sent, and nothing of the sidecars that it does not have.
pub(crate) fn assert_fetched_in_parts(log: &RequestLog, of: usize) {
    let RequestLog { requests, bytes } = log;
    assert!(*bytes < of / 4, "{bytes} of {of}");
    let parts = requests.iter().filter(|line| line.contains(" 206 "));
    assert!(parts.count() > 3, "{requests:?}");
    let missing: Vec<&String> = requests
        .iter()
        .filter(|line| line.contains(" 404 "))
        .collect();
    assert!(!missing.is_empty(), "{requests:?}");
    assert!(
        missing
            .iter()
            .all(|line| ["msk", "ovr", "xml"].iter().any(|end| line.contains(end))),
        "{missing:?}"
    );
}

/// Checks that the message has the fault, the server's text, the file and the remedy.
pub(crate) fn assert_refused(reported: &str, word: &str, hint: &str) {
    let why = format!(
        "error: cannot read the URL's content: reading it requires a key: the server reports {word} ("
    );
    assert!(reported.contains(&why), "{reported}");
    assert!(reported.contains(&format!("hills/{NAME})")), "{reported}");
    assert!(reported.contains(hint), "{reported}");
}

/// The other half of the tests.
#[test]
fn child_process_opens_and_reads_the_file() {
    let Ok(name) = std::env::var(VARIABLE) else {
        return;
    };
    let raster = match Raster::open(&name, &OpenOptions::default()) {
        Ok(raster) => raster,
        Err(error) => {
            println!("{}", Failure::from(error).text());
            return;
        }
    };
    let (columns, rows) = (raster.columns(), raster.rows());
    assert_eq!(columns % SIZE[0], 0);
    for (column, row) in [
        (0, 0),
        (1500, 900),
        (255, 256),
        (columns - 500, 3),
        (columns - 1, rows - 1),
    ] {
        let expected = f64::from(height(column, rows - 1 - row));
        assert_eq!(raster.height(column, row), expected, "{column} {row}");
    }
    println!("read {} of {columns} x {rows}", raster.format());
}
