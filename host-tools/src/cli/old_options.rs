//! Options of earlier versions, and their replacements.

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// A removed option.
struct RemovedOption {
    /// The commands that had the option.
    commands: &'static [&'static str],
    /// The option's name.
    name: &'static str,
    /// The replacement.
    now: &'static str,
    /// Second part of the replacement, for a key of a file.
    within: &'static str,
}

/// Commands that render a terrain.
const RENDERING: &[&str] = &["run", "demo", "replay", "view"];
/// Commands that place a terrain for an arm.
const PLACING: &[&str] = &["run", "demo"];
/// Commands that open a terrain.
const OPENING: &[&str] = &["run", "demo", "replay", "view", "info", "cut"];
/// Commands that emulate a board.
const EMULATING: &[&str] = &["demo", "replay", "status", "calibrate"];

/// Commands of `hapterra-lab` that draw a picture.
const DRAWING: &[&str] = &["contact", "streaming", "stability"];

/// The table's text for a key of a surface file.
const IN_SURFACE: &str = "--surface FILE.toml";

const fn old(
    commands: &'static [&'static str],
    name: &'static str,
    now: &'static str,
    within: &'static str,
) -> RemovedOption {
    RemovedOption {
        commands,
        name,
        now,
        within,
    }
}

/// Options of `hapterra`.
const OLD: &[RemovedOption] = &[
    old(&["run"], "--record", "-o FILE", ""),
    old(PLACING, "--seconds", "--duration 60s", ""),
    old(&["run"], "--silence-s", "--silence 10s", ""),
    old(
        &["run"],
        "--plant",
        "--device tcp:localhost:4000+plant:localhost:4001",
        "",
    ),
    old(PLACING, "--event-samples", "--events 4100,10", ""),
    old(PLACING, "--fit", "the default", ""),
    old(PLACING, "--at-lonlat", "--at 8.5,47 --crs lonlat", ""),
    old(
        PLACING,
        "--bbox-lonlat",
        "--bbox 8,46,9,47 --crs lonlat",
        "",
    ),
    old(PLACING, "--ground-m-per-mm", "--scale 5m/mm", ""),
    old(RENDERING, "--cell-mm", "--scale 1mm/cell", ""),
    old(
        RENDERING,
        "--height-mm-per-unit",
        "--exaggeration 0.05mm/unit",
        "",
    ),
    old(RENDERING, "--cells", "--input cells=stored", ""),
    old(&["info"], "--cells", "--input cells=stored", ""),
    old(RENDERING, "--stiffness-n-per-mm", "--stiffness 0.5N/mm", ""),
    old(RENDERING, "--max-force-n", "--max-force 8N", ""),
    old(RENDERING, "--material-table", IN_SURFACE, ""),
    old(
        RENDERING,
        "--static-friction",
        IN_SURFACE,
        "static_friction = 0.5",
    ),
    old(
        RENDERING,
        "--viscous-friction",
        IN_SURFACE,
        "viscous_friction = 0.01",
    ),
    old(RENDERING, "--damping-ns-per-m", IN_SURFACE, "damping = 2"),
    old(RENDERING, "--texture", IN_SURFACE, "texture = \"grain\""),
    old(
        RENDERING,
        "--texture-amplitude",
        IN_SURFACE,
        "texture_amplitude = 0.1",
    ),
    old(
        RENDERING,
        "--texture-wavelength",
        IN_SURFACE,
        "texture_wavelength = 1",
    ),
    old(
        RENDERING,
        "--texture-direction",
        IN_SURFACE,
        "texture_direction = 30",
    ),
    old(RENDERING, "--texture-seed", IN_SURFACE, "texture_seed = 1"),
    old(
        RENDERING,
        "--shading",
        IN_SURFACE,
        "shading = \"smooth\" at its top",
    ),
    old(
        RENDERING,
        "--passivity",
        IN_SURFACE,
        "passivity = \"off\" at its top",
    ),
    old(
        RENDERING,
        "--contact",
        "an option of hapterra-lab replay",
        "",
    ),
    old(OPENING, "--raw-size", "--input raw=512x400:i16:le", ""),
    old(OPENING, "--raw-type", "--input raw=512x400:i16:le", ""),
    old(OPENING, "--raw-endian", "--input raw=512x400:i16:le", ""),
    old(OPENING, "--no-data", "--input no-data=-9999", ""),
    old(OPENING, "--fill", "--input fill=16", ""),
    old(OPENING, "--band", "--input band=2", ""),
    old(OPENING, "--variable", "--input variable=depth", ""),
    old(OPENING, "--asset", "--input variable=dem", ""),
    old(OPENING, "--open-option", "--input gdal:NAME=VALUE", ""),
    old(OPENING, "--ground-cell-m", "--input cell=30m", ""),
    old(OPENING, "--vertical-unit", "--input height-unit=ft", ""),
    old(OPENING, "--encoding", "--input encoding=terrarium", ""),
    old(OPENING, "--png-channel", "--input channel=alpha", ""),
    old(OPENING, "--in-memory-mb", "--input in-memory=64MB", ""),
    old(OPENING, "--cache-dir", "--cache DIR", ""),
    old(OPENING, "--cache-mb", "--cache off", ""),
    old(EMULATING, "--image", "--device emulated:ELF", ""),
    old(
        EMULATING,
        "--qemu",
        "the environment variable HAPTERRA_QEMU",
        "",
    ),
    old(&["replay"], "--on", "--device emulated", ""),
    old(&["bringup"], "--log", "-o FILE.toml", ""),
    old(&["view"], "--rrd", "-o OUT.rrd", ""),
    old(&["replay", "cut", "calibrate"], "--output", "-o FILE", ""),
    old(
        &["view"],
        "--terrain",
        "the second argument, as view RECORDING TERRAIN",
        "",
    ),
    old(&["cut"], "--most-samples", "--max-samples 4000000", ""),
    old(&["calibrate"], "--no-walk", "--measure none", ""),
    old(
        &["calibrate"],
        "--skip-ratios",
        "--measure zero,gravity",
        "",
    ),
    old(
        &["calibrate"],
        "--unmeasured-ratios",
        "--measure zero,gravity,guessed-ratios",
        "",
    ),
    old(
        &["calibrate"],
        "--skip-gravity",
        "--measure zero,ratios",
        "",
    ),
];

