//! Instructions from the read of the encoders to the last command that follows from it,
//! in the boards' own images.

use hapterra::raster::Raster;
use hapterra_image_tests::device::{Device, Plane, on_each_board};
use hapterra_tests::repository;

const HOME_MM: [f64; 3] = [100.0, 100.0, 75.0];

/// The median and the largest of some counts.
fn figures(mut counts: Vec<u64>) -> (u64, u64) {
    counts.sort_unstable();
    let largest = counts.last().copied().expect("some ticks");
    (counts[counts.len() / 2], largest)
}

/// The most instructions that the page says of a board: the last cell of its row.
fn said(page: &str, board: &str) -> u64 {
    let begin = format!("| `{board}`, encoder to output | ");
    let row = page.lines().find(|line| line.starts_with(&begin));
    let row = row.unwrap_or_else(|| panic!("no row {begin}"));
    let cell = row[begin.len()..].split(" | ").next().expect("a cell");
    cell.replace(',', "").parse().expect("a count")
}

/// Slides over rough ground, pressing by a millimetre and a half.
#[test]
fn the_instructions_from_encoder_to_output_are_at_most_what_the_page_says() {
    let page = std::fs::read_to_string(repository().join("docs/hardware.md")).expect("the page");
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
            device.machine.borrow_mut().start_stopwatch();
            device.move_to(plane.counts_at([118.0, 91.0], 1.5));
            device.run_ms(5);
            let stopwatch = device.machine.borrow().bus().stopwatch.take();
            let taken = stopwatch.expect("it runs").taken;
            assert!(taken.len() > 30, "{}", taken.len());
            let (median, largest) = figures(taken);
            println!("{}: median {median}, largest {largest}", chip.board);
            let said = said(&page, chip.board);
            assert!(largest <= said, "{}: {largest}, not {said}", chip.board);
            assert!(largest > said / 2, "{}: {largest}, not {said}", chip.board);
        },
    );
}
