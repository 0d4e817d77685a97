//! The table of materials as a user writes it: TOML, by class.
//!
//! ```toml
//! [default]
//! stiffness_n_per_mm = 0.6
//!
//! [class.10]
//! name = "tree cover"
//! friction = 0.6
//! texture = "grain"
//! ```
//!
//! The names are those of the command's options. What a class does not state is the default's, and
//! what the default does not state is as the options say.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use heightfield::regular_file;
use heightfield::shown::shown;

/// Most classes that a table names: with the default, as many materials as a device has room
/// for.
pub const MOST_CLASSES: usize = 15;
/// A longer file is no table, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// What a table says of one material; nothing where it says nothing.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Look {
    /// What it is called.
    pub name: Option<String>,
    /// As `--stiffness-n-per-mm`.
    pub stiffness_n_per_mm: Option<f32>,
    /// As `--friction`.
    pub friction: Option<f32>,
    /// As `--static-friction`.
    pub static_friction: Option<f32>,
    /// As `--viscous-friction`.
    pub viscous_friction: Option<f32>,
    /// As `--damping-ns-per-m`.
    pub damping_ns_per_m: Option<f32>,
    /// As `--texture`.
    pub texture: Option<TextureName>,
    /// As `--texture-amplitude`.
    pub texture_amplitude: Option<f32>,
    /// As `--texture-wavelength`.
    pub texture_wavelength: Option<f32>,
    /// As `--texture-direction`.
    pub texture_direction: Option<f32>,
    /// As `--texture-seed`.
    pub texture_seed: Option<u32>,
}

/// A texture by the name that `--texture` gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TextureName {
    /// The surface is even.
    None,
    /// Heights at random.
    Grain,
    /// Ridges.
    Grating,
}

/// A table that was read: the default, and the classes in their order, each with its line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableFile {
    /// Where there is no class.
    pub default: (usize, Look),
    /// By class.
    pub classes: Vec<(i64, usize, Look)>,
}

/// What is wrong with a table.
#[derive(Debug, thiserror::Error)]
pub enum BadTable {
    /// It cannot be read.
    #[error("{}: {why}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        why: std::io::Error,
    },
    /// It is no such TOML.
    #[error("{}: {why}", file.display())]
    NoTable {
        /// The file.
        file: PathBuf,
        /// What was found, and in which line.
        why: String,
    },
    /// One of its classes.
    #[error("{}, line {line}: {why}", file.display())]
    Class {
        /// The file.
        file: PathBuf,
        /// The line, from 1 on.
        line: usize,
        /// What is wrong.
        why: String,
    },
}

/// The file as TOML has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default)]
    default: Option<Spanned<Look>>,
    #[serde(default)]
    class: BTreeMap<String, Spanned<Look>>,
}

impl TableFile {
    /// Reads a table.
    ///
    /// # Errors
    /// [`BadTable`], with the line.
    pub fn open(file: &Path) -> Result<Self, BadTable> {
        let unreadable = |why| BadTable::Unreadable {
            file: file.to_owned(),
            why,
        };
        let text = regular_file::read_text(file, MAX_BYTES).map_err(unreadable)?;
        Self::read(file, &text)
    }

