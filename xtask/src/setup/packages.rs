//! The system's package manager.

use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::run::{on_path, output, run_quietly, say, shown};

/// What one thing is called by each package manager; `None` where it has no package.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Packages {
    /// Debian, Ubuntu.
    pub(crate) apt: Option<&'static str>,
    /// Fedora.
    pub(crate) dnf: Option<&'static str>,
    /// Arch.
    pub(crate) pacman: Option<&'static str>,
    /// Homebrew on macOS.
    pub(crate) brew: Option<&'static str>,
}

/// A package manager this program can call.
#[derive(Debug)]
struct Manager {
    program: &'static str,
    verb: &'static str,
    /// Options that keep it from asking and from installing what is not needed.
    unattended: &'static [&'static str],
    needs_root: bool,
}

const MANAGERS: [Manager; 4] = [
    Manager {
        program: "apt-get",
        verb: "install",
        unattended: &["-y", "--no-install-recommends"],
        needs_root: true,
    },
    Manager {
        program: "dnf",
        verb: "install",
        unattended: &["-y"],
        needs_root: true,
    },
    Manager {
        program: "pacman",
        verb: "-S",
        unattended: &["--noconfirm", "--needed"],
        needs_root: true,
    },
    Manager {
        program: "brew",
        verb: "install",
        unattended: &[],
        needs_root: false,
    },
];

impl Packages {
    fn of(&self, manager: &str) -> Option<&'static str> {
        match manager {
            "apt-get" => self.apt,
            "dnf" => self.dnf,
            "pacman" => self.pacman,
            _ => self.brew,
        }
    }
}

/// Installs `wanted` with the first package manager found.
///
/// The error says what to type, where there is something to type.
pub(crate) fn install(wanted: &Packages) -> Result<()> {
    let Some(manager) = MANAGERS.iter().find(|m| on_path(m.program).is_some()) else {
        bail!("no package manager known to this program (apt-get, dnf, pacman, brew) is here");
    };
    let Some(names) = wanted.of(manager.program) else {
        bail!("{} has no package for it", manager.program);
    };
    manager
        .install(names)
        .with_context(|| format!("type: {}", manager.typed(names)))
}

impl Manager {
    fn install(&self, names: &str) -> Result<()> {
        let prefix = rights(self.needs_root)?;
        let attempt = || -> Result<()> {
            let mut command = prefixed(&prefix, self.program);
            command
                .arg(self.verb)
                .args(self.unattended)
                .args(names.split(' '));
            command.env("DEBIAN_FRONTEND", "noninteractive");
            say(format!("installing: {}", shown(&command)));
            run_quietly(&mut command)
        };
        let first = attempt();
        if first.is_ok() || self.program != "apt-get" {
            return first;
        }
        say("refreshing apt's package lists, then once more");
        // A failing list of some third party must not stop the one needed here.
        let _ = run_quietly(prefixed(&prefix, self.program).arg("update"));
        attempt()
    }

    /// What a person would type.
    fn typed(&self, names: &str) -> String {
        let sudo = if self.needs_root { "sudo " } else { "" };
        format!("{sudo}{} {} {names}", self.program, self.verb)
    }
}

/// What comes before a command that needs root: nothing for root, else `sudo -n`.
fn rights(needs_root: bool) -> Result<Vec<&'static str>> {
    let is_root = output(Command::new("id").arg("-u")).is_some_and(|id| id.trim() == "0");
    if !needs_root || is_root {
        return Ok(vec![]);
    }
    // -n: never ask for a password in the middle of someone's build.
    if output(Command::new("sudo").args(["-n", "true"])).is_some() {
        return Ok(vec!["sudo", "-n"]);
    }
    bail!("not root here, and sudo would ask for a password")
}

fn prefixed(prefix: &[&str], program: &str) -> Command {
    let mut words = prefix.iter().copied().chain([program]);
    let mut command = Command::new(words.next().unwrap_or(program));
    command.args(words);
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_to_type_is_short_and_asks_for_root_where_needed() {
        let lines = MANAGERS.each_ref().map(|m| m.typed("qemu"));
        assert_eq!(
            lines,
            [
                "sudo apt-get install qemu",
                "sudo dnf install qemu",
                "sudo pacman -S qemu",
                "brew install qemu"
            ]
        );
    }

    #[test]
    fn a_prefix_comes_before_the_program() {
        assert_eq!(
            shown(prefixed(&["sudo", "-n"], "dnf").arg("x")),
            "sudo -n dnf x"
        );
        assert_eq!(shown(&prefixed(&[], "brew")), "brew");
    }
}
