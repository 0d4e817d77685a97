//! Runs the closed-loop campaign: `hapterra-campaign --seconds N --seed S`, or one segment of it
//! with `--segment K [--effects]`. `--link` selects the campaign of link faults. `cargo xtask
//! campaign` builds this with full optimisation and writes the report `campaign.md` or
//! `link-campaign.md` into the folder of the month in `log/`.

#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use hapterra_tests::campaign::{self, Ground, Violation};
use hapterra_tests::link_campaign;

/// The user's options.
struct Request {
    /// True for the campaign of link faults, false for the closed loop.
    link: bool,
    /// The ground of a single segment.
    ground: Ground,
    seconds: Option<u64>,
    seed: Option<u64>,
    segment: Option<u64>,
    report: Option<PathBuf>,
    /// The commit of the source, for the report.
    commit: Option<String>,
}

fn main() -> ExitCode {
    let request = match request(std::env::args().skip(1)) {
        Ok(request) => request,
        Err(wrong) => {
            eprintln!("error: {wrong}");
            eprintln!(
                "hint: hapterra-campaign [--link] [--seconds N] [--seed S] [--segment K [--effects]] [--report FILE] [--commit C]"
            );
            return ExitCode::from(2);
        }
    };
    let ran = match request.link {
        true => run_link(&request),
        false => run(&request),
    };
    match ran {
        Ok(page) => finish(&request, &page),
        Err(violation) => {
            print_summary(&request, &violation);
            ExitCode::FAILURE
        }
    }
}

/// Prints a violation and the command that repeats it.
fn print_summary(request: &Request, violation: &Violation) {
    let Violation {
        segment,
        ground,
        tick,
        what,
    } = violation;
    let ground = ground.option();
    let (link, seed) = match request.link {
        true => ("--link ", request.seed.unwrap_or(link_campaign::SEED)),
        false => ("", request.seed.unwrap_or(campaign::SEED)),
    };
    eprintln!("error: segment {segment}, tick {tick}: {what}");
    eprintln!(
        "hint: repeat it with: cargo xtask campaign {link}--seed {seed} --segment {segment}{ground}"
    );
}

fn request(mut words: impl Iterator<Item = String>) -> Result<Request, String> {
    let mut request = Request {
        link: false,
        ground: Ground::Ice,
        seconds: None,
        seed: None,
        segment: None,
        report: None,
        commit: None,
    };
    while let Some(word) = words.next() {
        if word == "--link" {
            request.link = true;
            continue;
        }
        if word == "--effects" {
            request.ground = Ground::Drawn;
            continue;
        }
        let value = words.next().ok_or(format!("{word} wants a value"))?;
        let number = || {
            value
                .parse()
                .map_err(|_| format!("{word} {value}: not a whole number"))
        };
        match word.as_str() {
            "--seconds" => request.seconds = Some(number()?),
            "--seed" => request.seed = Some(number()?),
            "--segment" => request.segment = Some(number()?),
            "--report" => request.report = Some(value.into()),
            "--commit" => request.commit = Some(value),
            _ => return Err(format!("{word} is no option")),
        }
    }
    Ok(request)
}

/// Runs the closed loop. Returns the report, or `None` for a single segment.
fn run(request: &Request) -> Result<Option<String>, Violation> {
    let seed = request.seed.unwrap_or(campaign::SEED);
    if let Some(number) = request.segment {
        let mut stats = campaign::LinkStats::default();
        campaign::segment::run(seed, number, request.ground, &mut stats)?;
        print!("{}", stats.table());
        println!("{:#?}", stats.extremes);
        return Ok(None);
    }
    let seconds = request.seconds.unwrap_or(10_000);
    let stats = campaign::run(seed, seconds, &mut |segment, stats| {
        eprintln!(
            "segment {segment}: {} mishaps, amplifiers on for {} s of {} s",
            stats.injected(),
            stats.armed / 1_000,
            stats.ticks / 1_000
        );
    })?;
    print!("{}", stats.table());
    println!("{:#?}", stats.extremes);
    let commit = request.commit.as_deref();
    Ok(Some(campaign::report::page(commit, seed, seconds, &stats)))
}

/// Runs the campaign of link faults. Returns the report, or `None` for a single segment.
fn run_link(request: &Request) -> Result<Option<String>, Violation> {
    let seed = request.seed.unwrap_or(link_campaign::SEED);
    if let Some(number) = request.segment {
        let mut stats = link_campaign::LinkStats::default();
        link_campaign::segment(seed, number, &mut stats)?;
        print!("{}", stats.table());
        return Ok(None);
    }
    let seconds = request.seconds.unwrap_or(3_600);
    let stats = link_campaign::run(seed, seconds, &mut |segment, stats| {
        eprintln!(
            "segment {segment}: {} runs, amplifiers on for {} s of {} s",
            stats.runs(),
            stats.ticks[1] / 1_000,
            stats.ticks[0] / 1_000
        );
    })?;
    print!("{}", stats.table());
    let commit = request.commit.as_deref();
    Ok(Some(link_campaign::report::page(
        commit, seed, seconds, &stats,
    )))
}

/// Writes the report to its file.
fn finish(request: &Request, page: &Option<String>) -> ExitCode {
    let (Some(path), Some(page)) = (&request.report, page) else {
        return ExitCode::SUCCESS;
    };
    match std::fs::write(path, page) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: cannot write {}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}
