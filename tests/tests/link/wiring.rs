//! The boards' pages name the pins of their sources. `tests/images` checks that the images set them
//! up as documented; embassy's types check that a pin supports its use, or the images would not
//! compile.

use std::collections::BTreeSet;

use hapterra_tests::repository;

/// Returns the names of pins (PA0 to PK15) in a text, each after `before`.
fn pins(text: &str, before: &str) -> BTreeSet<String> {
    let after = text.split(before).skip(1);
    after
        .filter_map(|rest| {
            let word: String = rest
                .chars()
                .take_while(char::is_ascii_alphanumeric)
                .collect();
            let number = word
                .strip_prefix('P')?
                .strip_prefix(|c| ('A'..='K').contains(&c))?;
            number.parse::<u8>().is_ok().then_some(word)
        })
        .collect()
}

/// Returns the section of the page under a heading.
fn section<'p>(page: &'p str, heading: &str) -> &'p str {
    let from = page.find(heading).expect("the heading");
    let section = &page[from + heading.len()..];
    section.split("\n## ").next().expect("there is one")
}

/// Returns the pins in the middle column of a section's table.
fn wired(page: &str, heading: &str) -> BTreeSet<String> {
    let rows = section(page, heading)
        .lines()
        .filter(|l| l.starts_with("| "));
    let cells: Vec<String> = rows
        .filter_map(|row| row.split(" | ").nth(1))
        .map(|cell| format!(" {cell}"))
        .collect();
    pins(&cells.concat(), " ")
}

fn source(files: &[&str]) -> String {
    let read = |file: &&str| {
        let path = repository().join("firmware/boards").join(file);
        std::fs::read_to_string(path).expect("source")
    };
    files.iter().map(read).collect()
}

#[test]
fn wiring_tables_match_the_pins_of_the_images() {
    let page = |board: &str| {
        let path = repository().join(format!("docs/reference/boards/{board}.md"));
        std::fs::read_to_string(path).expect("the page")
    };
    let taken = |files: &[&str]| {
        let source = source(files);
        &pins(&source, "p.") | &pins(&source, "$p.")
    };
    let g474 = taken(&["nucleo-g474re/chip.rs", "nucleo-g474re/outputs.rs"]);
    assert!(g474.len() > 12, "{g474:?}");
    assert_eq!(wired(&page("nucleo-g474re"), "# nucleo-g474re\n"), g474);
    let h743 = taken(&[
        "nucleo-h743zi2/chip.rs",
        "nucleo-h743zi2/outputs.rs",
        "nucleo-h743zi2/stop.rs",
    ]);
    let page = page("nucleo-h743zi2");
    assert_eq!(wired(&page, "## Duty cycles"), h743);
    // This table only has the differences.
    let spi = taken(&[
        "nucleo-h743zi2-spi/outputs.rs",
        "nucleo-h743zi2-spi/stop.rs",
    ]);
    assert_eq!(spi.len(), 5);
    assert_eq!(wired(&page, "## A converter on SPI"), spi);
}
