//! Every command line of README.md and the book is parsed by its program, and run if it needs
//! neither a board nor a server.

mod run;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::CommandFactory as _;
use clap::error::ErrorKind;
use hapterra_tests::repository;

/// Programs whose lines are checked.
const PROGRAMS: [&str; 3] = ["hapterra", "hapterra-lab", "cargo"];

/// A command line of a page.
struct Line {
    page: PathBuf,
    text: String,
    /// True in a block: a whole line, to be typed unchanged.
    is_block: bool,
    /// Text that `printf` before it writes to its standard input.
    input: Option<String>,
}

fn pages() -> Vec<PathBuf> {
    let (mut pages, mut folders) = (vec![repository().join("README.md")], vec![]);
    folders.push(repository().join("docs"));
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().expect("a folder") {
            let path = entry.expect("readable").path();
            match path.extension() {
                None if path.is_dir() => folders.push(path),
                Some(kind) if kind == "md" => pages.push(path),
                _ => {}
            }
        }
    }
    pages.sort();
    pages
}

/// Returns the command lines of a page: lines of blocks, and code in text.
fn lines(page: &Path, text: &str) -> Vec<Line> {
    let line = |text: &str, is_block| Line {
        page: page.to_owned(),
        text: text.trim().trim_start_matches("$ ").to_owned(),
        is_block,
        input: None,
    };
    let piped = |printf: &str, text: &str| Line {
        input: shlex::split(printf).and_then(|words| Some(words.get(1)?.replace("\\n", "\n"))),
        ..line(text, true)
    };
    let (mut found, mut is_code) = (vec![], false);
    for written in text.replace("\\\n", " ").lines() {
        if written.starts_with("```") {
            is_code = !is_code;
        } else if is_code || written.starts_with("    ") {
            found.push(match written.trim().split_once(" | ") {
                Some((printf, text)) if printf.starts_with("printf ") => piped(printf, text),
                _ => line(written, true),
            });
        } else {
            found.extend(
                written
                    .split('`')
                    .skip(1)
                    .step_by(2)
                    .map(|code| line(code, false)),
            );
        }
    }
    let of_program = |line: &Line| {
        let mut words = line.text.split(' ');
        words.next().is_some_and(|first| PROGRAMS.contains(&first)) && words.next().is_some()
    };
    found.retain(of_program);
    found
}

/// Returns the words of a line, up to a comment or a second command; `[FILE]` counts as FILE, and
/// cargo that runs `hapterra-lab` as that program.
fn words(text: &str) -> Vec<String> {
    let words = shlex::split(text).unwrap_or_default();
    let ends = |word: &String| ["|", "&&", ">", "<"].contains(&word.as_str());
    let words = words.into_iter().take_while(|word| !ends(word));
    let mut words: Vec<_> = words.map(|word| word.replace(['[', ']'], "")).collect();
    let lab = ["cargo", "run", "-r", "-p", "hapterra-lab", "--"];
    if words.starts_with(&lab.map(str::to_owned)) {
        words.splice(..lab.len(), ["hapterra-lab".to_owned()]);
    }
    words
}

/// Returns true if a word is a placeholder, such as FILE.
fn is_placeholder(word: &str) -> bool {
    let is_upper = |c: char| c.is_ascii_uppercase() || "_.…,|=".contains(c);
    word.contains(char::is_uppercase) && word.chars().all(is_upper) || word.contains('…')
}

/// Parses a line of `hapterra` or `hapterra-lab`; the error is the program's message.
fn parsed(command: clap::Command, words: &[String], is_block: bool) -> Result<(), String> {
    // Parsing this option prints the list and ends the program.
    if words.iter().any(|word| word == "--formats") {
        return Ok(());
    }
    let error = match command.try_get_matches_from(words) {
        Ok(_) => return Ok(()),
        Err(error) => error,
    };
    let is_name = words.iter().any(|word| is_placeholder(word));
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => Ok(()),
        ErrorKind::MissingRequiredArgument
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
            if !is_block =>
        {
            Ok(())
        }
        ErrorKind::ValueValidation | ErrorKind::InvalidValue if is_name => Ok(()),
        _ => Err(error.to_string()),
    }
}

