//! Runs all cases, each in a process of its own.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};

use heightfield::Raster;

use super::case::{Case, terrain};
use super::hip_path::HipPaths;
use super::measurement::{Reading, Row};
use super::meter::{TRAFFIC_QUERY, Traffic};
use super::relief::Relief;
use super::{MeasureError, Plan, SIDES, cog};

#[cfg(feature = "remote")]
use super::server::Server;

/// Most samples of a file that is also measured as a whole: 800 MB of them.
const MAX_WHOLE_SAMPLES: u64 = 200_000_000;
/// Prefix of a row on standard output of a case's process.
const ROW_PREFIX: &str = "row ";
/// Prefix of the reason for a failure.
const FAILURE_PREFIX: &str = "why ";

/// A measured terrain.
struct Subject<'p> {
    name: String,
    path: PathBuf,
    is_synthetic: bool,
    plan: &'p Plan,
}

/// Measures the synthetic terrains of a plan and some files. `on_start` receives each start, `done`
/// each row. A terrain that cannot be measured is reported to `warn`, and the next one is measured.
///
/// # Errors
/// If there is no room for the synthetic terrains, or no folder.
pub fn measure(
    plan: &Plan,
    files: &[PathBuf],
    on_start: &mut dyn FnMut(&str),
    warn: &mut dyn FnMut(&str),
    done: &mut dyn FnMut(Row),
) -> Result<(), MeasureError> {
    let folder = tempfile::Builder::new().prefix("hapterra-lab-").tempdir();
    let failed = |error: std::io::Error| MeasureError(format!("a folder for terrains: {error}"));
    let folder = folder.map_err(failed)?;
    for file in files {
        let name = file.file_stem().unwrap_or(file.as_os_str());
        let subject = Subject {
            name: name.to_string_lossy().into_owned(),
            path: file.clone(),
            is_synthetic: false,
            plan,
        };
        if let Err(why) = subject.measure(folder.path(), on_start, done) {
            warn(&format!("{}: {why}", file.display()));
        }
    }
    let mut relief = None;
    for exponent in &plan.exponents {
        let side = SIDES[(exponent - MIN_EXPONENT) as usize];
        let path = folder.path().join(format!("made-{side}.tif"));
        on_start(&format!("{side} × {side}: made"));
        check_free_space(&path, side)?;
        let relief = relief.get_or_insert_with(Relief::new);
        let failed = |error| MeasureError(format!("{}: {error}", path.display()));
        cog::write(&path, side, relief).map_err(failed)?;
        let subject = Subject {
            name: format!("{side} × {side}"),
            path,
            is_synthetic: true,
            plan,
        };
        if let Err(why) = subject.measure(folder.path(), on_start, done) {
            warn(&format!("{}: {why}", subject.name));
        }
        // The next one needs its room.
        let _ = std::fs::remove_file(&subject.path);
    }
    Ok(())
}

/// The exponent of ten of the smallest synthetic terrain.
const MIN_EXPONENT: u32 = 6;

/// Checks that the disk has room for a synthetic terrain. If the system does not report it, the
/// write will show.
fn check_free_space(path: &Path, side: u32) -> Result<(), MeasureError> {
    let needed = cog::max_bytes(side);
    let folder = path.parent().unwrap_or(path);
    match fs4::available_space(folder) {
        Ok(free) if free < needed => {
            let [needed, free] = [needed, free].map(|bytes| bytes as f64 / 1e6);
            let folder = folder.display();
            let text = format!(
                "a generated terrain needs up to {needed:.0} MB, and {free:.0} MB are free in {folder}"
            );
            Err(MeasureError(text))
        }
        _ => Ok(()),
    }
}

impl Subject<'_> {
    /// Measures all cases of the terrain.
    fn measure(
        &self,
        folder: &Path,
        on_start: &mut dyn FnMut(&str),
        done: &mut dyn FnMut(Row),
    ) -> Result<(), MeasureError> {
        let path =
            std::path::absolute(&self.path).map_err(|error| MeasureError(error.to_string()))?;
        let (paths, samples, is_whole) = self.paths()?;
        let file = folder.join("ways");
        paths
            .write(&file)
            .map_err(|error| MeasureError(format!("{}: {error}", file.display())))?;
        let case = |reading, latency_ms, source: String| Case {
            terrain: self.name.clone(),
            source,
            paths_file: file.display().to_string(),
            reading,
            latency_ms,
            halvings: self.plan.halvings,
            stands_while_reading: self.plan.stands_while_reading && latency_ms == 0,
        };
        let on_disk = path.display().to_string();
        if samples <= MAX_WHOLE_SAMPLES && !is_whole {
            on_start(&format!("{}: read as a whole", self.name));
            let whole = case(Reading::Whole, 0, on_disk.clone());
            run(&whole, &mut || None, done)?;
        }
        for latency_ms in &self.plan.latencies_ms {
            on_start(&format!("{}: {latency_ms} ms", self.name));
            if *latency_ms == 0 {
                run(
                    &case(Reading::Blocks, 0, on_disk.clone()),
                    &mut || None,
                    done,
                )?;
            } else {
                self.at_a_server(&path, *latency_ms, &case, done)?;
            }
        }
        Ok(())
    }

    #[cfg(feature = "remote")]
    fn at_a_server(
        &self,
        path: &Path,
        latency_ms: u32,
        case: &dyn Fn(Reading, u32, String) -> Case,
        done: &mut dyn FnMut(Row),
    ) -> Result<(), MeasureError> {
        let failed = |error: std::io::Error| MeasureError(format!("a server: {error}"));
        let server = Server::of(path.parent().unwrap_or(path)).map_err(failed)?;
        server.set_latency_ms(latency_ms);
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let case = case(Reading::Blocks, latency_ms, server.url(&name));
        run(&case, &mut || Some(server.traffic()), done)
    }

    #[cfg(not(feature = "remote"))]
    fn at_a_server(
        &self,
        _: &Path,
        latency_ms: u32,
        _: &dyn Fn(Reading, u32, String) -> Case,
        _: &mut dyn FnMut(Row),
    ) -> Result<(), MeasureError> {
        let text = format!(
            "{latency_ms} ms need a web server, which this build lacks: build it with --features remote"
        );
        Err(MeasureError(text))
    }

    /// Returns the paths over the terrain, its number of samples, and true if it is always read as
    /// a whole.
    fn paths(&self) -> Result<(HipPaths, u64, bool), MeasureError> {
        let options = Case::options(Reading::Blocks);
        let raster = Raster::open(&self.path, &options);
        let raster = raster.map_err(|error| MeasureError(error.to_string()))?;
        let samples = u64::from(raster.columns()) * u64::from(raster.rows());
        let paths = HipPaths::over(&terrain(&raster)?, self.is_synthetic)?;
        Ok((paths, samples, raster.is_summary_complete()))
    }
}