    /// Reads the text of a table; `file` names it in errors.
    ///
    /// # Errors
    /// [`BadTable`], with the line.
    pub fn read(file: &Path, text: &str) -> Result<Self, BadTable> {
        let line_of = |at: usize| 1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count();
        let written: Written = toml::from_str(text).map_err(|why| BadTable::NoTable {
            file: file.to_owned(),
            why: why.to_string().trim_end().to_owned(),
        })?;
        let bad = |line: usize, why: String| BadTable::Class {
            file: file.to_owned(),
            line,
            why,
        };
        let mut classes: Vec<(i64, usize, Look)> = Vec::new();
        for (number, look) in written.class {
            let line = line_of(look.span().start);
            let class = number.parse::<i64>().map_err(|_| {
                bad(
                    line,
                    format!("[class.{number}]: a class is a whole number, as [class.10]"),
                )
            })?;
            if let Some((_, other, _)) = classes.iter().find(|(known, ..)| *known == class) {
                return Err(bad(line, format!("class {class} is in line {other}, too")));
            }
            classes.push((class, line, look.into_inner()));
        }
        classes.sort_by_key(|(class, ..)| *class);
        if let Some((class, line, _)) = classes.get(MOST_CLASSES) {
            let count = classes.len();
            return Err(bad(
                *line,
                format!(
                    "class {class} is one too many: {count} classes, and at most {MOST_CLASSES} can be told apart; leave those out that may feel as the default"
                ),
            ));
        }
        let default = written.default.map_or_else(Default::default, |look| {
            (line_of(look.span().start), look.into_inner())
        });
        let is_unprintable = |look: &Look| {
            let name = look.name.as_deref().unwrap_or_default();
            shown(name) != name
        };
        let of_classes = classes.iter().map(|(_, line, look)| (*line, look));
        let mut all = std::iter::once((default.0, &default.1)).chain(of_classes);
        if let Some((line, _)) = all.find(|(_, look)| is_unprintable(look)) {
            let why = "its name has a character that does not print; leave it out";
            return Err(bad(line, why.to_owned()));
        }
        Ok(Self { default, classes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<TableFile, String> {
        TableFile::read(Path::new("t.toml"), text).map_err(|bad| bad.to_string())
    }

    #[test]
    fn a_table_comes_with_its_lines() {
        let table = read(
            "# what\n[default]\nstiffness_n_per_mm = 0.6\n\n[class.10]\nname = \"trees\"\nfriction = 0.6\ntexture = \"grain\"\n[class.-3]\n",
        );
        let table = table.expect("a table");
        assert_eq!(table.default.1.stiffness_n_per_mm, Some(0.6));
        let (classes, lines): (Vec<_>, Vec<_>) = table
            .classes
            .iter()
            .map(|(class, line, _)| (*class, *line))
            .unzip();
        assert_eq!((classes, lines), (vec![-3, 10], vec![9, 5]));
        assert_eq!(table.classes[1].2.texture, Some(TextureName::Grain));
        assert_eq!(read("").expect("nothing is said"), TableFile::default());
    }

    #[test]
    fn a_file_that_is_no_table_is_not_read_to_its_end() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        // All holes: it takes no room.
        file.as_file().set_len(1 << 40).expect("sparse");
        let why = TableFile::open(file.path()).expect_err("a terabyte");
        assert!(
            why.to_string().contains("larger than 1048576 bytes"),
            "{why}"
        );
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, wanted) in [
            ("[default]\nfrictoin = 1\n", ["line 2", "frictoin"]),
            ("[class.10]\n\n[class.trees]\n", ["line 3", "whole number"]),
            ("[class.10]\n[class.010]\n", ["line 1", "class 10"]),
            ("[class.10]\n[class.10]\n", ["line 2", "duplicate"]),
            ("[class.1]\ntexture = \"wood\"\n", ["line 2", "wood"]),
            ("[class.1]\nfriction = \"much\"\n", ["line 2", "f32"]),
            ("classes = 3\n", ["line 1", "classes"]),
            (
                "[class.1]\n[class.2]\nname = \"\\u001b[2J\"\n",
                ["line 2", "does not print"],
            ),
            (
                "[default]\nname = \"a\\nb\"\n",
                ["line 1", "does not print"],
            ),
        ] {
            let why = read(text).expect_err(text);
            assert!(
                wanted.iter().all(|part| why.contains(part)),
                "{text}: {why}"
            );
        }
        let many: String = (0..16).map(|class| format!("[class.{class}]\n")).collect();
        let why = read(&many).expect_err("16");
        assert!(
            why.contains("line 16") && why.contains("at most 15"),
            "{why}"
        );
    }
}
