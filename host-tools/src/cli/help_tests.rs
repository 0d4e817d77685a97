//! Tests of the size of the command line's help.

use std::collections::BTreeSet;

use clap::{CommandFactory as _, Parser as _};

use super::Cli;

/// Output of `hapterra run -h` at 100 columns.
const RUN: &str = include_str!("run_help.txt");

#[test]
fn short_help_of_run_fits_a_screen() {
    let mut command = Cli::command().term_width(100);
    command.build();
    let run = command.find_subcommand_mut("run").expect("run");
    let help = run.render_help().to_string();
    assert_eq!(help, RUN, "\n{help}");
    assert!(help.lines().count() <= 60, "{} lines", help.lines().count());
    let options = help
        .lines()
        .filter(|line| line.trim_start().starts_with('-'));
    assert!(options.count() <= 24);
}

#[test]
fn options_are_few() {
    let command = Cli::command();
    let mut options = BTreeSet::new();
    for subcommand in command.get_subcommands() {
        let own = subcommand.get_opts();
        // Count options that several commands share only once.
        let own = own.map(|it| (it.get_long(), it.get_help().map(ToString::to_string)));
        options.extend(own);
    }
    assert!(options.len() < 65, "{}: {options:?}", options.len());
}

#[test]
fn formats_option_excludes_others() {
    let parsed = |words: &[&str]| Cli::try_parse_from([&["hapterra", "info"], words].concat());
    assert!(parsed(&["--formats"]).is_ok());
    for words in [
        &["--formats", "--bogus"][..],
        &["--formats", "t.tif"],
        &["--formats", "--json"],
        &[],
    ] {
        let error = parsed(words).expect_err("refused");
        assert_eq!(error.exit_code(), 2, "{words:?}");
    }
}
