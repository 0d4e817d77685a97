//! Time of the haptic interrupt in the boards' own images, from the model of cycles
//! (docs/reference/cycles.md), compared with the page, the build and the images.

#[path = "../../../../firmware/build/tick_rate.rs"]
#[allow(dead_code)] // Only the table.
mod tick_rate;

use hapterra::stability;
use hapterra_core::contact::work_per_tick;
use hapterra_core::rate::TickRate;
use hapterra_firmware::amplifier::{CURRENT_LOOP_US, DUTY_HZ};
use hapterra_image_tests::chip::Chip;
use hapterra_image_tests::device::{Device, Plane, machines, on_each_board};
use hapterra_tests::cycles::{Cycles, H743_DATA_LINES};
use hapterra_tests::repository;
use heightfield::Raster;

const HOME_MM: [f64; 3] = [100.0, 100.0, 75.0];

/// A board's row of the page.
struct Row {
    /// Cycles to the last output, and of the whole interrupt.
    cycles: [u32; 2],
    /// The same in µs.
    us: [u32; 2],
    fastest_hz: u32,
}

impl Row {
    fn read(board: &str) -> Self {
        let page = repository().join("docs/reference/hardware.md");
        let page = std::fs::read_to_string(page).expect("the page");
        let begin = format!("| `{board}`, interrupt | ");
        let row = page.lines().find(|line| line.starts_with(&begin));
        let row = row.unwrap_or_else(|| panic!("no row {begin}"));
        let cells: Vec<&str> = row[begin.len()..].split(" | ").collect();
        let number = |i: usize| {
            let digits: String = cells[i].chars().filter(char::is_ascii_digit).collect();
            digits.parse::<u32>().expect("a number")
        };
        Self {
            cycles: [number(0), number(2)],
            us: [number(1), number(3)],
            fastest_hz: 1_000 * number(4),
        }
    }
}

/// Returns the most cycles on a board's chip.
fn max_cycles(chip: &Chip, each: &[Cycles]) -> u32 {
    let cycles = each
        .iter()
        .map(|cycles| if chip.is_m7 { cycles.h743 } else { cycles.g474 });
    cycles.max().expect("some ticks")
}

/// Slides over rough ground at a depth of a millimetre and a half.
///
/// Safety: images.
#[test]
fn interrupt_cycles_stay_within_the_documented_maximum() {
    let plane = Plane::level(HOME_MM, 55.0);
    let raster = Raster::from_fn(201, 201, |x, y| 55.0 + 0.5 * ((x * y) % 3) as f32);
    on_each_board(
        &raster.expect("raster"),
        HOME_MM,
        |machine, terrain, scene| {
            let chip = machine.chip;
            let mut device = Device::arm(machine, terrain, scene);
            device.wait_for_full_force();
            device.move_to(plane.counts_at([100.0, 100.0], 1.5));
            let stopwatch = device.machine.borrow_mut().start_stopwatch();
            device.move_to(plane.counts_at([118.0, 91.0], 1.5));
            device.run_ms(5);
            let found = stopwatch.take();
            let documented = Row::read(chip.board);
            for (i, each) in [&found.to_output, &found.whole].into_iter().enumerate() {
                assert!(each.len() > 30, "{}", each.len());
                let (max_cycles, documented) = (max_cycles(chip, each), documented.cycles[i]);
                let instructions = each.iter().map(|cycles| cycles.instructions).max();
                let instructions = instructions.expect("some ticks");
                println!(
                    "{}: {max_cycles} cycles, {instructions} instructions",
                    chip.board
                );
                assert!(
                    max_cycles <= documented,
                    "{}: {max_cycles}, not {documented}",
                    chip.board
                );
                assert!(
                    max_cycles > documented * 3 / 4,
                    "{}: {max_cycles}, not {documented}",
                    chip.board
                );
            }
            let (board, latency_us) = (chip.board, device.latency_us);
            let behind_us = match board {
                "nucleo-g474re" => 3,
                "nucleo-h743zi2" => (2_000_000 / DUTY_HZ) as u16,
                _ => 15 + 10,
            };
            let states_us = documented.us[0] as u16 + behind_us + CURRENT_LOOP_US;
            assert_eq!(latency_us, states_us, "{board}");
            let tried_us = match board {
                "nucleo-h743zi2" => stability::LONG_US,
                _ => stability::SHORT_US,
            };
            assert!(latency_us <= tried_us, "{board}");
        },
    );
}

