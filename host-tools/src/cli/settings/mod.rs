//! Settings from a settings file or a recording, used as options.
//!
//! Each setting becomes an argument, `--name=value`, before the user's own. An option on the
//! command line or in the environment replaces all arguments for it. Therefore a setting is parsed,
//! checked and explained like its option.

mod file;
mod recorded;

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, CommandFactory, ValueHint};

use super::Cli;
use super::failure::{Failure, OrHint};
use super::options::input::InputSetting;
use super::options::recording::settings_of;
use super::options::scale::MapScale;
use crate::terrain::HapticCells;
pub(super) use recorded::differences;

/// The default settings file, read if it exists.
const DEFAULT_FILE: &str = "hapterra.toml";
/// The commands that read a settings file.
const COMMANDS: [&str; 3] = ["run", "demo", "replay"];
/// Options that a settings file must not contain.
const NOT_IN_FILE: [&str; 4] = ["settings", "help", "version", "verbose"];

/// The settings file to read.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Settings")]
pub struct SettingsOption {
    /// FILE.toml, a recording, or none
    ///
    /// [default: hapterra.toml, if it exists] Its keys are the names of options, as device = "usb" and scale = "5m/mm"; [surface.default] may
    /// have a surface in place. Options given on the command line win.
    #[arg(long, value_name = "FILE|none", value_hint = ValueHint::FilePath)]
    pub settings: Option<PathBuf>,
}

impl SettingsOption {
    /// Returns the settings file to read, if any; it must not be an output.
    pub(in crate::cli) fn file(&self) -> Option<PathBuf> {
        match &self.settings {
            Some(path) => Some(path.clone()).filter(|path| path.as_os_str() != "none"),
            None => Some(PathBuf::from(DEFAULT_FILE)).filter(|path| path.exists()),
        }
    }
}

/// A setting.
struct Setting {
    /// Name of the option.
    name: String,
    /// Values, as on the command line; empty for a flag.
    values: Vec<OsString>,
    /// Source of the setting, for messages.
    place: String,
}

/// The arguments of a command with its settings.
pub(super) struct Completed {
    /// The arguments.
    pub(super) arguments: Vec<OsString>,
    /// A line that names the settings file that was read.
    pub(super) line: Option<String>,
}

/// Adds settings to the arguments of a command; the first argument is the program's name.
///
/// # Errors
/// A settings file or a recording cannot be read; a setting is no option, or its value is invalid.
pub(super) fn complete(command: &Command, arguments: Vec<OsString>) -> Result<Completed, Failure> {
    let as_typed = |arguments| Completed {
        arguments,
        line: None,
    };
    let command = with_optional_arguments(command);
    // The final parse explains errors in the user's arguments.
    let Ok(matches) = command.clone().try_get_matches_from(&arguments) else {
        return Ok(as_typed(arguments));
    };
    let Some((name, of_command)) = matches.subcommand() else {
        return Ok(as_typed(arguments));
    };
    let Some(options) = command.find_subcommand(name) else {
        return Ok(as_typed(arguments));
    };
    let mut sources = Vec::from_iter(of_recording(name, of_command)?);
    let from_file = of_file(name, of_command)?;
    let line = from_file
        .as_ref()
        .map(|(path, _)| format!("settings       {}", path.display()));
    sources.extend(from_file.map(|(_, settings)| settings));
    let mut given: BTreeSet<String> = options
        .get_arguments()
        .filter(|option| is_given(of_command, option))
        .filter_map(|option| option.get_long().map(str::to_owned))
        .collect();
    let mut keys = input_keys(of_command);
    let mut before = Vec::new();
    for settings in sources {
        let names: Vec<_> = settings
            .iter()
            .map(|setting| setting.name.clone())
            .collect();
        for setting in settings {
            before.extend(arguments_of(
                &command, options, &given, &mut keys, &setting,
            )?);
        }
        given.extend(names);
    }
    let place = arguments
        .iter()
        .position(|argument| argument == name)
        .map_or(1, |at| at + 1);
    let mut arguments = arguments;
    arguments.splice(place..place, before);
    Ok(Completed { arguments, line })
}

/// Returns the command line with all options optional.
fn with_optional_arguments(command: &Command) -> Command {
    let mut command = command.clone();
    for subcommand in command.get_subcommands_mut() {
        *subcommand = subcommand.clone().mut_args(|arg| arg.required(false));
    }
    command.build();
    command
}

/// Returns true if an option is on the command line or in the environment.
fn is_given(matches: &ArgMatches, option: &Arg) -> bool {
    let from = matches.value_source(option.get_id().as_str());
    matches!(
        from,
        Some(ValueSource::CommandLine | ValueSource::EnvVariable)
    )
}

/// Returns the keys of the user's `--input`, which settings do not replace.
fn input_keys(matches: &ArgMatches) -> BTreeSet<String> {
    let given = matches.try_get_raw("input").ok().flatten();
    let given = given.into_iter().flatten();
    given.map(key_of).collect()
}

