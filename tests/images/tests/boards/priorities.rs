//! Nothing delays the haptic interrupt: its priority, the interrupts that critical sections mask,
//! and its behaviour when it is raised in one.

use std::fmt::Write;

use hapterra_image_tests::device::{Device, machines, on_each_board, rough_ground};
use hapterra_image_tests::machine::{Machine, Stop};

/// The highest priority that critical sections mask.
const ABSOLUTE_LIMIT: u8 = 0x20;
/// Priority of the haptic interrupt.
const HAPTIC: u8 = 0x10;
/// Priority of the supply's interrupt, whose handler does not return.
const SUPPLY: u8 = 0x00;
/// The page with the table.
const PAGE: &str = include_str!("../../../../docs/explanation/priorities.md");

/// Returns the name of the handler in the vector table.
fn handler(machine: &Machine, interrupt: usize) -> String {
    let table = machine.chip.memories[0].0;
    let address = machine.word(table + 4 * (interrupt as u32 + 16)) & !1;
    if machine
        .image
        .symbol("DefaultHandler")
        .is_some_and(|d| d & !1 == address)
    {
        return "DefaultHandler".into();
    }
    machine.image.at(address).to_string()
}

/// Returns the rows of the page's table for a board, with runs of neighbours in one row.
fn rows(machine: &Machine) -> String {
    let mut rows: Vec<(Vec<(usize, String)>, u8)> = vec![];
    for (interrupt, priority) in machine.bus().nvic.enabled() {
        let entry = (interrupt, handler(machine, interrupt));
        match rows.last_mut() {
            Some((run, p))
                if *p == priority && run.last().is_some_and(|l| l.0 + 1 == interrupt) =>
            {
                run.push(entry);
            }
            _ => rows.push((vec![entry], priority)),
        }
    }
    rows.sort_by_key(|(run, priority)| (*priority, run[0].0));
    let mut text = String::new();
    for (run, priority) in rows {
        let numbers: Vec<_> = run.iter().map(|(n, _)| n.to_string()).collect();
        let mut names: Vec<_> = run.iter().map(|(_, name)| format!("`{name}`")).collect();
        names.dedup();
        // The kind of output does not change the interrupts.
        let board = machine.chip.board.trim_end_matches("-spi");
        let _ = writeln!(
            text,
            "| {board} | `0x{priority:02x}` | {} | {} |",
            numbers.join(", "),
            names.join(", ")
        );
    }
    text
}

#[test]
fn haptic_interrupt_outranks_maskable_ones_as_documented() {
    for mut machine in machines() {
        let chip = machine.chip;
        assert_eq!(machine.run_ms(200), Stop::Time);
        for (interrupt, priority) in machine.bus().nvic.enabled() {
            if interrupt == chip.tick_interrupt {
                assert_eq!(priority, HAPTIC, "{}", chip.board);
            } else if interrupt == chip.comparator.interrupt {
                assert_eq!(priority, SUPPLY, "{}", chip.board);
            } else {
                assert!(priority >= ABSOLUTE_LIMIT, "{}: {interrupt}", chip.board);
            }
        }
        let rows = rows(&machine);
        assert!(
            PAGE.contains(&rows),
            "docs/explanation/priorities.md must contain:\n{rows}"
        );
    }
}

#[test]
fn only_known_functions_mask_all_interrupts() {
    for machine in machines() {
        let image = &machine.image;
        let mut maskers = vec![];
        for (address, word) in image.instructions() {
            let cpsid = word >> 16 == 0xB672 || word >> 16 == 0xB671;
            // MSR to PRIMASK or FAULTMASK from a register.
            let msr = word & 0xFFF0_FFFF == 0xF380_8810 || word & 0xFFF0_FFFF == 0xF380_8813;
            if cpsid || msr {
                maskers.push(image.at(address));
            }
        }
        assert!(!maskers.is_empty(), "the panic handler does");
        maskers.dedup();
        // `main` takes the core's peripherals under a mask, before there is a tick; it is the first
        // of the tasks and never polled again.
        let is_main = |name: &&str| {
            ["TaskStorage", "embassy_main_task"]
                .iter()
                .any(|m| name.contains(m))
        };
        let main = maskers.iter().position(is_main);
        main.map(|i| maskers.remove(i));
        let known = [
            "__cpsid",
            "rust_begin_unwind",
            "HardFault",
            "DefaultHandler",
            "unhandled",
            "supply_low",
            // At the start of the chip's loader, with the amplifiers off.
            "loader",
            // embassy's flash driver, for the one register write that begins an erase: only at
            // start-up, before there is a tick.
            "blocking_erase",
        ];
        for name in maskers {
            let is_known = known.iter().any(|k| name.contains(k));
            assert!(
                is_known,
                "{}: {name} masks all interrupts",
                machine.chip.board
            );
        }
    }
}

/// Safety: 38.
#[test]
fn tick_is_not_delayed_by_critical_sections_or_interrupts() {
    let (raster, home_mm) = rough_ground();
    on_each_board(&raster, home_mm, |mut machine, terrain, scene| {
        let board = machine.chip.board;
        // Small enough to find the shortest sections, odd enough to find all.
        machine.slice = 13;
        machine.raises_tick_every = Some(11);
        // Receives tiles and sends telemetry.
        let device = Device::open(machine, terrain, scene);
        let machine = device.machine.borrow();
        println!("{board}: raised {} times out of turn", machine.raised);
        assert!(machine.raised > 200, "{board}: {}", machine.raised);
        assert_eq!(machine.delayed, 0, "{board}");
        assert_eq!(machine.masked, 0, "{board}: PRIMASK");
    });
}
