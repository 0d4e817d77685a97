//! The pages of the reference that are generated: `cargo xtask docs` compares them, and `cargo
//! xtask docs --write` writes them.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use clap::builder::StyledStr;
use clap::{Arg, ArgAction, Command, CommandFactory as _};
use hapterra::replay::COLUMNS;
use hapterra_core::guard::{Blockers, Fault, Limits};
use hapterra_firmware::led::LedPattern;
use hapterra_tests::repository;

/// Longest line of a page, characters.
const MAX_LINE: usize = 120;
const MARK: &str = "<!-- Written by `cargo xtask docs --write`: change the texts in the code. -->";

/// Returns the text of a page of the reference.
fn read(page: &str) -> String {
    let path = repository().join("docs/reference").join(page);
    std::fs::read_to_string(path).unwrap_or_default()
}

/// Marks a generated table.
const TABLE: &str =
    "<!-- Written by `cargo xtask docs --write`: change the meanings in the code. -->";

/// Compares a page with the generated text, or writes it.
fn check(page: &str, text: &str) {
    let path = repository().join("docs/reference").join(page);
    if std::env::var_os("HAPTERRA_DOCS").is_some_and(|requested| requested == "write") {
        std::fs::write(&path, text).expect("written");
    }
    let recorded = read(page);
    let first = recorded
        .lines()
        .zip(text.lines())
        .find(|(old, new)| old != new);
    assert!(
        recorded == text,
        "docs/reference/{page} is old: type cargo xtask docs --write. First: {first:#?}"
    );
}

/// Appends one item of a list, in lines of the page's length.
fn item(page: &mut String, text: &str) {
    let mut line = "-".to_owned();
    for word in text.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > MAX_LINE {
            *page += &line;
            *page += "\n";
            line = " ".to_owned();
        }
        line += " ";
        line += word;
    }
    *page += &line;
    *page += "\n";
}

/// Returns a text as a sentence.
fn sentence(text: &str) -> String {
    let text = text.trim().trim_end_matches('.');
    let mut letters = text.chars();
    let first = letters
        .next()
        .map(|letter| letter.to_uppercase().to_string());
    format!("{}{}.", first.unwrap_or_default(), letters.as_str())
}

fn plain_text(text: Option<&StyledStr>) -> String {
    text.map(ToString::to_string).unwrap_or_default()
}

/// Returns the text of `-h` for an option or argument.
fn about(arg: &Arg) -> String {
    let short = arg.get_short().map(|short| format!("-{short}, "));
    let short = short.unwrap_or_default();
    let mut text = format!("`{short}{arg}`: {}", sentence(&plain_text(arg.get_help())));
    let takes_value = arg.get_action().takes_values();
    let values = arg.get_possible_values();
    let values = values
        .iter()
        .filter(|value| takes_value && !value.is_hide_set());
    let values: Vec<_> = values
        .map(|value| format!("`{}`", value.get_name()))
        .collect();
    if !values.is_empty() {
        // Writing to a String cannot fail.
        let _ = write!(text, " One of {}.", values.join(", "));
    }
    let defaults = arg.get_default_values().iter();
    let defaults: Vec<_> = defaults.map(|value| value.to_string_lossy()).collect();
    if takes_value && !defaults.is_empty() {
        let _ = write!(text, " Default: `{}`.", defaults.join(","));
    }
    text
}

/// Returns the options and arguments of this command alone: those of all commands are listed once.
fn own(command: &Command) -> Vec<&Arg> {
    let arguments = command.get_arguments();
    let is_own = |arg: &&Arg| {
        let is_of_all = arg.is_global_set()
            || matches!(arg.get_action(), ArgAction::Version)
            || matches!(
                arg.get_action(),
                ArgAction::Help | ArgAction::HelpShort | ArgAction::HelpLong
            );
        !is_of_all && !arg.is_hide_set()
    };
    arguments.filter(is_own).collect()
}

/// Appends a command's arguments and options. Those of several commands are only named.
fn subcommand(page: &mut String, program: &str, command: &Command, shared: &BTreeSet<String>) {
    let _ = write!(
        page,
        "\n## {program} {}\n\n{}\n\n",
        command.get_name(),
        sentence(&plain_text(command.get_about()))
    );
    let arguments = own(command);
    let (mut first, mut then): (Vec<&Arg>, Vec<&Arg>) =
        arguments.into_iter().partition(|arg| arg.is_positional());
    first.append(&mut then);
    let (documented, here): (Vec<&Arg>, Vec<&Arg>) =
        { first.into_iter() }.partition(|arg| shared.contains(&about(arg)));
    for arg in here {
        item(page, &about(arg));
    }
    if !documented.is_empty() {
        let names: Vec<_> = documented.iter().map(|arg| format!("`{arg}`")).collect();
        let link = "[Of several commands](#options-of-several-commands)";
        item(page, &format!("{link}: {}.", names.join(", ")));
    }
}

