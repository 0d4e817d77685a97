//! Imports of the modules of core and firmware: no cycle of files or folders, and in core no import
//! against the order in `lib.rs`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A module: the names on its path from the crate's root.
type Module = Vec<String>;

/// The non-test modules of a crate: their code without comments and tests.
struct Sources {
    code: BTreeMap<Module, String>,
}

impl Sources {
    /// Reads the sources of a folder `src`.
    fn of(folder: &str) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("..")
            .join(folder);
        let mut files = vec![];
        rust_files(&root, &mut files);
        let module = |path: &Path| {
            let inside = path.strip_prefix(&root).expect("inside").with_extension("");
            let names = inside
                .iter()
                .map(|name| name.to_string_lossy().into_owned());
            let is_own = |name: &String| name != "mod" && name != "lib";
            names.filter(is_own).collect::<Module>()
        };
        let text = |path: &PathBuf| fs::read_to_string(path).expect("text");
        let mut code: BTreeMap<_, _> = files
            .iter()
            .map(|path| (module(path), without_tests(&text(path))))
            .collect();
        code.retain(|module, _| !module.iter().any(|name| is_of_tests(name)));
        Self { code }
    }

    /// A crate with these modules.
    #[cfg(test)]
    fn from_code(modules: &[(&str, &str)]) -> Self {
        let module = |name: &str| {
            let names = name.split("::").filter(|name| !name.is_empty());
            names.map(str::to_owned).collect::<Module>()
        };
        let code = modules
            .iter()
            .map(|(name, code)| (module(name), without_tests(code)));
        Self {
            code: code.collect(),
        }
    }

    /// The paths in a module's code, from the root.
    fn paths(&self, from: &Module) -> Vec<Module> {
        let words = words(&self.code[from]);
        let mut paths = vec![];
        for (at, word) in words.iter().enumerate() {
            let is_first = at == 0 || words[at - 1] != "::";
            // `pub(in crate::link)` imports nothing.
            let is_limit = at > 0 && words[at - 1] == "in";
            let base = match word.as_str() {
                "crate" => vec![],
                "self" => from.clone(),
                "super" => from[..from.len().saturating_sub(1)].to_vec(),
                "use" => {
                    // A child module, or another crate.
                    let is_child = |name: &String| {
                        let child = [from.as_slice(), std::slice::from_ref(name)].concat();
                        self.code.contains_key(&child)
                    };
                    if words.get(at + 1).is_some_and(is_child) {
                        tree(&words[at + 1..], from.clone(), &mut paths);
                    }
                    continue;
                }
                _ => continue,
            };
            let is_path = words.get(at + 1).is_some_and(|next| next == "::");
            if is_first && !is_limit && is_path {
                tree(&words[at + 2..], base, &mut paths);
            }
        }
        paths
    }

    /// The module at the end of a path, resolved through the imports of modules on the path.
    fn target(&self, path: &[String], depth: usize) -> Module {
        let known = (0..=path.len())
            .rev()
            .find(|n| self.code.contains_key(&path[..*n]));
        let known = known.unwrap_or_default();
        let module = path[..known].to_vec();
        let Some(item) = path.get(known).filter(|_| depth < 8) else {
            return module;
        };
        let re_exports = |path: &&Module| path.last() == Some(item);
        match self.paths(&module).iter().find(re_exports) {
            Some(further) if further.as_slice() != path => self.target(further, depth + 1),
            _ => module,
        }
    }

    /// Returns the imports between files and folders beside each other: the folder, the importing
    /// name and the imported name in it; with an example of such an import.
    fn imports(&self) -> BTreeMap<(Module, String, String), String> {
        let mut imports = BTreeMap::new();
        for from in self.code.keys() {
            for path in self.paths(from) {
                let to = self.target(&path, 0);
                let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
                // A module and its child modules count as one.
                if let (Some(a), Some(b)) = (from.get(same), to.get(same)) {
                    let place = (from[..same].to_vec(), a.clone(), b.clone());
                    let shown = format!("{} imports {}", from.join("::"), path.join("::"));
                    imports.entry(place).or_insert(shown);
                }
            }
        }
        imports
    }

    /// Cycles of imports, each as a list of its imports.
    fn cycles(&self) -> Vec<String> {
        let imports = self.imports();
        let leads_to = |folder: &Module, from: &String, to: &String| {
            let (mut visited, mut next) = (BTreeSet::new(), vec![from.clone()]);
            while let Some(name) = next.pop() {
                for (of, a, b) in imports.keys() {
                    if of == folder && *a == name && visited.insert(b.clone()) {
                        next.push(b.clone());
                    }
                }
            }
            visited.contains(to)
        };
        let in_cycle = imports
            .iter()
            .filter(|((folder, from, to), _)| leads_to(folder, to, from));
        in_cycle.map(|(_, shown)| shown.clone()).collect()
    }

    /// Imports against an order of the crate's modules: a module may import those before it and
    /// those at its own place. All modules may import those without a place.
    fn against(&self, order: &BTreeMap<String, usize>) -> Vec<String> {
        let place = |name: &String| order.get(name).copied().unwrap_or(0);
        let imports = self.imports();
        let wrong = imports
            .iter()
            .filter(|((folder, from, to), _)| folder.is_empty() && place(to) > place(from));
        wrong.map(|(_, shown)| shown.clone()).collect()
    }
}

