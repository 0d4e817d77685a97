//! The project's own commands, as `cargo xtask COMMAND`.
//!
//! Each command finds the programs that it needs, installs them if that is allowed, and reports its
//! progress. If it cannot continue, it prints the exact command to type.

mod board;
mod campaign;
mod census;
mod counts;
mod demo;
mod deny;
mod docs;
mod emulation;
mod flash;
mod fuzz;
mod image;
mod lint;
mod miri;
mod nightly;
mod page;
mod panics;
mod python;
mod run;
mod setup;
mod size;
mod soak;
mod test;
mod view;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::{Result, bail};
use lexopt::prelude::*;

const HELP: &str = "\
cargo xtask COMMAND

  demo [FILE] [-- ARGS]  touch a terrain file on the emulated board; without FILE,
                         its own synthetic terrain; ARGS go to `hapterra demo`
  demo --view [FILE]     the same, live in a browser; also builds the viewer
  demo --touch [FILE] [-o FOLDER]
                         touch it with the mouse on a page in a browser, no arm needed; -o:
                         only write the page's folder, for any web server
  page --test            run the page's tests, in a browser if one is installed
  view [--test|--pictures]
                         build the viewer; --test: run its tests, in a browser if one is
                         installed; --pictures: take the pictures in docs/
  python [--test]        build the Python package's wheel and print its path; --test: install
                         it in its own environment and run its tests; reports if Python 3.9
                         is missing
  test [--quick] [-- ARGS]
                         all tests, with images, budgets, dependencies, the page and the
                         Python package; failures are listed at the end; --quick: the
                         emulated board only, no dependencies, page and Python; ARGS go to
                         `cargo test` and select programs, as `--test link`
  lint                   formatting, clippy and documentation, warnings as errors
  census [--write]       words, options, public items, circles of files and lines of code, beside
                         the stored table and the bounds; --write: store these
  docs [--write]         the reference, figures and links of the book, and the book
                         itself if mdBook is installed; --write: write the reference anew
  setup                  only find or install what the commands need
  size [BOARD]           build the images and compare them with their flash and RAM budgets
  panics [BOARD]         build the images and prove that no interrupt can panic
  counts [--write]       instructions of a tick on the emulated Cortex-M4F, beside their
                         targets and the stored table; --write: store these
  cycles [--write|--all] cycles of a tick on the boards' chips, at most, beside the stored table;
                         --all: of all 12,500 random scenes
  soak MINUTES [--seed N] [--rough]  random scenes on all cores, every tick checked in f64
  soak --seed N --scene K [--rough]  one of them again
  campaign [--seconds N] [--seed S] [--segment K [--effects]]
                         the closed loop with faults injected at random, 10,000 s of arm time
                         by default; writes log/MONTH/campaign.md
  campaign --link [--seconds N] [--seed S] [--segment K]
                         faults of the link, killed and hostile hosts and devices, an hour of
                         device time by default; writes log/MONTH/link-campaign.md
  fuzz TARGET MINUTES    run libFuzzer on `terrain` (files of every format), `text` (recordings,
                         calibrations, tables, commands), `tick`, `tile` or `wire`; installs
                         cargo-fuzz and a nightly compiler if they are missing
  miri                   core's tests under Miri, if it can run
  deny                   licences, bans, sources and advisories of the dependencies of all
                         workspaces, also those of the viewer, Python and the fuzz targets
  image BOARD            build an image and print the path of its ELF
  flash BOARD            run an image on a real board with probe-rs

  HAPTERRA_TOOLCHAIN=rustup|distribution  builds the images only with this one
  HAPTERRA_QEMU=PATH                      the qemu-system-arm to use
  HAPTERRA_PYTHON=PATH                    the Python to test the Python package with
  HAPTERRA_TICK_HZ=1000..8000             haptic ticks a second of the real boards' images
";

fn main() -> ExitCode {
    match command() {
        Ok(code) => code,
        Err(why) => {
            // Not anyhow's own list, which may include a backtrace of xtask.
            let causes: Vec<_> = why.chain().map(ToString::to_string).collect();
            eprintln!("xtask: error: {}", causes.join("\n       caused by: "));
            ExitCode::FAILURE
        }
    }
}

