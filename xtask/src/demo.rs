//! `cargo xtask demo [FILE]`: the main use, from set-up to picture.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::emulation::{Emulation, emulation};
use crate::run::{command_line, hapterra, report, root};
use crate::setup::gdal;
use crate::view;

/// Request of the user.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Request {
    /// Terrain file; `None` for the demo's own terrain.
    pub(crate) file: Option<OsString>,
    /// True if it is shown live.
    pub(crate) view: bool,
    /// True if it is touched on a page in a browser, without a device.
    pub(crate) touch: bool,
    /// Folder for the page, which is then only written and not served.
    pub(crate) out: Option<PathBuf>,
    /// Arguments that are passed to `hapterra demo` unchanged.
    pub(crate) extra: Vec<OsString>,
}

/// Builds the programs and runs `hapterra demo`; returns its exit code.
pub(crate) fn demo(request: &Request) -> Result<i32> {
    let emulation = match request.device().as_deref() {
        None => emulation_or_report(),
        Some("emulated") => Some(emulation()?),
        Some(_) => None,
    };
    if request
        .file
        .as_ref()
        .is_some_and(|file| gdal::is_needed_for(file.as_ref()))
    {
        gdal::ready_or_report();
    }
    let mut command = Command::new(hapterra(request.features())?);
    command.args(request.words(emulation.is_some()));
    if let Some(Emulation { image, qemu }) = &emulation {
        command.env("HAPTERRA_MPS2_ELF", image);
        command.env("HAPTERRA_QEMU", qemu);
    }
    if request.view {
        command.env("HAPTERRA_VIEW", view::build()?);
    }
    report(format!("running: {}", command_line(&command)));
    let status = command
        .status()
        .with_context(|| format!("cannot start `{}`", command_line(&command)))?;
    // `None`: ended by a signal.
    Ok(status.code().unwrap_or(1))
}

fn emulation_or_report() -> Option<Emulation> {
    emulation()
        .inspect_err(|why| {
            report(format!("the emulated board is not available: {why:#}"));
            report("so the same application runs compiled for this machine (--device native)");
        })
        .ok()
}

impl Request {
    /// Returns the value of `option` in the arguments for `hapterra demo`.
    fn value(&self, option: &str) -> Option<String> {
        let words: Vec<_> = self
            .extra
            .iter()
            .map(|word| word.to_string_lossy())
            .collect();
        words.iter().enumerate().find_map(|(i, word)| {
            let rest = word.strip_prefix(option)?;
            match rest.strip_prefix('=') {
                Some(value) => Some(value.to_string()),
                None if rest.is_empty() => words.get(i + 1).map(ToString::to_string),
                None => None,
            }
        })
    }

    /// Returns the device that the user has stated, if any.
    fn device(&self) -> Option<String> {
        self.value("--device")
    }

    /// Returns the features of the build for the file.
    fn features(&self) -> &'static [&'static str] {
        let file = self.file.as_ref().map(|file| file.to_string_lossy());
        match file.is_some_and(|file| file.contains("://")) {
            true => &["--features", "remote"],
            false => &[],
        }
    }

    /// Returns the arguments of the `hapterra` command.
    fn words(&self, is_emulated: bool) -> Vec<OsString> {
        let mut words: Vec<OsString> = vec!["demo".into()];
        words.extend(self.file.clone());
        // Any file has to work without a question: relief that suits the hand.
        if self.value("--exaggeration").is_none() {
            words.extend(["--exaggeration", "auto"].map(OsString::from));
        }
        if self.device().is_none() {
            let device = if is_emulated { "emulated" } else { "native" };
            words.extend(["--device", device].map(OsString::from));
        }
        if self.value("-o").or(self.value("--out")).is_none() {
            words.extend(["--out".into(), root().join("demo").into()]);
        }
        if self.view {
            words.push("--view".into());
        }
        words.extend(self.extra.iter().cloned());
        words
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(file: Option<&str>, extra: &[&str], emulated: bool) -> String {
        let request = Request {
            file: file.map(OsString::from),
            extra: extra.iter().map(OsString::from).collect(),
            ..Request::default()
        };
        let words = request.words(emulated);
        let words: Vec<_> = words.iter().map(|w| w.to_string_lossy()).collect();
        words.join(" ")
    }

    #[test]
    fn emulated_board_is_used_if_available() {
        let line = line(Some("a b.tif"), &["--out=x", "--duration", "3s"], true);
        assert_eq!(
            line,
            "demo a b.tif --exaggeration auto --device emulated --out=x --duration 3s"
        );
    }

    #[test]
    fn url_input_adds_build_features_and_a_path_adds_none() {
        let features = |file: &str| {
            let file = Some(file.into());
            let request = Request {
                file,
                ..Request::default()
            };
            request.features().len()
        };
        assert_eq!(features("https://h/a.tif"), 2);
        assert_eq!(features("C:/a.tif"), 0);
    }

    #[test]
    fn device_defaults_to_native_without_emulation() {
        for out in ["-o", "--out"] {
            let line = line(None, &[out, "x"], false);
            let expected = format!("demo --exaggeration auto --device native {out} x");
            assert_eq!(line, expected);
        }
    }

    #[test]
    fn device_option_of_the_user_is_kept() {
        let line = line(None, &["--device", "usb", "--out", "x"], false);
        assert_eq!(line, "demo --exaggeration auto --device usb --out x");
    }

    #[test]
    fn options_are_read_in_both_spellings() {
        let words = ["--device=emulated", "--outer", "x", "--out", "y"];
        let request = Request {
            view: true,
            extra: words.map(OsString::from).into(),
            ..Request::default()
        };
        assert_eq!(request.device().as_deref(), Some("emulated"));
        assert_eq!(request.value("--out").as_deref(), Some("y"));
        assert_eq!(request.value("--duration"), None);
        assert!(request.words(false).contains(&OsString::from("--view")));
    }

    #[test]
    fn relief_option_of_the_user_is_kept() {
        for relief in ["--exaggeration=1", "--exaggeration=2mm/unit"] {
            let line = line(None, &[relief, "--out", "x"], false);
            assert!(!line.contains("auto"), "{line}");
        }
    }

    #[test]
    fn results_default_to_the_workspace_demo_folder() {
        let line = line(None, &[], true);
        assert!(
            line.ends_with(&format!("--out {}", root().join("demo").display())),
            "{line}"
        );
    }
}
