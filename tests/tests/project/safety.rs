//! The tests in docs/safety-tests.csv exist, for each item of docs/safety.md.

use std::collections::BTreeSet;
use std::path::Path;

use hapterra_tests::repository;

fn read(path: &str) -> String {
    let path = repository().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

/// Returns the table's rows: an item's number, or another word, and a test.
fn rows(table: &str) -> impl Iterator<Item = (&str, &str)> {
    table
        .lines()
        .skip(1)
        .map(|row| row.split_once(',').expect("two columns"))
}

/// Returns the numbers of the page's items on the machine's behaviour.
fn items(page: &str) -> BTreeSet<&str> {
    let numbered = page.lines().filter_map(|line| line.split_once(". **"));
    let numbers = numbered.map(|(number, _)| number);
    numbers
        .filter(|number| number.parse::<u32>().is_ok())
        .collect()
}

#[test]
fn safety_table_names_tests_that_exist() {
    let mut source = String::new();
    for folder in [
        "core/src",
        "heightfield/src",
        "firmware/src",
        "host-tools/src",
        "bench/src",
        "host-tools/tests",
        "tests",
    ] {
        read_all(&repository().join(folder), &mut source);
    }
    let table = read("docs/safety-tests.csv");
    assert!(rows(&table).count() > 300);
    for (item, test) in rows(&table) {
        let found = source.contains(&format!("fn {test}()"));
        assert!(found, "item {item}: there is no test {test}");
    }
}

#[test]
fn each_item_of_the_safety_page_has_a_test() {
    let (page, table) = (read("docs/safety.md"), read("docs/safety-tests.csv"));
    let items = items(&page);
    assert!(items.len() > 40, "{items:?}");
    let tested: BTreeSet<&str> = rows(&table)
        .map(|(item, _)| item)
        .filter(|item| item.parse::<u32>().is_ok())
        .collect();
    assert_eq!(items, tested);
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