#[test]
fn fastest_accepted_tick_ends_in_time() {
    for (board, fastest_hz) in tick_rate::FASTEST_HZ {
        let documented = Row::read(board);
        let (core_hz, timer_hz) = match board {
            "nucleo-g474re" => (168_000_000, 42_000_000),
            _ => (456_000_000, 57_000_000),
        };
        let us = documented
            .cycles
            .map(|cycles| cycles.div_ceil(core_hz / 1_000_000));
        assert_eq!(documented.us, us, "{board}");
        // The converter on SPI adds its frames' time to the core's.
        let frames_us = if board == "nucleo-h743zi2-spi" { 15 } else { 0 };
        let in_time = |hz: u32| (us[1] + frames_us) * hz <= 1_000_000;
        let rates = (1..=10).map(|khz| 1_000 * khz);
        let rates = rates.filter(|hz| timer_hz % hz == 0 && in_time(*hz));
        assert_eq!(rates.max(), Some(fastest_hz), "{board}");
        assert_eq!(documented.fastest_hz, fastest_hz, "{board}");
    }
}

/// Returns the work units of the counted ticks, and of each tick at 2 kHz or faster.
fn counted_work() -> u32 {
    work_per_tick(TickRate::new(10_000).expect("a rate"))
}

/// Returns the most cycles of the stored table's rows whose names are in the list, or begin with an
/// entry that ends in `*`.
fn recorded(names: &[&str], is_m7: bool) -> u32 {
    let table = std::fs::read_to_string(repository().join("bench/cycles.csv")).expect("the table");
    let column = if is_m7 { 0 } else { 3 };
    let rows = table.lines().skip(1).map(|line| {
        let (mut cells, name) = (line.rsplit(','), line.rsplitn(8, ',').last());
        let cycles = cells.nth(column).and_then(|cell| cell.parse::<u32>().ok());
        (
            name.expect("a name").trim_matches('"'),
            cycles.expect("a number"),
        )
    });
    let fits = |name: &str, requested: &str| match requested.strip_suffix('*') {
        Some(begin) => name.starts_with(begin),
        None => name == requested,
    };
    let rows = rows.filter(|(name, _)| names.iter().any(|requested| fits(name, requested)));
    rows.map(|(_, cycles)| cycles).max().expect("a row")
}

/// The rate up to which the costliest ticks end in time: those of the counted scenes, and the
/// stress test's contact with all effects and materials around it, with the board's own part.
#[test]
fn rates_at_which_every_tick_ends_in_time_are_on_the_pages() {
    let mut in_time_khz = [u32::MAX; 2];
    for (board, is_m7, core_hz, frames_us) in [
        ("nucleo-g474re", false, 168_000_000, 0),
        ("nucleo-h743zi2", true, 456_000_000, 0),
        ("nucleo-h743zi2-spi", true, 456_000_000, 15),
    ] {
        let scene = recorded(&["chain, sliding fast, rough, controller"], is_m7);
        let own = Row::read(board).cycles[1] - scene;
        let around = recorded(&["chain, sliding fast, all effects and materials"], is_m7)
            - recorded(&["sliding fast, rough"], is_m7);
        let whole = recorded(&["chain*"], is_m7);
        let contact = recorded(&["soak*", "compared scenes"], is_m7);
        let costliest = whole.max(contact + around);
        let us = (costliest + own).div_ceil(core_hz / 1_000_000) + frames_us;
        println!("{board}: {us} µs at most");
        // A tick at 1 kHz may do more work, and each unit costs at most the same. This also applies
        // to the scenes on materials.
        let slow = TickRate::new(1_000).expect("a rate");
        let more = u64::from(contact) * u64::from(work_per_tick(slow)) / u64::from(counted_work());
        let materials = recorded(&["compared scenes on materials"], is_m7);
        let costliest = u64::from(materials).max(more + u64::from(around));
        let cycles = costliest + u64::from(own + frames_us * (core_hz / 1_000_000));
        println!("{board}: {cycles} cycles at most at 1 kHz");
        assert!(
            cycles <= u64::from(core_hz) / 1_000,
            "{board}: {cycles} cycles"
        );
        let khz = &mut in_time_khz[usize::from(is_m7)];
        *khz = (*khz).min(1_000 / us);
    }
    let [g474, h743] = in_time_khz;
    let rates = format!("in time **up to {g474} kHz on a G474 and up to {h743} kHz on an H743**");
    for page in [
        "docs/reference/cycles.md",
        "docs/reference/hardware.md",
        "docs/explanation/tiles-and-levels.md",
    ] {
        let text = std::fs::read_to_string(repository().join(page)).expect("the page");
        assert!(text.contains(&rates), "{page}: {rates}");
    }
}

/// Compares the loop's data with the lines in the model of cycles for an H743's AXI SRAM.
#[test]
fn loop_data_fit_the_cache_lines_of_the_model() {
    for machine in machines().into_iter().filter(|machine| machine.chip.is_m7) {
        let haptic_loop = machine.image.symbol_like(&["application", "LOOP"]);
        let bytes = haptic_loop.expect("the loop").size;
        // Two rows of a patch, each on two lines at most; queues, and other static data.
        let lines = u64::from(bytes / 32 + 1) + 4 * u64::from(counted_work()) + 64;
        assert!(lines <= H743_DATA_LINES, "{}: {lines}", machine.chip.board);
    }
}
