//! Each item of docs/safety.md has tests that name it.

use std::collections::BTreeSet;

use hapterra_tests::repository;
use hapterra_tests::traceability::{Item, evidence};

/// Returns the numbers of the page's items on the machine's behaviour.
fn items(page: &str) -> BTreeSet<u32> {
    let numbered = page.lines().filter_map(|line| line.split_once(". **"));
    numbered
        .filter_map(|(number, _)| number.parse().ok())
        .collect()
}

#[test]
fn each_item_of_the_safety_page_has_a_test() {
    let page = std::fs::read_to_string(repository().join("docs/safety.md")).expect("the page");
    let items = items(&page);
    assert!(items.len() > 40, "{items:?}");
    let evidence = evidence(repository()).expect("marked tests");
    assert!(evidence.values().map(Vec::len).sum::<usize>() > 300);
    let numbered = evidence.keys().filter_map(|item| match item {
        Item::Number(number) => Some(*number),
        Item::Other(_) => None,
    });
    assert_eq!(items, numbered.collect());
}
