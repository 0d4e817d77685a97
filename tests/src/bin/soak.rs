//! `hapterra-soak MINUTES [--seed N] [--scene K] [--rough]`; see `cargo xtask soak`.

#![forbid(unsafe_code)]

use std::io::{IsTerminal, Write, stderr};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use hapterra_tests::scene::run::Surface;
use hapterra_tests::scene::tile_supply::Buffers;
use hapterra_tests::soak::{LinkStats, SceneOutcome, Until, run, soak};

/// Violations of each invariant that are printed in full.
const MAX_SHOWN: usize = 3;

struct Request {
    minutes: f64,
    seed: u64,
    scene: Option<u64>,
    surface: Surface,
}

fn main() -> ExitCode {
    match parse_request() {
        Ok(Request {
            seed,
            scene: Some(scene),
            surface,
            ..
        }) => one(seed, scene, surface),
        Ok(request) => all(&request),
        Err(why) => {
            eprintln!("error: {why}\nhint: hapterra-soak MINUTES [--seed N] [--scene K] [--rough]");
            ExitCode::FAILURE
        }
    }
}

fn parse_request() -> Result<Request, String> {
    let mut request = Request {
        minutes: 1.0,
        seed: 1,
        scene: None,
        surface: Surface::Smooth,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut number = || {
            let given = words.next().and_then(|n| n.parse().ok());
            given.ok_or(format!("{word} wants a whole number"))
        };
        match word.as_str() {
            "--seed" => request.seed = number()?,
            "--rough" => request.surface = Surface::Rough,
            "--scene" => request.scene = Some(number()?),
            minutes => {
                let minutes = minutes.parse().ok().filter(|m: &f64| *m > 0.0);
                request.minutes = minutes.ok_or(format!("{word} is no number of minutes"))?;
            }
        }
    }
    Ok(request)
}

/// Repeats one scene by its number.
fn one(seed: u64, number: u64, surface: Surface) -> ExitCode {
    match run(seed, number, surface, &mut Buffers::default()) {
        SceneOutcome::Passed(kind, measured) => {
            println!("seed {seed}, scene {number}, {kind:?}: holds\n{measured:#?}");
            ExitCode::SUCCESS
        }
        SceneOutcome::Violated(kind, _, what) => {
            println!("seed {seed}, scene {number}, {kind:?}: {what}");
            ExitCode::FAILURE
        }
    }
}

fn all(request: &Request) -> ExitCode {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let time = Duration::from_secs_f64(request.minutes * 60.0);
    let began = Instant::now();
    let mut last = None;
    let stats = soak(
        request.seed,
        request.surface,
        0,
        Until::Time(time),
        threads,
        |stats| {
            let second = began.elapsed().as_secs();
            if last != Some(second) {
                last = Some(second);
                live(stats, began.elapsed(), time);
            }
        },
    );
    if stderr().is_terminal() {
        eprintln!();
    }
    println!(
        "seed {}, {:.1} minutes on {threads} threads\n{stats}",
        request.seed,
        began.elapsed().as_secs_f64() / 60.0
    );
    // Prints a few of each kind.
    let mut reported: std::collections::BTreeMap<&str, usize> = std::collections::BTreeMap::new();
    for broken in &stats.failed {
        let times = reported.entry(&broken.invariant).or_default();
        *times += 1;
        if *times > MAX_SHOWN {
            continue;
        }
        println!(
            "\n{:?}: {}\n    again: cargo xtask soak --seed {} --scene {}{}",
            broken.kind,
            broken.what,
            request.seed,
            broken.number,
            request.surface.option()
        );
    }
    if stats.failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Prints progress: one line, overwritten on a terminal, and once a minute elsewhere.
fn live(stats: &LinkStats, elapsed: Duration, time: Duration) {
    let terminal = stderr().is_terminal();
    if !terminal && !elapsed.as_secs().is_multiple_of(60) {
        return;
    }
    let (start, end) = if terminal { ("\r", "") } else { ("", "\n") };
    eprint!(
        "{start}{:4} of {} s: {} scenes, {:.1} million ticks, {} wrong answers{end}",
        elapsed.as_secs(),
        time.as_secs(),
        stats.scenes,
        stats.ticks() as f64 / 1e6,
        stats.failed.len()
    );
    let _ = stderr().flush();
}