/// Runs a case in a process of its own.
fn run(
    case: &Case,
    traffic: &mut dyn FnMut() -> Option<Traffic>,
    done: &mut dyn FnMut(Row),
) -> Result<(), MeasureError> {
    let failed =
        |error: std::io::Error| MeasureError(format!("cannot start a separate process: {error}"));
    let program = std::env::current_exe().map_err(failed)?;
    let mut child = Command::new(program)
        .args(["streaming", "--case", &to_line(case)?])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let (mut to, from) = (child.stdin.take(), child.stdout.take());
    let mut why = None;
    for line in BufReader::new(from.ok_or_else(|| MeasureError("no pipe".into()))?).lines() {
        let line = line.map_err(failed)?;
        if line == TRAFFIC_QUERY {
            answer(to.as_mut(), traffic().unwrap_or_default()).map_err(failed)?;
        } else if let Some(row) = line.strip_prefix(ROW_PREFIX) {
            done(from_line(row)?);
        } else if let Some(text) = line.strip_prefix(FAILURE_PREFIX) {
            why = Some(text.to_owned());
        }
    }
    let status = child.wait().map_err(failed)?;
    match (status.success(), why) {
        (true, None) => Ok(()),
        (_, Some(why)) => Err(MeasureError(why)),
        (false, None) => Err(MeasureError(format!("its process ended with {status}"))),
    }
}

fn answer(to: Option<&mut ChildStdin>, traffic: Traffic) -> std::io::Result<()> {
    let Some(to) = to else {
        return Ok(());
    };
    writeln!(to, "{} {}", traffic.requests, traffic.bytes)
}

/// Measures the case of this process, and writes the rows or the failure to standard output.
///
/// # Errors
/// If the case cannot be parsed; a failed measurement is written instead.
pub fn measure_case(case: &str) -> Result<(), MeasureError> {
    let case: Case = from_line(case)?;
    let measured = case.measure(|row| match to_line(&row) {
        Ok(row) => println!("{ROW_PREFIX}{row}"),
        Err(why) => println!("{FAILURE_PREFIX}{why}"),
    });
    if let Err(why) = measured {
        println!("{FAILURE_PREFIX}{}", why.to_string().replace('\n', " "));
    }
    Ok(())
}

/// Returns a value as a line of CSV.
fn to_line(value: &impl serde::Serialize) -> Result<String, MeasureError> {
    let mut writer = csv::WriterBuilder::new()
        .has_headers(false)
        .from_writer(vec![]);
    let line = writer.serialize(value);
    let line = line.and_then(|()| {
        writer
            .into_inner()
            .map_err(|error| error.into_error().into())
    });
    let line = line.map_err(|error| MeasureError(error.to_string()))?;
    Ok(String::from_utf8_lossy(&line).trim_end().to_owned())
}

/// Parses a line from [`to_line`].
fn from_line<T: serde::de::DeserializeOwned>(line: &str) -> Result<T, MeasureError> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(line.as_bytes());
    let row = reader.deserialize().next();
    let row = row.ok_or_else(|| MeasureError("an empty line".into()))?;
    row.map_err(|error| MeasureError(format!("{line:?}: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_cases_pass_a_pipe_unchanged() {
        let row = Row {
            terrain: "a, \"b\" × 3".into(),
            samples: 10_000_000_000,
            open_ms: 0.25,
            missing_turning_5000: Some(7),
            ..Row::default()
        };
        let line = to_line(&row).expect("a line");
        assert_eq!(line.lines().count(), 1);
        assert_eq!(from_line::<Row>(&line).expect("a row"), row);
        let case = Case {
            terrain: "x".into(),
            source: "/a folder/b,c.tif".into(),
            paths_file: "ways".into(),
            reading: Reading::Whole,
            latency_ms: 20,
            halvings: 7,
            stands_while_reading: true,
        };
        let line = to_line(&case).expect("a line");
        assert_eq!(from_line::<Case>(&line).expect("a case"), case);
        assert!(from_line::<Case>("nothing").is_err());
    }
}
