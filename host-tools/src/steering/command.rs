//! Commands as lines of text.

use hapterra_core::force::{Pattern, Shading, Texture};

use super::marks::text_of;
use super::{Action, Steer};
use crate::named_surfaces::NamedSurface;
use crate::place::{PlacementChange, SurfaceChange};
use crate::quantity::{ANGLE, DAMPING, GROUND_DISTANCE, LENGTH, TIME};
use heightfield::printable_text::printable;

/// The known commands, for messages.
pub const KNOWN_COMMANDS: &str = "pan EAST NORTH (5mm at the device, 100m on the ground), zoom TIMES, \
     exaggerate TIMES, surface ice|sand|rock, stiffness TIMES, friction MU [AT_REST], viscous-friction TIME (10ms), \
     damping DAMPING (2Ns/m), tip RADIUS (2mm), shading smooth|none, \
     texture grain|grating AMPLITUDE WAVELENGTH (0.1mm 1mm) [DIRECTION (30deg)], texture none, reset, \
     clutch on, clutch off, mark TEXT, enter NUMBER; `at TIME` (2.5s) before any of them, and before that \
     `on NUMBER` for one device of several";

/// A command and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// Seconds of the device's time since the beginning; by default it runs as soon as the earlier
    /// ones are done.
    pub at_s: Option<f64>,
    /// Action of the command.
    pub action: Action,
}

/// A line without a valid command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{line}` is no command ({why}); understood are: {KNOWN_COMMANDS}")]
pub struct CommandError {
    line: String,
    why: String,
}

/// Max characters of a line in a message.
const SHOWN: usize = 60;

/// Reads a line; returns `None` if it is empty or a comment after `#`. The text of a mark is all of
/// the line's rest, `#` included.
///
/// # Errors
/// [`CommandError`] lists the known commands.
pub fn parse(line: &str) -> Result<Option<Command>, CommandError> {
    let refused = |why| CommandError {
        line: beginning(line),
        why,
    };
    let (at_s, rest) = timed(line).map_err(refused)?;
    if let Some(text) = mark_in(rest) {
        let text = text_of(text).map_err(|why| refused(why.to_owned()))?;
        let action = Action::Mark(text);
        return Ok(Some(Command { at_s, action }));
    }
    let text = rest.split('#').next().unwrap_or_default();
    let words: Vec<_> = text.split_whitespace().collect();
    if words.is_empty() && at_s.is_none() {
        return Ok(None);
    }
    let action = match words[..] {
        ["enter", number] => number
            .parse()
            .map(Action::Enter)
            .map_err(|_| "a number is wanted".to_owned()),
        ["enter", ..] => Err("it takes the number of a question".to_owned()),
        _ => read(&words).map(Action::Steer),
    };
    let action = action.map_err(refused)?;
    Ok(Some(Command { at_s, action }))
}

/// Returns the beginning of a line for a message.
fn beginning(line: &str) -> String {
    let beginning: String = line.trim().chars().take(SHOWN).collect();
    printable(&beginning)
}

/// Removes and reads `at TIME` at the beginning of a line.
fn timed(line: &str) -> Result<(Option<f64>, &str), String> {
    let Some(rest) = after_word(line, "at") else {
        return Ok((None, line));
    };
    let rest = rest.trim_start();
    let time = rest.split(|c: char| c.is_whitespace() || c == '#').next();
    let time = time.unwrap_or_default();
    match TIME.read(time)? {
        at_s if at_s < 0.0 => Err("a time is not below zero".to_owned()),
        at_s => Ok((Some(at_s), rest.get(time.len()..).unwrap_or_default())),
    }
}

/// Returns the rest of a line after its first word `word`; `None` if the line begins differently.
fn after_word<'l>(line: &'l str, word: &str) -> Option<&'l str> {
    let rest = line.trim_start().strip_prefix(word)?;
    let ends = rest.chars().next().is_none_or(char::is_whitespace);
    ends.then_some(rest)
}

/// Returns the text of a mark, if the line has one.
fn mark_in(line: &str) -> Option<&str> {
    after_word(line, "mark")
}

