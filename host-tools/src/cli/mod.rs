//! The `hapterra` command line: one file a subcommand, each with its `Args`
//! and a `run`.
//!
//! - [`options`]: options that several subcommands share;
//! - [`terminal`]: progress, Ctrl-C, and prompts while a command runs;
//! - [`failure`] and `hints`: error messages and their remedies;
//! - `guardian`: the process that disarms the arm if the serving process ends abruptly;
//!   `worker_pipe`: the serving process's reports to it;
//! - [`report`]: the result that a command prints;
//! - `settings`: settings files and recordings in place of options;
//! - `old_subcommands` and `old_options`: names of earlier versions, and their replacements;
//! - `log` and `line_limit`: diagnostics, and a rate limit for lines that a device can cause.

pub mod bringup;
pub mod calibrate;
pub mod completions;
pub mod cut;
pub mod demo;
mod device_calibration;
pub mod failure;
pub mod flash;
mod guardian;
mod hints;
pub mod info;
mod line_limit;
pub mod list;
mod log;
pub mod man;
mod old_options;
mod old_subcommands;
pub mod options;
pub mod replay;
pub mod report;
pub mod run;
mod session_summary;
mod settings;
pub mod status;
pub mod terminal;
pub mod view;
pub mod viewing;
mod worker_pipe;

use std::ffi::OsString;
use std::io::Write as _;
use std::process::ExitCode;

use clap::error::ContextKind;
use clap::{ArgAction, Parser, Subcommand};

pub use failure::{Failure, OrHint};
use settings::Completed;
use terminal::writer;

/// Touch terrain of any size through a Phantom.
#[derive(Debug, Parser)]
#[command(name = "hapterra", version)]
pub struct Cli {
    /// Print more messages: -v progress, -vv details, -vvv everything
    #[arg(short, long, action = ArgAction::Count, global = true)]
    pub verbose: u8,

    /// Subcommand.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Show what a terrain file holds and how it would be streamed
    Info(info::Args),
    /// Write a terrain's heights for the page that touches it in a browser
    Cut(cut::Args),
    /// Serve a terrain to a device and record what it renders
    Run(run::Args),
    /// Run a whole session: a terrain, a board, a scripted hand, and a picture
    Demo(demo::Args),
    /// Render the forces along a trajectory, tick by tick
    Replay(replay::Args),
    /// Show a recording in the viewer, to scrub and replay
    View(view::Args),
    /// Show boards, debug probes and ports that can be seen from here
    List(list::Args),
    /// Show a device: calibration, what keeps it from arming, faults, figures
    Status(status::Args),
    /// Bring a board and its arm up for the first time, step by step, with a log
    Bringup(bringup::Args),
    /// Calibrate an arm: zero pose, ratios against a ruler, gravity
    Calibrate(calibrate::Args),
    /// Write an image to a board, through its debug probe or over USB
    Flash(flash::Args),
    /// Print the completions of a shell
    Completions(completions::Args),
    /// Write the manual pages
    Man(man::Args),
}

/// Runs the command with this process's arguments: 0 on success, 1 on failure, 2 on wrong usage.
pub fn main() -> ExitCode {
    let mut arguments = std::env::args_os();
    let name = arguments.next().unwrap_or_default();
    let own = std::env::current_exe().map_or(name, OsString::from);
    ExitCode::from(command_line(&[own], arguments))
}

/// Runs the command with these arguments and returns its exit code, as [`main`] does. `program`
/// restarts it: a program and the words before the arguments.
///
/// It handles signals and starts the log of this process, so call it only once.
pub fn command_line(program: &[OsString], arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli: Cli = match parse(arguments.clone()) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let may_arm = matches!(cli.command, Command::Run(_) | Command::Bringup(_));
    if may_arm && let Some(code) = guardian::watch(program, &arguments) {
        return code;
    }
    finish(cli.verbose, || match cli.command {
        Command::Info(args) => info::run(&args),
        Command::Cut(args) => cut::run(&args),
        Command::Run(args) => run::run(&args.pinned()),
        Command::Demo(args) => demo::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::View(args) => view::run(&args),
        Command::List(args) => list::run(&args),
        Command::Status(args) => status::run(&args),
        Command::Bringup(args) => bringup::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Flash(args) => flash::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    })
}

/// Parses the arguments after a program's name. If they are wrong or request help, prints the text
/// and returns the exit code.
///
/// # Errors
/// The exit code.
pub fn parse<P: Parser>(arguments: impl IntoIterator<Item = OsString>) -> Result<P, u8> {
    let command = P::command();
    let name = command.get_name().to_owned().into();
    let arguments = [name].into_iter().chain(arguments).collect();
    let Completed { arguments, line } =
        settings::complete(&command, arguments).map_err(|failure| {
            failure.report();
            1
        })?;
    // The guardian has already printed it.
    if let Some(line) = line.filter(|_| !worker_pipe::is_worker()) {
        eprintln!("{line}");
    }
    P::try_parse_from(&arguments).map_err(|mut error| {
        match error.use_stderr() {
            // The message repeats the arguments, which may contain text from elsewhere.
            true => {
                let option = || old_options::hint(&arguments, &error);
                let moved = old_subcommands::hint(&error)
                    .or_else(option)
                    .unwrap_or_default();
                if !moved.is_empty() {
                    // The parser's suggestion would contradict the hint.
                    error.remove(ContextKind::Suggested);
                    error.remove(ContextKind::SuggestedArg);
                }
                writer::write_text(std::io::stderr(), &format!("{}{moved}", error.render()));
            }
            // A closed pipe while help is printed is no error.
            false => _ = error.print(),
        }
        u8::try_from(error.exit_code()).unwrap_or(2)
    })
}

/// Runs a command with this process's log and returns its exit code. It handles signals, so call it
/// only once.
pub fn finish(verbose: u8, command: impl FnOnce() -> Result<(), Failure>) -> u8 {
    let log = log::to_stderr(verbose);
    let outcome = command();
    log.end();
    writer::finish();
    // Another program's process does not flush at its end.
    let _ = std::io::stdout().flush();
    let code = match outcome {
        Ok(()) => 0,
        Err(failure) => {
            failure.report();
            1
        }
    };
    heightfield_gdal::exit_if_stuck(code);
    code
}

#[cfg(test)]
mod help_tests;
