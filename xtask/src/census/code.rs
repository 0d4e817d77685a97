//! Lines of code, public items, and cycles of modules.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

use super::files;

/// Extensions of code files.
const CODE: [&str; 5] = ["rs", "py", "js", "c", "h"];
/// Beginnings of public items.
const ITEMS: [&str; 9] = [
    "fn ", "const ", "struct ", "enum ", "union ", "trait ", "type ", "static ", "mod ",
];

/// Measures of the code in a folder.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Code {
    /// Lines that are neither empty nor comments, outside test files.
    pub(super) lines: usize,
    /// The same in test files.
    pub(super) tests: usize,
    /// Lines in `src/` that make an item public.
    pub(super) public: usize,
}

/// Counts the code in a folder.
pub(super) fn code(folder: &Path) -> Result<Code> {
    let mut all = Code::default();
    for path in files(folder)? {
        let kind = path.extension().unwrap_or_default().to_string_lossy();
        if !CODE.contains(&&*kind) {
            continue;
        }
        let text = fs::read(&path).with_context(|| path.display().to_string())?;
        let text = String::from_utf8_lossy(&text);
        let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy();
        let is_test = folder.ends_with("tests") || name.contains("test");
        let lines = lines_of_code(&text, &kind);
        match is_test {
            true => all.tests += lines,
            false => all.lines += lines,
        }
        if name.starts_with("src") && !is_test {
            all.public += text.lines().filter(|line| is_public(line)).count();
        }
    }
    Ok(all)
}

/// Returns the number of lines that are neither empty nor comments.
fn lines_of_code(text: &str, kind: &str) -> usize {
    let comment = if kind == "py" { "#" } else { "//" };
    let lines = text.lines().map(str::trim);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with(comment))
        .count()
}

fn is_public(line: &str) -> bool {
    let item = line.trim_start().strip_prefix("pub ");
    item.is_some_and(|item| ITEMS.iter().any(|kind| item.starts_with(kind)))
}

/// Returns the cycles of modules in a crate's `src/`: files of which each uses the next, and the
/// last the first. A module and its submodules count as one, so uses between them are no cycle.
pub(super) fn import_cycles(source: &Path) -> Result<Vec<Vec<String>>> {
    let mut texts = BTreeMap::new();
    for path in files(source)? {
        let name = path.strip_prefix(source).unwrap_or(&path);
        let mut parts: Vec<_> = { name.iter() }
            .map(|part| part.to_string_lossy().into_owned())
            .collect();
        let file = parts.pop().unwrap_or_default();
        match file.strip_suffix(".rs") {
            None => continue,
            Some("mod" | "lib" | "main") => {}
            Some(file) => parts.push(file.to_owned()),
        }
        if !name.to_string_lossy().contains("test") {
            texts.insert(parts.join("::"), fs::read_to_string(&path)?);
        }
    }
    let edges: BTreeMap<&str, Vec<&str>> = { texts.iter() }
        .map(|(name, text)| (name.as_str(), imports(name, text, &texts)))
        .collect();
    let reaches = |from: &str, to: &str| {
        let (mut reached, mut open) = (vec![], edges[from].clone());
        while let Some(name) = open.pop() {
            if !reached.contains(&name) {
                reached.push(name);
                open.extend(&edges[name]);
            }
        }
        reached.contains(&to)
    };
    let mut import_cycles: Vec<Vec<String>> = vec![];
    for name in edges.keys().copied().filter(|name| reaches(name, name)) {
        let together = |import_cycle: &&mut Vec<String>| {
            reaches(name, &import_cycle[0]) && reaches(&import_cycle[0], name)
        };
        match import_cycles.iter_mut().find(together) {
            Some(import_cycle) => import_cycle.push(name.to_owned()),
            None => import_cycles.push(vec![name.to_owned()]),
        }
    }
    Ok(import_cycles)
}

/// Returns the modules beside `name` that its `use` declarations contain, before its tests.
fn imports<'t>(name: &str, text: &str, all: &'t BTreeMap<String, String>) -> Vec<&'t str> {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or(text);
    let inside = |a: &str, b: &str| b.is_empty() || a == b || a.starts_with(&format!("{b}::"));
    let paths = declarations(text)
        .into_iter()
        .flat_map(|path| expanded(&path));
    paths
        .filter_map(|path| longest_module(&absolute(name, &path)?, all))
        .filter(|module| !inside(name, module) && !inside(module, name))
        .collect()
}

