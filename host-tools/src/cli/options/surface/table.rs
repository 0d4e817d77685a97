//! A surface file of the user: TOML, with the default and further classes of the ground.
//!
//! ```toml
//! shading = "smooth"
//!
//! [default]
//! stiffness = "0.6 N/mm"
//!
//! [class.10]
//! name = "tree cover"
//! friction = 0.6
//! texture = "grain"
//! ```
//!
//! A quantity is a number in its default unit, or a text with a unit. A class inherits fields that
//! it does not state from the default.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

pub use super::material_entry::{MaterialEntry, PassivityName, ShadingName, TextureName};

use heightfield::printable_text::printable;
use heightfield::regular_file;

/// Maximum classes of a table: with the default, the number of materials that a device can store.
pub const MAX_CLASSES: usize = 15;
/// Size limit of a table, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Keys of earlier versions and their present names.
const RENAMED: [(&str, &str); 2] = [
    ("stiffness_n_per_mm", "stiffness"),
    ("damping_ns_per_m", "damping"),
];

/// A parsed table: the default, and the classes in order, each with its line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableFile {
    /// Shading of the force.
    pub shading: ShadingName,
    /// The passivity controller, on or off.
    pub passivity: PassivityName,
    /// Line and entry for samples without a class.
    pub default: (usize, MaterialEntry),
    /// Number, line and entry of each class.
    pub classes: Vec<(i64, usize, MaterialEntry)>,
}

/// Error of reading a table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read.
    #[error("{}: {why}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The reason.
        why: std::io::Error,
    },
    /// The text is no valid table.
    #[error("{}: {why}", file.display())]
    NoTable {
        /// The file.
        file: PathBuf,
        /// The parser's message, with the line.
        why: String,
    },
    /// One of the classes is invalid.
    #[error("{}, line {line}: {why}", file.display())]
    Class {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The fault.
        why: String,
    },
}

/// The file's TOML structure.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Written {
    shading: ShadingName,
    passivity: PassivityName,
    default: Option<Spanned<MaterialEntry>>,
    class: BTreeMap<String, Spanned<MaterialEntry>>,
}

/// A settings file, whose table `surface` is a surface.
#[derive(Deserialize)]
struct SettingsFile {
    surface: Written,
}

impl Written {
    /// Parses a surface, in its own file or in a settings file.
    fn read(text: &str) -> Result<Self, toml::de::Error> {
        let is_in_settings = toml::from_str::<toml::Table>(text)
            .is_ok_and(|file| file.get("surface").is_some_and(toml::Value::is_table));
        match is_in_settings {
            true => toml::from_str(text).map(|SettingsFile { surface }| surface),
            false => toml::from_str(text),
        }
    }
}

/// Describes a parse error, with the present name of a renamed key.
fn explained(why: &toml::de::Error) -> String {
    let text = why.to_string().trim_end().to_owned();
    let is_unknown = |(old, _): &&(&str, &str)| text.contains(&format!("unknown field `{old}`"));
    match RENAMED.iter().find(is_unknown) {
        Some((old, new)) => format!("{text}\n`{old}` is now `{new}`"),
        None => text,
    }
}

impl TableFile {
    /// Reads a table.
    ///
    /// # Errors
    /// [`TableError`], with the line.
    pub fn open(file: &Path) -> Result<Self, TableError> {
        let unreadable = |why| TableError::Unreadable {
            file: file.to_owned(),
            why,
        };
        let text = regular_file::read_text(file, MAX_BYTES).map_err(unreadable)?;
        Self::read(file, &text)
    }