/// Options of `hapterra-lab`.
const OLD_IN_LAB: &[RemovedOption] = &[
    old(&["stability"], "--delay-us", "--delay 200us", ""),
    old(DRAWING, "--picture", "-o FILE.png", ""),
    old(&["streaming"], "--latencies", "--latency 20ms,50ms", ""),
    old(&["synth"], "--cell-m", "--cell 10m", ""),
];

/// Returns a hint with the replacement if the error is an option of earlier versions.
pub(super) fn hint(arguments: &[OsString], error: &clap::Error) -> Option<String> {
    if error.kind() != ErrorKind::UnknownArgument {
        return None;
    }
    let Some(ContextValue::String(argument)) = error.get(ContextKind::InvalidArg) else {
        return None;
    };
    let name = argument.split('=').next()?;
    let is_typed = |command: &&str| arguments.iter().skip(1).any(|word| word == *command);
    let of_command = |old: &&RemovedOption| old.name == name && old.commands.iter().any(is_typed);
    let old = OLD.iter().chain(OLD_IN_LAB).find(of_command)?;
    let within = match old.within {
        "" => String::new(),
        key => format!(", with {key}"),
    };
    Some(format!("\nhint: {name} is now {}{within}\n", old.now))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::cli::Cli;

    /// Returns a command with its required arguments.
    fn arguments(command: &str) -> Vec<&str> {
        let rest: &[&str] = match command {
            "replay" => &["t.tif", "path.csv"],
            "status" | "calibrate" | "demo" | "bringup" => &[],
            _ => &["t.tif"],
        };
        [&["hapterra", command], rest].concat()
    }

    fn parse(command: &str, option: &str) -> Result<Cli, clap::Error> {
        let mut arguments = arguments(command);
        arguments.extend(option.split_whitespace());
        if ["replay", "cut"].contains(&command) && !option.starts_with("-o") {
            arguments.extend(["-o", "out"]);
        }
        Cli::try_parse_from(arguments)
    }

    #[test]
    fn old_options_name_the_new_ones() {
        for old in OLD {
            for command in old.commands {
                let error = parse(command, &format!("{}=1", old.name)).expect_err(old.name);
                let typed: Vec<_> = arguments(command).iter().map(OsString::from).collect();
                let line = hint(&typed, &error).expect(old.name);
                let now = format!("{} is now {}", old.name, old.now);
                assert!(line.contains(&now), "{command}: {line}");
                assert!(line.contains(old.within), "{line}");
                assert_eq!(error.exit_code(), 2);
            }
        }
        let error = parse("run", "--nonsense").expect_err("unknown");
        assert_eq!(hint(&["hapterra".into(), "run".into()], &error), None);
    }

    #[test]
    fn new_options_are_understood() {
        for old in OLD.iter().filter(|old| old.now.starts_with('-')) {
            for command in old.commands {
                let parsed = parse(command, old.now);
                assert!(parsed.is_ok(), "{command} {}: {:?}", old.now, parsed.err());
            }
        }
    }
}