/// Checks that a line of cargo names existing commands and options of xtask, packages and folders.
fn cargo(words: &[String]) -> Result<(), String> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    if let ["cargo", "xtask", command, ref more @ ..] = words[..] {
        let help = include_str!("../../../xtask/src/main.rs");
        let lines: Vec<&str> = help.lines().collect();
        let starts = |line: &&str| line.split_whitespace().next() == Some(command);
        if !lines
            .iter()
            .any(|line| line.starts_with("  ") && starts(line))
            && command != "help"
        {
            return Err(format!("cargo xtask has no command {command}"));
        }
        let own = more.iter().take_while(|word| **word != "--");
        let mut options = own.filter(|word| word.starts_with("--"));
        return match options.find(|option| !help.contains(**option)) {
            Some(option) => Err(format!("cargo xtask {command} has no option {option}")),
            None => Ok(()),
        };
    }
    for (option, value) in words.iter().zip(words.iter().skip(1)) {
        let manifest = repository().join(value).join("Cargo.toml");
        match *option {
            "--path" if !manifest.is_file() && !value.starts_with("..") => {
                return Err(format!("there is no {}", manifest.display()));
            }
            "-p" | "--package" => drop(manifest_of(value)?),
            _ => {}
        }
    }
    Ok(())
}

/// Checks that cargo can choose a program to run: in the package there is one, or a default, or the
/// line names it.
fn chooses_program(words: &[&str]) -> Result<(), String> {
    let own = words.iter().take_while(|word| **word != "--");
    let value = |option| own.clone().skip_while(move |word| **word != option).nth(1);
    let Some(package) = value("-p") else {
        return Ok(());
    };
    let manifest = manifest_of(package)?;
    let has_choice = manifest.matches("[[bin]]").count() > 1 && !manifest.contains("default-run");
    match has_choice && value("--bin").or(value("--example")).is_none() {
        true => Err(format!("cargo cannot choose a program of {package}")),
        false => Ok(()),
    }
}

/// Returns the text of the manifest of a package in the workspace.
///
/// # Errors
/// If there is no such package.
fn manifest_of(package: &str) -> Result<String, String> {
    let workspace = include_str!("../../../Cargo.toml");
    let members = workspace.lines().find(|line| line.starts_with("members"));
    let folders = members.unwrap_or_default().split('"').skip(1).step_by(2);
    let named = format!("[package]\nname = \"{package}\"\n");
    folders
        .filter_map(|it| std::fs::read_to_string(repository().join(it).join("Cargo.toml")).ok())
        .find(|manifest| manifest.contains(&named))
        .ok_or_else(|| format!("there is no package {package}"))
}

fn check(line: &Line) -> Result<(), String> {
    // As typed: below, cargo that runs `hapterra-lab` counts as that program.
    let typed: Vec<&str> = line.text.split_whitespace().collect();
    if typed.starts_with(&["cargo", "run"]) {
        chooses_program(&typed)?;
    }
    let words = words(&line.text);
    match words.first().map(String::as_str) {
        Some("hapterra") => parsed(hapterra::cli::Cli::command(), &words, line.is_block),
        Some("hapterra-lab") => parsed(hapterra_lab::cli::Cli::command(), &words, line.is_block),
        _ => cargo(&words),
    }
}

#[test]
fn programs_take_every_command_line_of_the_pages() {
    let (mut count, mut wrong) = (0, String::new());
    for page in pages() {
        let text = std::fs::read_to_string(&page).expect("readable");
        for line in lines(&page, &text) {
            count += 1;
            if let Err(why) = check(&line) {
                let (page, text) = (line.page.display(), &line.text);
                // Writing to a String cannot fail.
                let _ = writeln!(wrong, "{page}: {text}\n{why}");
            }
        }
    }
    println!("{count} command lines");
    assert!(count > 80, "only {count} command lines");
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn wrong_lines_are_found() {
    let page = "```sh\nhapterra info FILE --fell  # a comment\nhapterra info\ncargo xtask sing\n\
                cargo xtask view --tset\ncargo install --locked --path no/where\n```\n\
                Text with `hapterra stability`, `cargo run -p nothing` and `cargo run -r -p hapterra-tests`.\n";
    let right = "```sh\nhapterra info FILE --json  # a comment\nhapterra run FILE --device \\\n  native\n\
                 cargo xtask test -- --test link\ncargo install --locked --path host-tools\n\
                 printf 'mark a\\n' | hapterra run FILE --commands -\n```\n\
                 Text with `hapterra run`, `hapterra.read()` and `cargo run -r -p hapterra-lab -- synth`.\n";
    let found = |text: &str| {
        let lines = lines(Path::new("page.md"), text);
        (
            lines.len(),
            lines.iter().filter(|line| check(line).is_err()).count(),
        )
    };
    assert_eq!(found(page), (8, 8));
    assert_eq!(found(right), (7, 0));
    let piped = lines(Path::new("page.md"), right).remove(4);
    assert_eq!(piped.input.as_deref(), Some("mark a\n"));
}