/// Returns the key of `KEY=VALUE`.
fn key_of(value: &OsStr) -> String {
    let text = value.to_string_lossy();
    let key = text.split('=').next().unwrap_or_default();
    key.to_owned()
}

/// Returns the settings of the recording to replay or show.
fn of_recording(name: &str, matches: &ArgMatches) -> Result<Option<Vec<Setting>>, Failure> {
    let argument = match name {
        "replay" => "trajectory",
        "view" => "recording",
        _ => return Ok(None),
    };
    let ignores = matches.get_flag("ignore_settings");
    let path = matches.get_one::<PathBuf>(argument);
    match path.filter(|path| !ignores && path.is_file()) {
        Some(path) => {
            let settings = settings_of(path)?;
            Ok(settings.map(|it| recorded::settings(path, &it, explicit_options(matches))))
        }
        None => Ok(None),
    }
}

/// Returns the scale and the kind of cells that the user states.
fn explicit_options(matches: &ArgMatches) -> (Option<MapScale>, Option<HapticCells>) {
    let scale = matches.try_get_one::<MapScale>("scale");
    let input = matches.try_get_many::<InputSetting>("input").ok().flatten();
    let cells = input.into_iter().flatten().find_map(InputSetting::cells);
    (scale.ok().flatten().copied(), cells)
}

/// Returns the settings file of a command and its settings.
fn of_file(name: &str, matches: &ArgMatches) -> Result<Option<(PathBuf, Vec<Setting>)>, Failure> {
    if !COMMANDS.contains(&name) {
        return Ok(None);
    }
    let settings = matches.get_one::<PathBuf>("settings").cloned();
    let Some(path) = (SettingsOption { settings }).file() else {
        return Ok(None);
    };
    if path
        .extension()
        .is_some_and(|extension| extension == "toml")
    {
        let command = Cli::command();
        let settings = file::read(&path, |key| is_known(&command, key))?;
        return Ok(Some((path, settings)));
    }
    let settings = settings_of(&path)?
        .ok_or_else(|| {
            format!(
                "{} is neither a recording with settings nor a .toml",
                path.display()
            )
        })
        .or_hint("name a recording or a FILE.toml with --settings")?;
    let settings = recorded::settings(&path, &settings, explicit_options(matches));
    Ok(Some((path, settings)))
}

/// Returns true if one of the commands has this option.
fn is_known(command: &Command, name: &str) -> bool {
    let mut commands = COMMANDS
        .iter()
        .filter_map(|known| command.find_subcommand(known));
    !NOT_IN_FILE.contains(&name) && commands.any(|known| option(known, name).is_some())
}

fn option<'c>(command: &'c Command, name: &str) -> Option<&'c Arg> {
    let mut options = command.get_arguments();
    options.find(|option| option.get_long() == Some(name))
}

/// Returns the arguments of a setting; none if a given option replaces or excludes it, or the
/// command has no such option.
fn arguments_of(
    command: &Command,
    of: &Command,
    given: &BTreeSet<String>,
    keys: &mut BTreeSet<String>,
    setting: &Setting,
) -> Result<Vec<OsString>, Failure> {
    let name = setting.name.as_str();
    let Some(option) = option(of, name) else {
        return Ok(vec![]);
    };
    let is_given = |other: &&Arg| other.get_long().is_some_and(|name| given.contains(name));
    let is_against = |other: &Arg| {
        let has = |one, other| of.get_arg_conflicts_with(one).contains(&other);
        has(option, other) || has(other, option)
    };
    let is_input = name == "input";
    let is_out =
        (!is_input && given.contains(name)) || of.get_arguments().filter(is_given).any(is_against);
    if is_out {
        return Ok(vec![]);
    }
    let is_flag = matches!(option.get_action(), ArgAction::SetTrue);
    let mut arguments = Vec::new();
    for value in &setting.values {
        if is_input && !keys.insert(key_of(value)) {
            continue;
        }
        let argument = match (is_flag, value.to_str()) {
            (true, Some("true")) => format!("--{name}").into(),
            (true, Some("false")) => continue,
            (true, _) => {
                return Err(format!("{}: {name} must be true or false", setting.place))
                    .or_hint("write it without quotation marks");
            }
            (false, _) => {
                let mut argument = OsString::from(format!("--{name}="));
                argument.push(value);
                argument
            }
        };
        check(command, of.get_name(), &argument, setting)?;
        arguments.push(argument);
    }
    Ok(arguments)
}

/// Checks that the command accepts an argument of a setting.
fn check(
    command: &Command,
    name: &str,
    argument: &OsStr,
    setting: &Setting,
) -> Result<(), Failure> {
    let program = OsStr::new("hapterra");
    let arguments = [program, OsStr::new(name), argument];
    let Err(error) = command.clone().try_get_matches_from(arguments) else {
        return Ok(());
    };
    let text = error.render().to_string();
    let what = text.lines().next().unwrap_or_default();
    let what = what.strip_prefix("error: ").unwrap_or(what);
    Err(format!("{}: {what}", setting.place)).or_hint(format!(
        "hapterra {name} --help lists the values of --{}",
        setting.name
    ))
}

#[cfg(test)]
mod tests;
