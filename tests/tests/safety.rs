//! Whether the tests that docs/safety.md names exist.

use std::path::Path;

use hapterra_tests::repository;

#[test]
fn the_tests_that_the_safety_page_names_exist() {
    let page = std::fs::read_to_string(repository().join("docs/safety.md")).expect("the page");
    let rows = page.lines().filter(|line| line.starts_with("| "));
    // The last column of a table of three.
    let cells = rows.filter_map(|row| row.split(" | ").nth(2));
    let names: Vec<&str> = cells
        .flat_map(|cell| cell.split('`').skip(1).step_by(2))
        .collect();
    assert!(names.len() > 30, "{} names", names.len());
    let mut source = String::new();
    for folder in ["core/src", "firmware/src", "host-tools/src", "tests"] {
        read_all(&repository().join(folder), &mut source);
    }
    for name in names {
        assert!(
            source.contains(&format!("fn {name}()")),
            "there is no test {name}"
        );
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
