//! The pages of the book: figures, links, tables and line lengths. For the marks of figures see
//! `hapterra_tests::figures`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use hapterra_tests::figures::{check, renewed};
use hapterra_tests::{repository, traceability};

/// Longest line of a page, characters.
const MAX_LINE: usize = 120;

/// Returns every page in `folder` and its sub-folders, with its text.
fn pages_in(folder: &Path) -> Vec<(PathBuf, String)> {
    let entries = folder.read_dir().expect("a folder");
    let paths = entries.map(|entry| entry.expect("readable").path());
    let pages = paths.flat_map(|path| {
        if path.is_dir() {
            return pages_in(&path);
        }
        let is_page = path.extension().is_some_and(|kind| kind == "md");
        let text = is_page.then(|| std::fs::read_to_string(&path).expect("readable"));
        text.map(|text| (path, text)).into_iter().collect()
    });
    pages.collect()
}

/// Returns the pages of the book and these pages of the root folder.
fn pages_and(root: &[&str]) -> Vec<(PathBuf, String)> {
    let mut pages = pages_in(&repository().join("docs"));
    pages.extend(root.iter().map(|page| {
        let path = repository().join(page);
        let text = std::fs::read_to_string(&path).expect("readable");
        (path, text)
    }));
    pages
}

#[test]
fn figures_on_the_pages_are_those_of_the_tables() {
    let mut stale = Vec::new();
    let writes = std::env::var("HAPTERRA_DOCS").is_ok_and(|mode| mode == "write");
    for (page, mut text) in pages_and(&["README.md", "CHANGELOG.md"]) {
        let new = renewed(&text, repository());
        if writes && new != text {
            std::fs::write(&page, &new).expect("the page can be written");
            text = new;
        }
        let (figures, wrong) = check(&text, repository());
        println!("{}: {figures} figures from tables", page.display());
        stale.extend(wrong.iter().map(|why| format!("{}: {why}", page.display())));
    }
    let command = "to renew the figures: cargo xtask docs --write";
    assert!(stale.is_empty(), "{}\n{command}", stale.join("\n"));
}

