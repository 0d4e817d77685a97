//! The tests of each item of the safety page, from the tests' doc comments.
//!
//! A test is evidence for an item if its doc comment has a line such as `Safety: 4, 12.`

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

/// Folders whose tests are searched.
const FOLDERS: [&str; 7] = [
    "core/src",
    "heightfield/src",
    "firmware/src",
    "host-tools/src",
    "bench/src",
    "host-tools/tests",
    "tests",
];
const MARK: &str = "/// Safety: ";
const MAX_LINE: usize = 120;
const HEAD: &str = "\
# Traceability

<!-- Written by `cargo xtask docs --write`: change the doc comments of the tests. -->

The tests of each item of [safety](../safety.md#what-the-machine-does), by its number. `cargo xtask test` runs them.

";

/// Number of an item on the safety page, or a word for evidence of another kind.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Item {
    /// Number of an item.
    Number(u32),
    /// Another kind of evidence.
    Other(String),
}

impl Item {
    fn new(text: &str) -> Self {
        let text = text.trim();
        text.parse()
            .map_or_else(|_| Self::Other(text.to_owned()), Self::Number)
    }
}

/// Tests by item.
pub type Evidence = BTreeMap<Item, Vec<String>>;

/// Collects the marked tests of the repository, in the order of their files.
///
/// # Errors
/// A folder or file that cannot be read, and a mark without a test.
pub fn evidence(repository: &Path) -> io::Result<Evidence> {
    let mut found = Evidence::new();
    for folder in FOLDERS {
        add_folder(&repository.join(folder), &mut found)?;
    }
    Ok(found)
}

/// Returns the page.
#[must_use]
pub fn page(evidence: &Evidence) -> String {
    let mut page = HEAD.to_owned();
    for (item, tests) in evidence {
        let name = match item {
            Item::Number(number) => number.to_string(),
            Item::Other(name) => name.clone(),
        };
        let mut line = format!("- {name}:");
        for (at, test) in tests.iter().enumerate() {
            let end = if at + 1 < tests.len() { "," } else { "" };
            let word = format!(" `{test}`{end}");
            if line.chars().count() + word.chars().count() > MAX_LINE {
                let _ = writeln!(page, "{line}");
                " ".clone_into(&mut line);
            }
            line += &word;
        }
        let _ = writeln!(page, "{line}");
    }
    page
}

fn add_folder(folder: &Path, found: &mut Evidence) -> io::Result<()> {
    let mut paths: Vec<_> = fs::read_dir(folder)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<_, _>>()?;
    paths.sort();
    for path in paths {
        if path.is_dir() {
            add_folder(&path, found)?;
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            let source = fs::read_to_string(&path)?;
            add_source(&source, found)
                .map_err(|why| io::Error::other(format!("{}: {why}", path.display())))?;
        }
    }
    Ok(())
}

/// Adds the marked tests of a source file.
fn add_source(source: &str, found: &mut Evidence) -> Result<(), String> {
    let mut lines = source.lines().map(str::trim);
    while let Some(line) = lines.next() {
        let Some(items) = line.strip_prefix(MARK) else {
            continue;
        };
        let items = items
            .strip_suffix('.')
            .ok_or_else(|| format!("{line:?} needs a full stop"))?;
        let mut attributes = lines.by_ref().take_while(|line| !line.starts_with("fn "));
        let is_test = attributes.any(|line| line == "#[test]");
        // `any` has stopped at the attribute; the function is the next line that begins so.
        let name = lines.by_ref().find_map(|line| line.strip_prefix("fn "));
        let name = name
            .and_then(|name| name.split_once('('))
            .map(|(name, _)| name);
        let name = name
            .filter(|_| is_test)
            .ok_or_else(|| format!("{line:?} has no test"))?;
        for item in items.split(',') {
            found
                .entry(Item::new(item))
                .or_default()
                .push(name.to_owned());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a source in which `//# ` stands for the mark: this file is searched itself.
    fn read(source: &str) -> Result<Evidence, String> {
        let mut found = Evidence::new();
        add_source(&source.replace("//# ", MARK), &mut found).map(|()| found)
    }

    #[test]
    fn marked_tests_are_listed_by_item() {
        let source = "
            /// A test.
            ///
            //# 12, images.
            #[test]
            #[ignore = \"slow\"]
            fn one() {}

            #[test]
            fn two() {}

            //# 2.
            #[test]
            fn three() {}
        ";
        let page = page(&read(source).expect("marks"));
        let items: Vec<_> = page.lines().filter(|line| line.starts_with("- ")).collect();
        assert_eq!(items, ["- 2: `three`", "- 12: `one`", "- images: `one`"]);
    }

    #[test]
    fn marks_without_a_test_are_errors() {
        for source in [
            "//# 2.\nfn no_test() {}",
            "//# 2.",
            "//# 2\n#[test]\nfn no_full_stop() {}",
        ] {
            assert!(read(source).is_err(), "{source}");
        }
    }
}