/// Returns the paths of the `use` declarations in a text, without white space.
fn declarations(text: &str) -> Vec<String> {
    let is_visibility = |before: &str| {
        before.is_empty()
            || before == "pub "
            || (before.starts_with("pub(") && before.ends_with(") "))
    };
    let (mut found, mut is_open) = (vec![], false);
    for line in text.lines() {
        let line = line.split("//").next().unwrap_or_default().trim();
        let path = line.split_once("use ");
        if let Some((_, path)) = path.filter(|(before, _)| is_visibility(before)) {
            found.push(path.to_owned());
            is_open = true;
        } else if is_open && let Some(last) = found.last_mut() {
            *last += line;
        }
        is_open &= !line.contains(';');
    }
    let path = |path: String| {
        let path = path.split(';').next().unwrap_or_default();
        path.replace(" as ", "::as::").replace(' ', "")
    };
    found.into_iter().map(path).collect()
}

/// Returns the single paths of a path with groups: `a::{b, c}` is `a::b` and `a::c`.
fn expanded(path: &str) -> Vec<String> {
    let Some((before, group)) = path.split_once('{') else {
        return vec![path.to_owned()];
    };
    let group = group.strip_suffix('}').unwrap_or(group);
    let (mut parts, mut part, mut depth) = (vec![], String::new(), 0);
    for letter in group.chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        match letter {
            ',' if depth == 0 => parts.push(std::mem::take(&mut part)),
            _ => part.push(letter),
        }
    }
    parts.push(part);
    let parts = parts.iter().filter(|part| !part.is_empty());
    parts
        .flat_map(|part| expanded(&format!("{before}{part}")))
        .collect()
}

/// Returns a path of a `use` from the crate's root; `None` for other crates.
fn absolute(name: &str, path: &str) -> Option<String> {
    if let Some(path) = path.strip_prefix("crate::") {
        return Some(path.to_owned());
    }
    let mut module: Vec<&str> = name.split("::").collect();
    let mut rest = path.strip_prefix("super::")?;
    module.pop();
    while let Some(path) = rest.strip_prefix("super::") {
        module.pop();
        rest = path;
    }
    module.push(rest);
    Some(module.join("::"))
}

/// Returns the innermost module on a path.
fn longest_module<'t>(path: &str, all: &'t BTreeMap<String, String>) -> Option<&'t str> {
    let ends = path.match_indices("::").map(|(end, _)| end);
    let mut prefixes: Vec<&str> = ends.map(|end| &path[..end]).collect();
    prefixes.push(path);
    let found = prefixes
        .into_iter()
        .rev()
        .find_map(|prefix| all.get_key_value(prefix));
    found.map(|(module, _)| module.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_empty_lines_are_no_code() {
        let text = "//! Doc\n\nfn a() {\n    // why\n}\n";
        assert_eq!(lines_of_code(text, "rs"), 2);
        assert_eq!(lines_of_code("# why\nx = 1\n", "py"), 1);
    }

    #[test]
    fn public_items_are_counted() {
        assert!(is_public("    pub fn a() {") && is_public("pub const A: u8 = 1;"));
        assert!(!is_public("pub(crate) fn a() {") && !is_public("    pub width: u32,"));
    }

    #[test]
    fn import_cycle_is_found_and_folder_module_is_no_cycle() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, text).expect("written");
        };
        write("lib.rs", "pub mod a;\npub use a::A;\n");
        write("a.rs", "use crate::{\n    b::{B, C},\n};\nuse std::fmt;\n");
        write("b/mod.rs", "mod inner;\npub use inner::B;\n");
        write("b/inner.rs", "use super::C;\nuse super::super::c::D;\n");
        write("c.rs", "use crate::d::deep;\n");
        assert_eq!(import_cycles(folder.path()).expect("read"), [[""; 0]; 0]);
        write(
            "b/mod.rs",
            "use crate::c::D;\n#[cfg(test)]\nmod tests {\n    use crate::a::A;\n}\n",
        );
        write("d.rs", "pub(crate) use super::{a, b::B};\n");
        assert_eq!(
            import_cycles(folder.path()).expect("read"),
            [["a", "b", "c", "d"]]
        );
    }
}