#[test]
fn page_of_the_evidence_lists_the_marked_tests() {
    let path = repository().join("docs/contributing/traceability.md");
    let marked = traceability::evidence(repository()).expect("marked tests");
    let page = traceability::page(&marked);
    if std::env::var("HAPTERRA_DOCS").is_ok_and(|mode| mode == "write") {
        std::fs::write(&path, &page).expect("the page can be written");
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    let command = "to renew the page: cargo xtask docs --write";
    assert!(written == page, "{} is old\n{command}", path.display());
}

/// Returns the text without its blocks of code.
fn prose(text: &str) -> String {
    text.split("\n```").step_by(2).collect()
}

/// Returns the anchor of a heading: letters and digits in lower case, hyphens for spaces.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = heading
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Returns the links of this prose to files and headings, without those to the web.
fn local_links(prose: &str) -> impl Iterator<Item = &str> {
    let links = prose.split("](").skip(1);
    let links = links.filter_map(|rest| rest.split(')').next());
    links.filter(|link| !link.contains("://") && !link.starts_with("mailto:"))
}

/// Returns a message for each link of a page to a file or a heading that does not exist.
fn dead_links(page: &Path, text: &str) -> Vec<String> {
    let text = prose(text);
    let mut dead = Vec::new();
    for link in local_links(&text) {
        let (file, expected) = link.split_once('#').unwrap_or((link, ""));
        let folder = page.parent().expect("a folder");
        let target = if file.is_empty() {
            page.to_owned()
        } else {
            folder.join(file)
        };
        if !target.exists() {
            dead.push(format!("{}: {link}: no such file", page.display()));
        } else if !expected.is_empty() {
            let target = std::fs::read_to_string(&target).unwrap_or_default();
            let target = prose(&target);
            let headings = target.lines().filter(|line| line.starts_with('#'));
            let anchors: HashSet<String> = headings.map(anchor).collect();
            if !anchors.contains(expected) {
                dead.push(format!("{}: {link}: no such heading", page.display()));
            }
        }
    }
    dead
}

/// Returns a message for each link of a page that leaves the folder of its book: mdBook copies only
/// this folder.
fn leaving_links(book: &Path, page: &Path, text: &str) -> Vec<String> {
    let book = book.canonicalize().expect("a folder");
    let text = prose(text);
    let folder = page.parent().expect("a folder");
    let leaves = |link: &&str| {
        let file = link.split('#').next().unwrap_or_default();
        let target = folder.join(file).canonicalize();
        target.is_ok_and(|target| !target.starts_with(&book))
    };
    local_links(&text)
        .filter(leaves)
        .map(|link| format!("{}: {link}: outside the book", page.display()))
        .collect()
}

#[test]
fn links_of_the_pages_lead_somewhere() {
    let pages = pages_and(&[
        "README.md",
        "core/README.md",
        "page/README.md",
        "python/README.md",
        "touch/README.md",
    ]);
    let dead: Vec<_> = pages
        .iter()
        .chain(&pages_in(&repository().join("log")))
        .flat_map(|(page, text)| dead_links(page, text))
        .collect();
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

#[test]
fn links_of_the_book_stay_in_it() {
    let book = repository().join("docs");
    let leaving: Vec<_> = pages_in(&book)
        .iter()
        .flat_map(|(page, text)| leaving_links(&book, page, text))
        .collect();
    assert!(leaving.is_empty(), "{}", leaving.join("\n"));
}

#[test]
fn links_that_leave_a_book_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let book = folder.path().join("book");
    std::fs::create_dir(&book).expect("a folder");
    std::fs::write(folder.path().join("code.md"), "").expect("written");
    let page = book.join("page.md");
    let text = "[a](page.md) [b](#b) [c](../code.md#c) [d](../book/page.md) [e](https://e)\n";
    std::fs::write(&page, text).expect("written");
    let leaving = leaving_links(&book, &page, text);
    assert_eq!(leaving.len(), 1, "{leaving:?}");
    assert!(leaving[0].contains("../code.md#c: outside the book"));
}

#[test]
fn dead_links_are_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("page.md");
    let text = "# One: two, `three`\n[a](page.md#one-two-three) [b](#no) [c](no.md) [d](https://e)\n\
                ```\n[f](gone.md)\n```\n";
    std::fs::write(&page, text).expect("written");
    let dead = dead_links(&page, text);
    assert_eq!(dead.len(), 2, "{dead:?}");
    assert!(dead[0].contains("#no: no such heading"), "{dead:?}");
    assert!(dead[1].contains("no.md: no such file"), "{dead:?}");
}

#[test]
fn lines_of_the_book_are_short() {
    let mut long = Vec::new();
    for (page, text) in pages_in(&repository().join("docs")) {
        for (i, line) in text.lines().enumerate() {
            let characters = line.chars().count();
            if characters > MAX_LINE {
                long.push(format!("{}:{}: {characters}", page.display(), i + 1));
            }
        }
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
}

/// Returns the numbers of the lines at which a table begins without a line of dashes below, as
/// after a blank line inside a table.
fn cut_tables(text: &str) -> Vec<usize> {
    let lines: Vec<&str> = text.lines().map(str::trim_start).collect();
    let mut cut = Vec::new();
    let mut is_code = false;
    let mut is_table = false;
    for (i, line) in lines.iter().enumerate() {
        if line.starts_with("```") {
            is_code = !is_code;
        }
        let is_row = !is_code && line.starts_with('|');
        let below = lines.get(i + 1).copied().unwrap_or_default();
        if is_row && !is_table && !below.starts_with("| ---") {
            cut.push(i + 1);
        }
        is_table = is_row;
    }
    cut
}

#[test]
fn tables_of_the_pages_have_heads() {
    let mut cut = Vec::new();
    for (page, text) in pages_and(&["README.md", "CHANGELOG.md", "python/README.md"]) {
        for line in cut_tables(&text) {
            cut.push(format!("{}:{line}", page.display()));
        }
    }
    assert!(cut.is_empty(), "{}", cut.join("\n"));
}

#[test]
fn cut_tables_are_found() {
    let whole = "Text.\n| a | b |\n| --- | ---: |\n| 1 | 2 |\n| 3 | 4 |\n";
    assert!(cut_tables(whole).is_empty());
    let blank = whole.replace("| 3", "\n| 3");
    assert_eq!(cut_tables(&blank), vec![6]);
    let code = format!("```text\n{blank}```\n");
    assert!(cut_tables(&code).is_empty());
}

/// Returns a folder with a table.
fn folder() -> tempfile::TempDir {
    const TABLE: &str = "state,median,share\nsliding,1218,0.04567\n\"chain, free\",1144,2.04e-6\n\
                         twice,1,1\ntwice,2,2\nempty,,1\n";
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("t.csv"), TABLE).expect("written");
    folder
}

