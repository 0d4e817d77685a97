//! Runs one state of the tick, to count its instructions: `valgrind --tool=callgrind
//! --toggle-collect='*counted_tick*' hapterra-tick sliding` divided by the ticks printed.

#![forbid(unsafe_code)]

use std::hint::black_box;
use std::process::ExitCode;

use hapterra_lab::product::{self, Product};
use hapterra_lab::tick_states::{STATES, terrain};
use hapterra_lab::variant::{ContactResult, Haptics, Hip};

/// Tiles along the window's side, as on a device.
const SIDE: usize = 8;

fn main() -> ExitCode {
    let requested = std::env::args().nth(1).unwrap_or_default();
    let Some((_, make)) = STATES.iter().find(|(name, _)| *name == requested) else {
        let names = STATES.map(|(name, _)| format!("{name:?}")).join(", ");
        eprintln!("error: no state is called {requested:?}\nhint: name one of {names}");
        return ExitCode::FAILURE;
    };
    let grid = terrain();
    let mut buffers = product::buffers::<SIDE>();
    let window = product::window::<SIDE>(&grid, &mut buffers);
    let mut product = Product::new(&window);
    let mut ticks = 0;
    for step in make(&grid) {
        if step.counts {
            black_box(counted_tick(&mut product, &step.hip));
            ticks += 1;
        } else {
            black_box(product.tick(&step.hip));
        }
    }
    println!("{ticks}");
    ExitCode::SUCCESS
}

/// Runs one tick; callgrind counts this function by its name.
#[inline(never)]
fn counted_tick(product: &mut Product<'_, '_, SIDE>, hip: &Hip) -> ContactResult {
    product.tick(hip)
}
