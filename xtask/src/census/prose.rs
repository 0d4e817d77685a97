//! Words, sentences and lines of the pages.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::files;

/// Maximum words of a sentence, and maximum characters of a line.
pub(super) const MAX_SENTENCE: usize = 40;
pub(super) const MAX_LINE: usize = 120;

/// Measures of a page.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Page {
    pub(super) words: usize,
    pub(super) lines: usize,
    pub(super) sentences: usize,
    pub(super) words_in_sentences: usize,
    pub(super) longest_sentence: usize,
    pub(super) longest_line: usize,
}

/// Returns the sums of all pages.
pub(super) fn total(pages: &[(PathBuf, Page)]) -> Page {
    pages.iter().fold(Page::default(), |all, (_, page)| Page {
        words: all.words + page.words,
        lines: all.lines + page.lines,
        sentences: all.sentences + page.sentences,
        words_in_sentences: all.words_in_sentences + page.words_in_sentences,
        longest_sentence: all.longest_sentence.max(page.longest_sentence),
        longest_line: all.longest_line.max(page.longest_line),
    })
}

/// Returns the sentences and lines that are too long, page by page.
pub(super) fn faults(pages: &[(PathBuf, Page)]) -> Vec<String> {
    let too_long = pages.iter().flat_map(|(path, page)| {
        [
            ("words in a sentence", page.longest_sentence, MAX_SENTENCE),
            ("characters in a line", page.longest_line, MAX_LINE),
        ]
        .map(|(what, found, max)| {
            (found > max).then(|| format!("{}: {found} {what}, at most {max}", path.display()))
        })
    });
    too_long.flatten().collect()
}

/// Returns the pages of the book, and README.md.
pub(super) fn pages(root: &Path) -> Result<Vec<(PathBuf, Page)>> {
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
    let visible = without_comments(text);
    let mut page = Page {
        words: { visible.split_whitespace() }
            .filter(|word| is_word(word))
            .count(),
        lines: text.lines().count(),
        longest_line: text
            .lines()
            .map(|line| line.chars().count())
            .max()
            .unwrap_or(0),
        ..Page::default()
    };
    for words in sentences(&visible) {
        page.sentences += 1;
        page.words_in_sentences += words;
        page.longest_sentence = page.longest_sentence.max(words);
    }
    page
}

/// Returns true if a part between spaces is a word, not a dash or list mark.
fn is_word(part: &str) -> bool {
    part.contains(char::is_alphanumeric)
}

/// Returns a page without its comments, which readers do not see.
fn without_comments(text: &str) -> String {
    let (mut visible, mut rest) = (String::new(), text);
    while let Some((before, comment)) = rest.split_once("<!--") {
        visible += before;
        rest = comment.split_once("-->").map_or("", |(_, after)| after);
    }
    visible + rest
}

/// Returns the words of each sentence of the prose, without code, tables and headings.
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
}