/// Checks a page with this table.
fn reported(page: &str) -> (usize, Vec<String>) {
    check(page, folder().path())
}

fn figure(place: &str, shown: &str) -> String {
    format!("It takes <!-- from t.csv: {place} -->{shown} at most.")
}

#[test]
fn figure_matches_the_table_to_its_digits() {
    for (place, shown) in [
        ("sliding, median", "1218"),
        ("sliding, median", "1,218"),
        ("sliding, share", "0.05"),
        ("sliding, share", "0.0457"),
        ("chain, free, median", "1144."),
        ("chain, free, share", "2e-6"),
        ("twice / 2, share", "2"),
    ] {
        assert_eq!(
            reported(&figure(place, shown)),
            (1, vec![]),
            "{place} {shown}"
        );
    }
    assert_eq!(reported("No figure of a table: 17."), (0, vec![]));
}

#[test]
fn cells_of_a_table_are_compared() {
    let table = |rows: &str| {
        format!(
            "<!-- table t.csv: -, median, share\nsliding\nchain, free\n-->\n\
             | state | median | share |\n| --- | --- | --- |\n{rows}\nMore.\n"
        )
    };
    let right = "| sliding | 1,218 | 0.05 |\n| free | 1144 | |";
    assert_eq!(reported(&table(right)), (3, vec![]));
    let (count, wrong) = reported(&table("| sliding | 1,217 | 0.05 |\n| free | 1144 | 2e-6 |"));
    assert_eq!((count, wrong.len()), (4, 1), "{wrong:?}");
    assert!(wrong[0].contains("1,217 on the page"), "{wrong:?}");
    let (_, wrong) = reported(&table("| sliding | 1,218 | 0.05 |"));
    assert!(wrong[0].contains("2 rows are named, 1 shown"), "{wrong:?}");
    let (_, wrong) = reported(&table("| sliding | 1,218 |\n| free | 1144 | |"));
    assert!(wrong[0].contains("number of columns"), "{wrong:?}");
}

#[test]
fn stale_figures_are_renewed_in_their_form() {
    let stale = "Of <!-- from t.csv: sliding, median -->999, some <!-- from t.csv: sliding, share -->0.05.\n\
                 <!-- table t.csv: -, median, share\nsliding\nchain, free\n-->\n\
                 | state | median | share |\n| --- | --- | --- |\n\
                 | sliding | 1,000,000 | 0.04 |\n| free | 1000 | 3.1e-5 |\n\n\
                 None: <!-- from t.csv: gliding, median -->7.\n";
    let new = renewed(stale, folder().path());
    let expected = stale
        .replace("-->999,", "-->1,218,")
        .replace("1,000,000 | 0.04", "1,218 | 0.05")
        .replace("1000 | 3.1e-5", "1144 | 2.0e-6");
    assert_eq!(new, expected);
}

#[test]
fn figure_that_differs_from_the_table_is_detected() {
    for (place, shown, why) in [
        (
            "sliding, median",
            "1217",
            "1217 on the page, 1218 in the table",
        ),
        ("sliding, share", "0.04", "0.04 on the page"),
        ("chain, free, share", "3e-6", "3e-6 on the page"),
        ("sliding, median", "many", "no figure behind the comment"),
        ("gliding, median", "1218", "no such row"),
        ("sliding, mean", "1218", "no such column"),
        ("sliding", "1218", "no column is named"),
        ("twice, median", "1", "more than one row"),
        ("empty, median", "1", "is no number"),
    ] {
        let (figures, wrong) = reported(&figure(place, shown));
        assert_eq!((figures, wrong.len()), (1, 1), "{place} {shown}");
        assert!(wrong[0].contains(why), "{wrong:?}");
    }
    let (_, wrong) =
        reported("<!-- from no.csv: a, b -->1 and <!-- from t.csv: sliding, median 1218");
    assert_eq!(wrong.len(), 2, "{wrong:?}");
}