fn command() -> Result<ExitCode> {
    if is_help(std::env::args_os().skip(1)) {
        print!("{HELP}");
        return Ok(ExitCode::SUCCESS);
    }
    let mut words = lexopt::Parser::from_env();
    let Some(word) = words.next()? else {
        bail!("name a command:\n\n{HELP}");
    };
    let name = match word {
        Value(name) => name.string()?,
        other => return Err(other.unexpected().into()),
    };
    match name.as_str() {
        "demo" => {
            let request = demo_words(&mut words)?;
            if request.touch {
                page::demo(request.file.as_ref(), request.out, &request.extra)?;
                return Ok(ExitCode::SUCCESS);
            }
            return demo::demo(&request).map(exit_code);
        }
        "test" => test::test(&test_words(&mut words)?)?,
        "soak" => soak::soak(words.raw_args()?.collect())?,
        "counts" => counts::counts(flag(&mut words, &["write"])?.is_some())?,
        "census" => census::census(flag(&mut words, &["write"])?.is_some())?,
        "docs" => docs::docs(flag(&mut words, &["write"])?.is_some())?,
        "cycles" => counts::cycles(flag(&mut words, &["write", "all"])?)?,
        "size" => test::check_sizes(&test::images(boards(&mut words)?)?)?,
        "panics" => test::check_panics(&test::images(boards(&mut words)?)?)?,
        "campaign" => campaign::campaign(words.raw_args()?)?,
        "image" => {
            let board = board::by_name(&words.value()?.string()?)?;
            for (_, path) in test::images(std::slice::from_ref(board))? {
                println!("{}", path.display());
            }
        }
        "fuzz" => {
            let mut word = || {
                words.value().map_err(|_| {
                    anyhow::anyhow!(
                        "name the target and the minutes: cargo xtask fuzz TARGET MINUTES"
                    )
                })
            };
            let (target, minutes) = (word()?.string()?, word()?);
            fuzz::fuzz(&target, &minutes.string()?)?;
        }
        "view" => match words.next()? {
            Some(Long("test")) => view::test()?,
            Some(Long("pictures")) => view::pictures()?,
            Some(other) => return Err(other.unexpected().into()),
            None => println!("{}", view::build()?.display()),
        },
        "page" => match words.next()? {
            Some(Long("test")) => page::test()?,
            Some(other) => return Err(other.unexpected().into()),
            None => bail!("type: cargo xtask page --test, or cargo xtask demo --touch"),
        },
        "python" => match flag(&mut words, &["test"])? {
            Some(_) => python::test()?,
            None => {
                if let Some((_, wheel)) = python::build()? {
                    println!("{}", wheel.display());
                }
            }
        },
        "flash" => flash::flash(board::by_name(&words.value()?.string()?)?)?,
        plain => {
            if let Some(extra) = words.next()? {
                return Err(extra.unexpected().into());
            }
            match plain {
                "lint" => lint::lint()?,
                "miri" => miri::miri()?,
                "setup" => setup()?,
                "deny" => deny::check_all()?,
                "help" => print!("{HELP}"),
                _ => bail!("there is no command {plain}:\n\n{HELP}"),
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns true if the words before `--` ask for help. Words after it belong to another program.
fn is_help(words: impl Iterator<Item = OsString>) -> bool {
    words
        .take_while(|word| word != "--")
        .any(|word| word == "-h" || word == "--help")
}

fn setup() -> Result<()> {
    let toolchain = setup::toolchain::ready()?;
    let qemu = setup::qemu::ready()?;
    setup::emulator::ready()?;
    run::report(format!(
        "ready: {toolchain:?} toolchain for the boards, {}",
        qemu.display()
    ));
    Ok(())
}

/// Parses `[BOARD]`: one board, or all.
fn boards(words: &mut lexopt::Parser) -> Result<&'static [board::Board]> {
    match words.next()? {
        None => Ok(&board::BOARDS),
        Some(Value(name)) => Ok(std::slice::from_ref(board::by_name(&name.string()?)?)),
        Some(other) => Err(other.unexpected().into()),
    }
}

/// Returns the given one of these flags.
fn flag(words: &mut lexopt::Parser, names: &[&'static str]) -> Result<Option<&'static str>> {
    let mut chosen = None;
    while let Some(word) = words.next()? {
        let named = |name: &&&str| matches!(&word, Long(long) if long == *name);
        chosen = match names.iter().find(named) {
            Some(name) => Some(*name),
            None => return Err(word.unexpected().into()),
        };
    }
    Ok(chosen)
}

/// Parses `[--quick] [-- ARGS]`: arguments after `--` are passed on unchanged.
fn test_words(words: &mut lexopt::Parser) -> Result<test::Request> {
    let mut request = test::Request::default();
    loop {
        let rest = words.raw_args()?;
        if rest.peek().is_some_and(|word| word == "--") {
            request.only = rest.skip(1).collect();
            return Ok(request);
        }
        match words.next()? {
            Some(Long("quick")) => request.quick = true,
            Some(other) => {
                let what = other.unexpected();
                bail!("{what}; arguments of `cargo test` come after `--`");
            }
            None => return Ok(request),
        }
    }
}

/// Parses `[--view|--touch [-o FOLDER]] [FILE] [-- ARGS]`: arguments after `--` are passed on
/// unchanged.
fn demo_words(words: &mut lexopt::Parser) -> Result<demo::Request> {
    let mut request = demo::Request::default();
    loop {
        let rest = words.raw_args()?;
        match rest.peek() {
            None => return Ok(request),
            Some(word) if word == "--" => {
                request.extra = rest.skip(1).collect();
                return Ok(request);
            }
            Some(_) => {}
        }
        match words.next()? {
            Some(Long("view")) => request.view = true,
            Some(Long("touch")) => request.touch = true,
            Some(Short('o') | Long("out")) if request.touch => {
                request.out = Some(words.value()?.into());
            }
            Some(Value(file)) if request.file.is_none() => request.file = Some(file),
            Some(other) => {
                let what = other.unexpected();
                match request.touch {
                    true => bail!(
                        "{what}; the surface is chosen on the page; options of `hapterra cut`, as \
                         --input, come after `--`"
                    ),
                    false => bail!("{what}; options of the run come after `--`"),
                }
            }
            None => return Ok(request),
        }
    }
}

/// Returns the exit code of a program, as far as this one can return it.
fn exit_code(code: i32) -> ExitCode {
    u8::try_from(code).map_or(ExitCode::FAILURE, ExitCode::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demo(words: &[&str]) -> Result<demo::Request> {
        demo_words(&mut lexopt::Parser::from_args(words))
    }

    #[test]
    fn arguments_after_two_dashes_are_passed_to_the_demo() {
        let request = demo(&["a.tif", "--", "--rounds", "3", "--"]).unwrap();
        assert_eq!(request.file, Some("a.tif".into()));
        assert_eq!(request.extra, ["--rounds", "3", "--"]);
        assert_eq!(demo(&["--", "b"]).unwrap().file, None);
        for out in ["-o", "--out"] {
            let touched = demo(&["--touch", out, "f", "a.tif"]).unwrap();
            assert_eq!((touched.touch, touched.out), (true, Some("f".into())));
        }
        let viewed = demo(&["--view", "a.tif"]).unwrap();
        assert_eq!((viewed.view, viewed.file), (true, Some("a.tif".into())));
        assert_eq!(demo(&[]).unwrap(), demo::Request::default());
    }

    #[test]
    fn test_arguments_follow_two_dashes() {
        let request = |words: &[&str]| test_words(&mut lexopt::Parser::from_args(words));
        let some = request(&["--quick", "--", "--test", "link"]).unwrap();
        assert!(some.quick);
        assert_eq!(some.only, ["--test", "link"]);
        assert_eq!(request(&[]).unwrap(), test::Request::default());
        let message = request(&["--test"]).unwrap_err().to_string();
        assert!(message.contains("after `--`"), "{message}");
    }

    #[test]
    fn help_is_found_before_two_dashes_only() {
        let has_help = |words: &[&str]| is_help(words.iter().map(OsString::from));
        assert!(has_help(&["demo", "--touch", "--help"]));
        assert!(has_help(&["test", "-h"]));
        assert!(!has_help(&["demo", "--", "--help"]));
        assert!(!has_help(&["demo", "help"]));
    }

    #[test]
    fn misplaced_option_is_explained() {
        let message = demo(&["a.tif", "--rounds", "3"]).unwrap_err().to_string();
        assert!(message.contains("after `--`"), "{message}");
        assert!(demo(&["a.tif", "b.tif"]).is_err());
    }
}
