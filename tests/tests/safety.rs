//! Whether the tests that docs/safety.md, hardware.md and bringup.md name exist.

use std::path::Path;

use hapterra_tests::repository;

/// What a page names in the last column of its tables that say what shows a thing.
fn named(page: &str) -> Vec<&str> {
    let is_row = |line: &&str| line.starts_with("| ");
    let mut names = Vec::new();
    for table in page.split("\n\n") {
        let mut rows = table.lines().filter(is_row);
        if rows
            .next()
            .is_some_and(|header| header.ends_with("| shown by |"))
        {
            let cells = rows.skip(1).filter_map(|row| row.rsplit(" | ").next());
            names.extend(cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)));
        }
    }
    names
}

#[test]
fn the_tests_that_the_pages_name_exist() {
    let mut source = String::new();
    for folder in [
        "core/src",
        "firmware/src",
        "host-tools/src",
        "host-tools/tests",
        "tests",
    ] {
        read_all(&repository().join(folder), &mut source);
    }
    for (page, least) in [("safety", 60), ("hardware", 45), ("bringup", 12)] {
        let path = repository().join(format!("docs/{page}.md"));
        let text = std::fs::read_to_string(path).expect("the page");
        let names = named(&text);
        assert!(names.len() >= least, "{page}: {} names", names.len());
        for name in names {
            let found = source.contains(&format!("fn {name}()"));
            assert!(found, "{page}: there is no test {name}");
        }
    }
}

fn read_all(folder: &Path, into: &mut String) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            read_all(&path, into);
        } else if path.extension().is_some_and(|kind| kind == "rs") {
            into.push_str(&std::fs::read_to_string(&path).expect("source"));
        }
    }
}