/// Returns the texts of all arguments of the programs, each with the names of the commands that
/// have it; a command of another program than the first has the program's name before its own.
fn texts(programs: &[Command]) -> BTreeMap<String, Vec<String>> {
    let mut texts = BTreeMap::<_, Vec<_>>::new();
    for (number, program) in programs.iter().enumerate() {
        for command in program.get_subcommands() {
            let name = match number {
                0 => command.get_name().to_owned(),
                _ => format!("{} {}", program.get_name(), command.get_name()),
            };
            for arg in own(command) {
                texts.entry(about(arg)).or_default().push(name.clone());
            }
        }
    }
    texts
}

/// Returns the option in a text.
fn option(text: &str) -> &str {
    text.split("`:").next().unwrap_or_default()
}

/// Returns the command of a program, in its parsed form.
fn built(mut command: Command) -> Command {
    command = command.term_width(100);
    command.build();
    command
}

#[test]
fn command_line_is_that_of_the_programs() {
    let programs = [
        built(hapterra::cli::Cli::command()),
        built(hapterra_lab::cli::Cli::command()),
    ];
    let is_option = |text: &&String| text.starts_with("`-");
    // Besides them --verbose, --help and --version.
    let all = 3 + texts(&programs[..1]).keys().filter(is_option).count();
    let mut run = programs[0]
        .find_subcommand("run")
        .expect("a command")
        .clone();
    let help = run.render_help().to_string();
    let lines = help.trim_end().lines().count();
    let is_listed = |line: &&str| line.trim_start().starts_with('-');
    let listed = help.lines().filter(is_listed).count();
    let mut page = format!(
        "# Command line\n\n{MARK}\n\n\
         This page lists the options of `hapterra` and `hapterra-lab`, as `-h` prints them. `--help` of a command explains\n\
         more. All commands take `-v` (up to `-vvv`) for more messages, `-h` and `--help`.\n\n\
         | size | |\n| --- | ---: |\n\
         | options of `hapterra` | {all} |\n\
         | options in `hapterra run -h` | {listed} |\n\
         | lines of `hapterra run -h` | {lines} |\n"
    );
    let mut shared = texts(&programs);
    shared.retain(|_, commands| commands.len() > 1);
    page += "\n## Options of several commands\n\n";
    for (text, commands) in &shared {
        // An option with two meanings: each names its commands.
        let is_ambiguous = shared
            .keys()
            .filter(|other| option(other) == option(text))
            .count()
            > 1;
        let commands = match is_ambiguous {
            true => format!(" Commands: `{}`.", commands.join("`, `")),
            false => String::new(),
        };
        item(&mut page, &format!("{text}{commands}"));
    }
    let shared: BTreeSet<String> = shared.into_keys().collect();
    for program in &programs {
        let commands = program.get_subcommands();
        for command in commands.filter(|command| command.get_name() != "help") {
            subcommand(&mut page, program.get_name(), command, &shared);
        }
    }
    check("command-line.md", &page);
}

#[test]
fn faults_are_those_of_the_code() {
    let mut page = format!(
        "# Faults, blockers, limits and the LED\n\n{MARK}\n\n\
         This page lists the faults, blockers and limits of a board, with the names of `hapterra status` and of recordings.\n\n\
         ## Faults\n\n\
         A fault switches the amplifiers off. It stays until it is cleared: `hapterra status --clear`.\n\n"
    );
    for fault in Fault::ALL {
        let (meaning, remedy) = (sentence(fault.meaning()), sentence(fault.remedy()));
        item(
            &mut page,
            &format!("**{} {fault:?}**: {meaning} {remedy}", fault.number()),
        );
    }
    page += "\n## Blockers\n\nA blocker prevents arming while its cause exists.\n\n";
    for (name, meaning) in Blockers::all().meanings() {
        item(&mut page, &format!("`{name}`: {}", sentence(meaning)));
    }
    page +=
        "\n## Limits\n\nA limit is a reason why the force differs from the surface's force.\n\n";
    for (name, meaning) in Limits::all().meanings() {
        item(&mut page, &format!("`{name}`: {}", sentence(meaning)));
    }
    page += "\n## LED\n\n| state | status LED |\n| --- | --- |\n";
    for (state, looks) in LedPattern::MEANINGS {
        let _ = writeln!(page, "| {state} | {looks} |");
    }
    check("faults.md", &page);
}

#[test]
fn columns_of_recordings_are_those_of_the_code() {
    let page = read("recordings.md");
    let (before, rest) = page.split_once(TABLE).expect("the table's mark");
    let (_, after) = rest.split_once("\n\n").expect("text after the table");
    let rows = COLUMNS.iter().map(|(names, meaning)| {
        let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
        format!("| {} | {meaning} |", names.join(", "))
    });
    let rows: Vec<_> = rows.collect();
    let head = "| column | meaning |\n| --- | --- |";
    check(
        "recordings.md",
        &format!("{before}{TABLE}\n{head}\n{}\n\n{after}", rows.join("\n")),
    );
}
