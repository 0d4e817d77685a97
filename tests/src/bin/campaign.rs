//! Runs the closed-loop campaign: `hapterra-campaign --seconds N --seed S`, or
//! one segment of it with `--segment K`. `cargo xtask campaign` builds it with
//! full optimisation and puts the report into `docs/campaign.md`.

#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use hapterra_tests::campaign::{self, SEED, Tally, Violation, report, segment};

/// What the user asked for.
struct Request {
    seconds: u64,
    seed: u64,
    segment: Option<u64>,
    report: Option<PathBuf>,
    /// Of the source that is run, for the report.
    commit: Option<String>,
}

fn main() -> ExitCode {
    let request = match request(std::env::args().skip(1)) {
        Ok(request) => request,
        Err(wrong) => {
            eprintln!("error: {wrong}");
            eprintln!(
                "hint: hapterra-campaign [--seconds N] [--seed S] [--segment K] [--report FILE] [--commit C]"
            );
            return ExitCode::from(2);
        }
    };
    match run(&request) {
        Ok(tally) => finish(&request, &tally),
        Err(violation) => {
            let Violation {
                segment,
                tick,
                what,
            } = violation;
            eprintln!("error: segment {segment}, tick {tick}: {what}");
            eprintln!(
                "hint: repeat it with: cargo xtask campaign --seed {} --segment {segment}",
                request.seed
            );
            ExitCode::FAILURE
        }
    }
}

fn request(mut words: impl Iterator<Item = String>) -> Result<Request, String> {
    let mut request = Request {
        seconds: 10_000,
        seed: SEED,
        segment: None,
        report: None,
        commit: None,
    };
    while let Some(word) = words.next() {
        let value = words.next().ok_or(format!("{word} wants a value"))?;
        let number = || {
            value
                .parse()
                .map_err(|_| format!("{word} {value}: not a whole number"))
        };
        match word.as_str() {
            "--seconds" => request.seconds = number()?,
            "--seed" => request.seed = number()?,
            "--segment" => request.segment = Some(number()?),
            "--report" => request.report = Some(value.into()),
            "--commit" => request.commit = Some(value),
            _ => return Err(format!("{word} is no option")),
        }
    }
    Ok(request)
}

fn run(request: &Request) -> Result<Tally, Violation> {
    if let Some(number) = request.segment {
        let mut tally = Tally::default();
        segment::run(request.seed, number, &mut tally)?;
        return Ok(tally);
    }
    campaign::run(request.seed, request.seconds, &mut |segment, tally| {
        eprintln!(
            "segment {segment}: {} mishaps, amplifiers on for {} s of {} s",
            tally.injected(),
            tally.armed / 1_000,
            tally.ticks / 1_000
        );
    })
}

fn finish(request: &Request, tally: &Tally) -> ExitCode {
    print!("{}", tally.table());
    println!("{:#?}", tally.extremes);
    let Some(path) = &request.report else {
        return ExitCode::SUCCESS;
    };
    let page = report::page(
        request.commit.as_deref(),
        request.seed,
        request.seconds,
        tally,
    );
    match std::fs::write(path, page) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: cannot write {}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}