fn read(words: &[&str]) -> Result<Steer, String> {
    let change = |change| Ok(Steer::Change(change));
    match words {
        ["pan", east, north] => change(pan(east, north)?),
        ["zoom", times] => change(PlacementChange::Zoom(factor(times)?)),
        ["exaggerate", times] => change(PlacementChange::Exaggerate(factor(times)?)),
        ["stiffness", times] => change(PlacementChange::Stiffness(factor(times)?)),
        [
            "surface" | "friction" | "viscous-friction" | "damping" | "shading" | "texture",
            ..,
        ] => change(PlacementChange::Surface(surface(words)?)),
        ["tip", radius] => change(PlacementChange::Tip(LENGTH.read(radius)?)),
        ["reset"] => change(PlacementChange::Reset),
        ["clutch", "on"] => Ok(Steer::Clutch(true)),
        ["clutch", "off"] => Ok(Steer::Clutch(false)),
        ["pan", ..] => Err("it takes two lengths".to_owned()),
        ["pan-m", ..] => Err("pan-m is now pan with a unit, such as pan 100m 0m".to_owned()),
        ["zoom" | "exaggerate" | "stiffness" | "tip", ..] => Err("it takes one number".to_owned()),
        ["clutch", ..] => Err("it is on or off".to_owned()),
        [] => Err("a command is missing".to_owned()),
        _ => Err("no such word".to_owned()),
    }
}

/// A length of a displacement.
enum Distance {
    /// At the device, mm.
    Device(f64),
    /// On the ground, m.
    Ground(f64),
}

fn distance(word: &str) -> Result<Distance, String> {
    let at_device = LENGTH.read(word).map(Distance::Device);
    at_device.or_else(|why| {
        let on_ground = GROUND_DISTANCE.read(word).map(Distance::Ground);
        on_ground.map_err(|_| format!("{why}; on the ground it is in m, km or ft"))
    })
}

/// Reads a displacement: two lengths at the device, or two distances on the ground.
fn pan(east: &str, north: &str) -> Result<PlacementChange, String> {
    use Distance::{Device, Ground};
    let on_ground = |east_m, north_m| Ok(PlacementChange::PanGround { east_m, north_m });
    match (distance(east)?, distance(north)?) {
        (Device(east_mm), Device(north_mm)) => Ok(PlacementChange::Pan { east_mm, north_mm }),
        (Ground(east_m), Ground(north_m)) => on_ground(east_m, north_m),
        (Ground(east_m), Device(0.0)) => on_ground(east_m, 0.0),
        (Device(0.0), Ground(north_m)) => on_ground(0.0, north_m),
        _ => Err("one length is at the device, the other on the ground".to_owned()),
    }
}

/// Reads a change of the surface.
fn surface(words: &[&str]) -> Result<SurfaceChange, String> {
    let number = |word| number(word).map(|number| number as f32);
    Ok(match words {
        ["surface", name] => {
            SurfaceChange::Named(NamedSurface::find(name).ok_or("it is ice, sand or rock")?)
        }
        ["surface", ..] => return Err("it is ice, sand or rock".to_owned()),
        ["friction", mu] => SurfaceChange::Friction {
            dynamic_mu: number(mu)?,
            static_mu: number(mu)?,
        },
        ["friction", mu, at_rest] => SurfaceChange::Friction {
            dynamic_mu: number(mu)?,
            static_mu: number(at_rest)?,
        },
        ["viscous-friction", viscous_s] => {
            SurfaceChange::ViscousFriction(TIME.read_single(viscous_s)?)
        }
        ["damping", ns_per_m] => SurfaceChange::Damping(DAMPING.read_single(ns_per_m)?),
        ["shading", "none"] => SurfaceChange::Shading(Shading::None),
        ["shading", "smooth"] => SurfaceChange::Shading(Shading::Smooth),
        ["texture", "none"] => SurfaceChange::Texture(Texture::NONE),
        ["texture", "grain", amplitude, wavelength] => SurfaceChange::Texture(Texture {
            pattern: Pattern::Grain,
            amplitude_mm: LENGTH.read_single(amplitude)?,
            wavelength_mm: LENGTH.read_single(wavelength)?,
            ..Texture::NONE
        }),
        ["texture", "grating", amplitude, wavelength, direction @ ..] => {
            SurfaceChange::Texture(Texture {
                pattern: Pattern::Grating,
                amplitude_mm: LENGTH.read_single(amplitude)?,
                wavelength_mm: LENGTH.read_single(wavelength)?,
                direction_deg: match direction {
                    [] => 0.0,
                    [degrees] => ANGLE.read_single(degrees)?,
                    _ => return Err("a grating takes two or three numbers".to_owned()),
                },
                seed: 0,
            })
        }
        ["friction", ..] => return Err("it takes one or two numbers".to_owned()),
        ["shading", ..] => return Err("it is smooth or none".to_owned()),
        ["texture", ..] => {
            let why = "it is none, or grain or grating with an amplitude and a wavelength";
            return Err(why.to_owned());
        }
        _ => return Err("it takes one number".to_owned()),
    })
}

