//! `hapterra-lab streaming`: the cost of terrain larger than memory.

use hapterra::cli::Failure;
use hapterra::quantity::TIME;

use super::files::{self, Files, spinner};
use crate::report;
use crate::streaming::{self, Plan};

/// Arguments of `hapterra-lab streaming`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Files to measure and to write.
    #[command(flatten)]
    pub files: Files,

    /// Sizes of the synthetic terrains as powers of ten, from 6 to 10
    #[arg(long, value_name = "LIST", value_delimiter = ',',
          default_values_t = [6, 7, 8, 9, 10], value_parser = clap::value_parser!(u32).range(6..=10))]
    pub sizes: Vec<u32>,

    /// Latencies of a web server, such as 20ms; 0ms is a file on disk [default: 0ms,20ms,50ms,100ms,200ms,
    /// or 0ms without the feature remote]
    #[arg(long, value_name = "TIME,…", value_delimiter = ',', value_parser = parse_latency)]
    pub latency: Vec<u32>,

    /// Case that a process of its own measures
    #[arg(long, hide = true)]
    pub case: Option<String>,
}

/// Measures, and prints a line for each row as soon as it is measured.
///
/// # Errors
/// A failed measurement, or a file that cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(case) = &args.case {
        return streaming::measure_case(case).map_err(Failure::new);
    }
    let (out, picture) = args.files.outputs.table_and_picture()?;
    super::warn_without_optimisation();
    let plan = plan(args)?;
    let waiting = spinner();
    let mut rows: Vec<streaming::Row> = vec![];
    waiting.suspend(|| println!("{}", report::streaming_head()));
    let measured = streaming::measure(
        &plan,
        &args.files.files,
        &mut |what| waiting.set_message(what.to_owned()),
        &mut |why| waiting.suspend(|| eprintln!("warning: not measured: {why}")),
        &mut |row| {
            waiting.suspend(|| println!("{}", report::streaming(&row)));
            rows.push(row);
        },
    );
    waiting.finish_and_clear();
    let room = "free some room where temporary files are, or name another place in TMPDIR";
    measured.map_err(|why| Failure::new(why).hint(room))?;
    if rows.is_empty() {
        let hint = "see the warnings above; name other files, or leave --files-only out";
        return Err(Failure::new("nothing was measured").hint(hint));
    }
    files::write(out, |file| report::write_streaming(file, &rows))?;
    files::write(picture, |file| report::draw_streaming(&rows, file))
}

/// Reads a time in whole milliseconds.
fn parse_latency(text: &str) -> Result<u32, String> {
    let ms = 1e3 * TIME.read_within(text, [0.0, 10.0])?;
    let whole = ms.round();
    ((ms - whole).abs() < 1e-6)
        .then_some(whole as u32)
        .ok_or_else(|| "a latency is a whole number of milliseconds, as 20ms".to_owned())
}

fn plan(args: &Args) -> Result<Plan, Failure> {
    let has_server = cfg!(feature = "remote");
    let latencies_ms = match (args.latency.is_empty(), has_server) {
        (false, _) => args.latency.clone(),
        (true, true) => streaming::LATENCIES_MS.to_vec(),
        (true, false) => vec![0],
    };
    if !has_server && latencies_ms.iter().any(|latency| *latency > 0) {
        let text = "this build has no web server, so latencies cannot be measured";
        let hint = "cargo run --release -p hapterra-lab --features remote -- streaming";
        return Err(Failure::new(text).hint(hint));
    }
    Ok(Plan {
        exponents: match args.files.files_only {
            true => vec![],
            false => args.sizes.clone(),
        },
        latencies_ms,
        halvings: if args.files.quick { 4 } else { 6 },
        stands_while_reading: args.files.quick,
    })
}
