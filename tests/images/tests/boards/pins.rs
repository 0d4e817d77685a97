//! The images set up every pin on the board's page, with its alternate function, and no other pin:
//! read from the chip's registers after a reset.

use std::collections::BTreeMap;

use hapterra_image_tests::device::machines;
use hapterra_image_tests::machine::{Machine, Stop};
use hapterra_tests::repository;

/// Offsets of a port's registers.
const MODER: u32 = 0x00;
const PUPDR: u32 = 0x0C;
const AFRL: u32 = 0x20;

/// Pins and their modes, as on a page.
type Pins = BTreeMap<String, String>;

/// Returns the table of a page after a heading: rows of use, pin, signal, mode.
fn table(page: &str, heading: &str) -> Pins {
    let from = page.find(heading).expect("the heading");
    let section = &page[from + heading.len()..];
    let section = section.split("\n## ").next().expect("there is one");
    let rows = section.lines().filter_map(|line| {
        let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [_, pin, _, mode] = cells[..] else {
            return None;
        };
        pin.starts_with('P')
            .then(|| (pin.to_owned(), mode.to_owned()))
    });
    rows.collect()
}

/// Returns the pins of a board on its page.
fn documented_pins(board: &str) -> Pins {
    let page = |name: &str| {
        let path = repository().join(format!("docs/reference/boards/{name}.md"));
        std::fs::read_to_string(path).expect("the page")
    };
    match board {
        "nucleo-g474re" => table(&page(board), "# nucleo-g474re"),
        "nucleo-h743zi2" => table(&page(board), "## Duty cycles"),
        _ => {
            let page = page("nucleo-h743zi2");
            let mut pins = table(&page, "## Duty cycles");
            pins.retain(|pin, _| !["PE9", "PE11", "PE13"].contains(&pin.as_str()));
            pins.extend(table(&page, "## A converter on SPI"));
            pins
        }
    }
}

/// Returns the mode of a pin.
fn mode(machine: &Machine, port: u32, pin: u32) -> String {
    let register = |offset| {
        machine
            .bus()
            .read(machine.chip.gpio + 0x400 * port + offset)
    };
    let pulled = match register(PUPDR) >> (2 * pin) & 3 {
        1 => ", pulled up",
        2 => ", pulled down",
        _ => "",
    };
    let function = register(AFRL + 4 * (pin / 8)) >> (4 * (pin % 8)) & 0xF;
    let mode = match register(MODER) >> (2 * pin) & 3 {
        0 => "input".to_owned(),
        1 => "output".to_owned(),
        2 => format!("AF{function}"),
        _ => "analogue".to_owned(),
    };
    mode + pulled
}

/// Returns all pins with their modes.
fn modes(machine: &Machine) -> Pins {
    let pins = ('A'..='K').zip(0..).flat_map(|(letter, port)| {
        let name = move |pin| (format!("P{letter}{pin}"), mode(machine, port, pin));
        (0..16).map(name)
    });
    pins.collect()
}

/// Safety: 8.
#[test]
fn pins_are_configured_as_on_the_board_page() {
    for mut machine in machines() {
        let board = machine.chip.board;
        let mut expected = modes(&machine);
        let documented = documented_pins(board);
        assert!(documented.len() >= 15, "{board}: {documented:?}");
        assert_eq!(machine.run_ms(10), Stop::Time, "{board}");
        // Pins that are not on the page keep their reset state.
        expected.extend(documented);
        let is = modes(&machine);
        let other = expected
            .iter()
            .filter(|(pin, mode)| is.get(*pin) != Some(mode));
        let other: Vec<_> = other.map(|(pin, mode)| (pin, mode, is.get(pin))).collect();
        assert!(other.is_empty(), "{board}: pin, page, chip: {other:?}");
    }
}