/// Appends the paths of a tree of imports, `a::{b, c::d as e}`, which starts with these words.
/// Returns the number of words used.
fn tree(words: &[String], base: Module, paths: &mut Vec<Module>) -> usize {
    let (mut path, mut at) = (base, 0);
    loop {
        match words.get(at).map(String::as_str) {
            Some("{") => {
                at += 1;
                while words.get(at).is_some_and(|word| word != "}") {
                    at += tree(&words[at..], path.clone(), paths).max(1);
                }
                return at + 1;
            }
            Some("super") => drop(path.pop()),
            Some("self") => {}
            Some(word) if is_name(word) => path.push(word.to_owned()),
            _ => {
                paths.push(path);
                return at;
            }
        }
        at += 1;
        if words.get(at).is_none_or(|word| word != "::") {
            paths.push(path);
            return at;
        }
        at += 1;
    }
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Splits code into names, `::`, and other single signs.
fn words(code: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![];
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let mut was_part = false;
    for c in code.chars() {
        match words.last_mut() {
            Some(last) if was_part && is_part(c) => last.push(c),
            Some(last) if c == ':' && last == ":" => last.push(c),
            _ if !c.is_whitespace() => words.push(c.into()),
            _ => {}
        }
        was_part = is_part(c);
    }
    words
}

/// Returns true if a file or folder of this name contains tests or test helpers.
fn is_of_tests(name: &str) -> bool {
    let shared = ["tests", "testing", "cases", "dice"];
    shared.contains(&name) || name.ends_with("_tests")
}

/// Code without comments and without the modules after `#[cfg(test)]`.
fn without_tests(text: &str) -> String {
    let (mut is_test, mut is_next, mut code) = (false, false, String::new());
    for line in text.lines() {
        let is_attribute = line.starts_with("#[");
        let is_first = is_next && !is_attribute;
        is_test |= is_first;
        if !is_test {
            code += line.split("//").next().unwrap_or_default();
            code.push('\n');
        }
        // A one-line item, or the end of a module.
        is_test &= line != "}" && !(is_first && line.ends_with(';'));
        is_next = line == "#[cfg(test)]" || is_next && is_attribute;
    }
    code
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.extension() {
            _ if path.is_dir() => rust_files(&path, found),
            Some(kind) if kind == "rs" => found.push(path),
            _ => {}
        }
    }
}

/// The order of modules in core's `lib.rs`: the place of each name.
fn order_of_lib_rs() -> BTreeMap<String, usize> {
    let mut order = BTreeMap::new();
    let mut place = 0;
    for line in include_str!("../src/lib.rs").lines() {
        let Some(stated) = line.strip_prefix("//! ") else {
            place = 0;
            continue;
        };
        if let Some((number, _)) = stated.split_once(". ") {
            place = number.parse().unwrap_or(place);
        }
        let linked = stated
            .split("[`")
            .skip(1)
            .filter_map(|rest| rest.split_once("`]"));
        // A private module is listed by its file name.
        let files = stated
            .split('`')
            .filter_map(|word| word.strip_suffix(".rs"));
        let names = linked.map(|(name, _)| name).chain(files);
        for name in names.filter(|name| place > 0 && !name.contains("::")) {
            order.entry(name.to_owned()).or_insert(place);
        }
    }
    order
}

#[test]
fn imports_of_files_and_folders_form_no_cycle() {
    for folder in ["core/src", "firmware/src"] {
        let sources = Sources::of(folder);
        assert!(sources.imports().len() > 30, "{folder}: hardly an import");
        let cycles = sources.cycles();
        assert!(
            cycles.is_empty(),
            "{folder}: a circle of\n{}",
            cycles.join("\n")
        );
    }
}

#[test]
fn core_imports_follow_the_order_of_lib_rs() {
    let order = order_of_lib_rs();
    assert!(order.len() >= 10 && order["phantom"] == 1, "{order:?}");
    let wrong = Sources::of("core/src").against(&order);
    assert!(wrong.is_empty(), "against the order:\n{}", wrong.join("\n"));
}

#[test]
fn cycles_are_found_through_re_exports() {
    let tiles = "use super::Window;\n";
    let window =
        "use crate::terrain::{Kind, tile::Tile};\n#[cfg(test)]\nmod tests {\nuse crate::a::B;\n}\n";
    let terrain = "mod tile;\nmod window;\npub use tile::{Kind, Tile};\npub use window::Window;\n";
    let sources = |tiles| {
        Sources::from_code(&[
            ("", "pub mod terrain;"),
            ("terrain", terrain),
            ("terrain::tile", tiles),
            ("terrain::window", window),
        ])
    };
    assert_eq!(
        sources(tiles).cycles(),
        [
            "terrain::tile imports terrain::Window",
            "terrain::window imports terrain::Kind"
        ]
    );
    let none = sources(
        "// use super::Window;\nuse super::super::grid;\npub(in crate::terrain) struct T;\n",
    );
    assert!(none.cycles().is_empty());
}

#[test]
fn imports_against_the_order_are_found() {
    let sources = Sources::from_code(&[
        ("force", "fn f() -> crate::guard::Slew { g() }"),
        ("guard", "use crate::{force::Force, rate};"),
        ("rate", "use crate::force;"),
    ]);
    let order = BTreeMap::from([("force".into(), 5), ("guard".into(), 6)]);
    assert_eq!(
        sources.against(&order),
        ["force imports guard::Slew", "rate imports force"]
    );
}