    /// Reads the text of a table; `file` names it in errors.
    ///
    /// # Errors
    /// [`TableError`], with the line.
    pub fn read(file: &Path, text: &str) -> Result<Self, TableError> {
        let line_of = |at: usize| 1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count();
        let written = Written::read(text).map_err(|why| TableError::NoTable {
            file: file.to_owned(),
            why: explained(&why),
        })?;
        let bad = |line: usize, why: String| TableError::Class {
            file: file.to_owned(),
            line,
            why,
        };
        let mut classes: Vec<(i64, usize, MaterialEntry)> = Vec::new();
        for (number, entry) in written.class {
            let line = line_of(entry.span().start);
            let class = number.parse::<i64>().map_err(|_| {
                bad(
                    line,
                    format!("[class.{number}]: a class is a whole number, as [class.10]"),
                )
            })?;
            if let Some((_, other, _)) = classes.iter().find(|(known, ..)| *known == class) {
                return Err(bad(line, format!("class {class} is also in line {other}")));
            }
            classes.push((class, line, entry.into_inner()));
        }
        classes.sort_by_key(|(class, ..)| *class);
        if let Some((class, line, _)) = classes.get(MAX_CLASSES) {
            let count = classes.len();
            return Err(bad(
                *line,
                format!(
                    "class {class} is one too many: {count} classes, and at most {MAX_CLASSES} are possible; leave those out that may use the default"
                ),
            ));
        }
        let default = written.default.map_or_else(Default::default, |entry| {
            (line_of(entry.span().start), entry.into_inner())
        });
        let is_unprintable = |entry: &MaterialEntry| {
            let name = entry.name.as_deref().unwrap_or_default();
            printable(name) != name
        };
        let of_classes = classes.iter().map(|(_, line, entry)| (*line, entry));
        let mut all = std::iter::once((default.0, &default.1)).chain(of_classes);
        if let Some((line, _)) = all.find(|(_, entry)| is_unprintable(entry)) {
            let why = "its name has a character that does not print; leave it out";
            return Err(bad(line, why.to_owned()));
        }
        Ok(Self {
            shading: written.shading,
            passivity: written.passivity,
            default,
            classes,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<TableFile, String> {
        TableFile::read(Path::new("t.toml"), text).map_err(|bad| bad.to_string())
    }

    #[test]
    fn table_is_read_with_line_numbers() {
        let table = read(
            "# what\n[default]\nstiffness = 0.6\n\n[class.10]\nname = \"trees\"\nfriction = 0.6\ntexture = \"grain\"\n[class.-3]\n",
        );
        let table = table.expect("a table");
        assert_eq!(table.default.1.stiffness, Some(0.6));
        let (classes, lines): (Vec<_>, Vec<_>) = table
            .classes
            .iter()
            .map(|(class, line, _)| (*class, *line))
            .unzip();
        assert_eq!((classes, lines), (vec![-3, 10], vec![9, 5]));
        assert_eq!(table.classes[1].2.texture, Some(TextureName::Grain));
        assert_eq!(read("").expect("an empty table"), TableFile::default());
    }

    #[test]
    fn units_are_read_and_settings_files_have_a_surface() {
        let text = "shading = \"smooth\"\npassivity = \"off\"\n[default]\nstiffness = \"600 N/m\"\nviscous_friction = \"10ms\"\ntexture = \"grain\"\ntexture_amplitude = \"0.02 cm\"\n";
        let table = read(text).expect("a table");
        assert_eq!(table.shading, ShadingName::Smooth);
        assert_eq!(table.passivity, PassivityName::Off);
        let entry = &table.default.1;
        assert_eq!(
            (entry.stiffness, entry.viscous_friction),
            (Some(0.6), Some(0.01))
        );
        assert_eq!(entry.texture_amplitude, Some(0.2));
        let settings = "device = \"usb\"\n\n[surface.default]\nfriction = 0.4\n";
        let table = read(settings).expect("a table");
        assert_eq!(table.default.1.friction, Some(0.4));
        assert_eq!(table.default.0, 3);
    }

    #[test]
    fn oversized_table_is_refused_unread() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        // A sparse file, which needs no disk space.
        file.as_file().set_len(1 << 40).expect("sparse");
        let why = TableFile::open(file.path()).expect_err("a terabyte");
        assert!(
            why.to_string().contains("larger than 1048576 bytes"),
            "{why}"
        );
    }

    #[test]
    fn table_error_names_its_line() {
        for (text, expected) in [
            ("[default]\nfrictoin = 1\n", ["line 2", "frictoin"]),
            ("[class.10]\n\n[class.trees]\n", ["line 3", "whole number"]),
            ("[class.10]\n[class.010]\n", ["line 1", "class 10"]),
            ("[class.10]\n[class.10]\n", ["line 2", "duplicate"]),
            ("[class.1]\ntexture = \"wood\"\n", ["line 2", "wood"]),
            ("[class.1]\nfriction = \"much\"\n", ["line 2", "f32"]),
            ("[class.1]\ndamping = \"2 N\"\n", ["line 2", "Ns/m"]),
            ("[class.1]\ndamping = true\n", ["line 2", "its unit"]),
            (
                "[default]\nstiffness_n_per_mm = 1\n",
                ["line 2", "`stiffness_n_per_mm` is now `stiffness`"],
            ),
            (
                "tip = \"2mm\"\n[surface.default]\nfrictoin = 1\n",
                ["line 3", "frictoin"],
            ),
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
                expected.iter().all(|part| why.contains(part)),
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