fn number(word: &str) -> Result<f64, String> {
    let number = word.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| "a number without a unit is wanted".to_owned())
}

fn factor(word: &str) -> Result<f64, String> {
    match number(word)? {
        times if times > 0.0 => Ok(times),
        _ => Err("a factor is above zero".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::marks::MAX_MARK;
    use super::*;

    const fn of_surface(change: SurfaceChange) -> Steer {
        Steer::Change(PlacementChange::Surface(change))
    }

    #[test]
    fn each_steering_command_is_parsed() {
        let pan = PlacementChange::Pan {
            east_mm: 5.0,
            north_mm: -0.5,
        };
        let west = PlacementChange::PanGround {
            east_m: -1e3,
            north_m: 0.0,
        };
        for (line, at_s, steer) in [
            ("pan 5 -0.5", None, Steer::Change(pan)),
            ("pan 5mm -0.05cm", None, Steer::Change(pan)),
            ("  pan -1e3m 0m # west", None, Steer::Change(west)),
            ("pan -1km 0", None, Steer::Change(west)),
            (
                "at 2.5 zoom 2",
                Some(2.5),
                Steer::Change(PlacementChange::Zoom(2.0)),
            ),
            (
                "exaggerate 1.5",
                None,
                Steer::Change(PlacementChange::Exaggerate(1.5)),
            ),
            (
                "stiffness .5",
                None,
                Steer::Change(PlacementChange::Stiffness(0.5)),
            ),
            (
                "friction 0.3 .5",
                None,
                of_surface(SurfaceChange::Friction {
                    dynamic_mu: 0.3,
                    static_mu: 0.5,
                }),
            ),
            (
                "surface sand",
                None,
                of_surface(SurfaceChange::Named(
                    NamedSurface::find("sand").expect("named"),
                )),
            ),
            (
                "friction 0.4",
                None,
                of_surface(SurfaceChange::Friction {
                    dynamic_mu: 0.4,
                    static_mu: 0.4,
                }),
            ),
            (
                "viscous-friction 0.01",
                None,
                of_surface(SurfaceChange::ViscousFriction(0.01)),
            ),
            (
                "at 2500ms viscous-friction 10ms",
                Some(2.5),
                of_surface(SurfaceChange::ViscousFriction(0.01)),
            ),
            ("tip 2", None, Steer::Change(PlacementChange::Tip(2.0))),
            ("tip .5mm", None, Steer::Change(PlacementChange::Tip(0.5))),
            ("damping 2", None, of_surface(SurfaceChange::Damping(2.0))),
            (
                "damping 2Ns/m",
                None,
                of_surface(SurfaceChange::Damping(2.0)),
            ),
            (
                "texture grain 100um 1.5mm",
                None,
                of_surface(SurfaceChange::Texture(Texture {
                    pattern: Pattern::Grain,
                    amplitude_mm: 0.1,
                    wavelength_mm: 1.5,
                    ..Texture::NONE
                })),
            ),
            (
                "shading smooth",
                None,
                of_surface(SurfaceChange::Shading(Shading::Smooth)),
            ),
            (
                "texture none",
                None,
                of_surface(SurfaceChange::Texture(Texture::NONE)),
            ),
            (
                "texture grating .1mm 1.5 30deg",
                None,
                of_surface(SurfaceChange::Texture(Texture {
                    pattern: Pattern::Grating,
                    amplitude_mm: 0.1,
                    wavelength_mm: 1.5,
                    direction_deg: 30.0,
                    seed: 0,
                })),
            ),
            (
                "at 0 reset",
                Some(0.0),
                Steer::Change(PlacementChange::Reset),
            ),
            ("clutch\ton\r", None, Steer::Clutch(true)),
            ("clutch off", None, Steer::Clutch(false)),
        ] {
            let action = Action::Steer(steer);
            assert_eq!(parse(line), Ok(Some(Command { at_s, action })), "{line}");
        }
        let action = Action::Enter(7);
        assert_eq!(parse("enter 7"), Ok(Some(Command { at_s: None, action })));
        for nothing in ["", "  \r", "# a remark", "   # another"] {
            assert_eq!(parse(nothing), Ok(None));
        }
    }

    #[test]
    fn mark_text_is_the_rest_of_its_line() {
        for (line, at_s, text) in [
            ("mark a", None, "a"),
            (
                "  at 2 mark\ttrial #3, \"left\" 'µ' = [x]\r",
                Some(2.0),
                "trial #3, \"left\" 'µ' = [x]",
            ),
            ("mark mark at 2 zoom 3", None, "mark at 2 zoom 3"),
        ] {
            let action = Action::Mark(text.to_owned());
            assert_eq!(parse(line), Ok(Some(Command { at_s, action })), "{line}");
        }
        let longest = "µ".repeat(MAX_MARK);
        assert!(parse(&format!("mark {longest}")).is_ok());
        for (line, why) in [
            ("mark", "a text is missing"),
            ("mark \r", "a text is missing"),
            (&format!("mark x{longest}"), "at most 200 characters"),
            ("mark a\u{1b}[2J", "control character"),
            ("mark a\tb", "control character"),
            ("marks a", "no such word"),
        ] {
            let reported = parse(line).expect_err(line).to_string();
            assert!(reported.contains(why), "{reported}");
            assert!(!reported.contains(char::is_control), "{reported}");
        }
    }

    #[test]
    fn invalid_command_error_shows_line_reason_and_commands() {
        for (line, why) in [
            ("zom 2", "no such word"),
            ("zoom", "one number"),
            ("zoom 2 3", "one number"),
            ("zoom two", "a number"),
            ("stiffness 0.5N/mm", "without a unit"),
            ("zoom 0", "above zero"),
            ("zoom -1", "above zero"),
            ("zoom inf", "a number"),
            ("pan 5", "two lengths"),
            ("pan 5 nan", "a finite number in mm"),
            ("pan 5in 0", "on the ground it is in m, km or ft"),
            ("pan 5mm 3m", "the other on the ground"),
            ("pan-m 100 0", "now pan with a unit, such as pan 100m 0m"),
            ("tip 2m", "mm, cm, um"),
            ("surface", "ice, sand or rock"),
            ("surface mud", "ice, sand or rock"),
            ("friction", "one or two numbers"),
            ("friction a", "a number"),
            ("damping 1 2", "one number"),
            ("shading on", "smooth or none"),
            ("texture grain", "none, or grain or grating"),
            ("texture grain 0.1 1 30", "none, or grain or grating"),
            ("texture grating 0.1 1 30 2", "two or three numbers"),
            ("clutch", "on or off"),
            ("enter", "number of a question"),
            ("enter now", "a number"),
            ("at 2", "missing"),
            ("at -1 reset", "below zero"),
            ("at soon reset", "a number"),
            ("at 1 at 2 reset", "no such word"),
        ] {
            let reported = parse(line).expect_err(line).to_string();
            assert!(
                reported.contains(why) && reported.contains(line),
                "{reported}"
            );
            assert!(reported.contains("exaggerate TIMES"), "{reported}");
        }
        let long = parse(&"x".repeat(10_000)).expect_err("no command");
        assert!(long.to_string().len() < KNOWN_COMMANDS.len() + 2 * SHOWN);
    }
}
