//! `cargo xtask census`: how much there is to read, and the bounds that it keeps.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::run::root;

/// Bounds of the pages: words in all, words of the longest sentence, characters of the longest line.
const MAX_WORDS: usize = 36_000;
const MAX_SENTENCE: usize = 40;
const MAX_LINE: usize = 120;
/// Folders that hold code, in the order of the data.
const ROOMS: [&str; 14] = [
    "core",
    "firmware",
    "heightfield",
    "heightfield-gdal",
    "touch",
    "host-tools",
    "c",
    "python",
    "page",
    "view",
    "tests",
    "bench",
    "fuzz",
    "xtask",
];
/// Endings of files of code.
const CODE: [&str; 5] = ["rs", "py", "js", "c", "h"];
/// Folders of what is built.
const BUILT: [&str; 3] = ["target", "node_modules", ".git"];

/// What a page comes to.
#[derive(Debug, Default, PartialEq)]
struct Page {
    words: usize,
    sentences: usize,
    words_in_sentences: usize,
    longest_sentence: usize,
    longest_line: usize,
}

/// Prints the words of the pages and the lines of code by room, and holds the pages to their bounds.
///
/// # Errors
/// Which page breaks which bound.
pub(crate) fn census() -> Result<()> {
    let pages = pages()?;
    let mut faults = vec![];
    let mut all = Page::default();
    for (path, page) in &pages {
        println!("{:6} words  {}", page.words, path.display());
        let bounds = [
            ("words in a sentence", page.longest_sentence, MAX_SENTENCE),
            ("characters in a line", page.longest_line, MAX_LINE),
        ];
        for (what, found, most) in bounds.into_iter().filter(|(_, found, most)| found > most) {
            faults.push(format!(
                "{}: {found} {what}, at most {most}",
                path.display()
            ));
        }
        all.words += page.words;
        all.sentences += page.sentences;
        all.words_in_sentences += page.words_in_sentences;
    }
    let mean = all.words_in_sentences as f64 / all.sentences.max(1) as f64;
    println!(
        "{:6} words on {} pages, {mean:.1} a sentence",
        all.words,
        pages.len()
    );
    if all.words > MAX_WORDS {
        faults.push(format!(
            "{} words on all pages, at most {MAX_WORDS}",
            all.words
        ));
    }
    for (room, [lines, tests]) in code()? {
        println!("{lines:6} lines of code  {room}, {tests} of them in files of tests");
    }
    match faults.is_empty() {
        true => Ok(()),
        false => bail!("{}", faults.join("\n")),
    }
}

fn pages() -> Result<Vec<(PathBuf, Page)>> {
    let root = root();
    let mut found = vec![];
    for path in files(&root.join("docs"))?
        .into_iter()
        .chain([root.join("README.md")])
    {
        if path.extension().is_some_and(|kind| kind == "md") {
            let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
            let name = path.strip_prefix(root).unwrap_or(&path).to_owned();
            found.push((name, page(&text)));
        }
    }
    Ok(found)
}

fn page(text: &str) -> Page {
    let shown = without_comments(text);
    let mut page = Page {
        words: shown
            .split_whitespace()
            .filter(|word| is_word(word))
            .count(),
        longest_line: text
            .lines()
            .map(|line| line.chars().count())
            .max()
            .unwrap_or(0),
        ..Page::default()
    };
    for words in sentences(&shown) {
        page.sentences += 1;
        page.words_in_sentences += words;
        page.longest_sentence = page.longest_sentence.max(words);
    }
    page
}

/// Returns true if a part between spaces is a word, and no dash or mark of a list.
fn is_word(part: &str) -> bool {
    part.contains(char::is_alphanumeric)
}

/// A page without its comments, which nobody sees.
fn without_comments(text: &str) -> String {
    let (mut shown, mut left) = (String::new(), text);
    while let Some((before, comment)) = left.split_once("<!--") {
        shown += before;
        left = comment.split_once("-->").map_or("", |(_, after)| after);
    }
    shown + left
}

/// Words of each sentence of the prose: neither code, tables nor headings.
fn sentences(text: &str) -> Vec<usize> {
    let (mut found, mut words, mut is_code) = (vec![], 0, false);
    let mut end = |words: &mut usize| {
        found.extend((*words > 0).then_some(*words));
        *words = 0;
    };
    for line in text.lines().map(str::trim) {
        if line.starts_with("```") {
            is_code = !is_code;
        }
        let is_prose = !is_code && !line.starts_with(['|', '#', '<', '!', '`']) && !line.is_empty();
        let begins =
            !is_prose || line.starts_with("- ") || line.starts_with(|c: char| c.is_ascii_digit());
        if begins {
            end(&mut words);
        }
        if is_prose {
            for word in line.split_whitespace() {
                words += usize::from(is_word(word));
                if word.ends_with(['.', '!', '?', ':', ';']) {
                    end(&mut words);
                }
            }
        }
    }
    end(&mut words);
    found
}

/// Lines of code of each room, and of those the ones in files of tests.
fn code() -> Result<BTreeMap<&'static str, [usize; 2]>> {
    let mut rooms = BTreeMap::new();
    for room in ROOMS {
        let counts: &mut [usize; 2] = rooms.entry(room).or_default();
        for path in files(&root().join(room))? {
            let kind = path.extension().unwrap_or_default().to_string_lossy();
            if !CODE.contains(&&*kind) {
                continue;
            }
            let text = fs::read(&path).with_context(|| path.display().to_string())?;
            let lines = lines_of_code(&String::from_utf8_lossy(&text), &kind);
            let name = path.to_string_lossy();
            let is_test = room == "tests" || name.contains("test");
            counts[0] += lines;
            counts[1] += if is_test { lines } else { 0 };
        }
    }
    Ok(rooms)
}

/// Lines that are neither empty nor comments.
fn lines_of_code(text: &str, kind: &str) -> usize {
    let comment = if kind == "py" { "#" } else { "//" };
    let lines = text.lines().map(str::trim);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with(comment))
        .count()
}

/// The files in a folder and below it, but for what is built.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = vec![];
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let entry = entry?;
            let name = entry.file_name();
            match entry.file_type()?.is_dir() {
                true if BUILT.iter().any(|built| name == *built) => {}
                true => folders.push(entry.path()),
                false => found.push(entry.path()),
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_is_counted_and_code_is_not() {
        let text = "# A title\n\nOne two\nthree. Four five:\n\n- six\n- seven eight\n\n```\nno words here\n```\n\n| a | table |\n";
        assert_eq!(sentences(text), [3, 2, 1, 2]);
        let page = page(&format!("{text}<!-- no word -->"));
        assert_eq!(page.words, 15);
        assert_eq!((page.longest_sentence, page.longest_line), (3, 17));
    }

    #[test]
    fn comments_and_empty_lines_are_no_code() {
        assert_eq!(
            lines_of_code("//! Doc\n\nfn a() {\n    // why\n}\n", "rs"),
            2
        );
        assert_eq!(lines_of_code("# why\nx = 1\n", "py"), 1);
    }
}
