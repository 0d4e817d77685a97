//! Contact forces along a path over a field defined by a function.
//!
//! The haptic interface point (HIP) sinks into a hill and crosses it. The proxy stays on the
//! surface, and a spring between the two generates the force.
//!
//! ```text
//! cargo run -p hapterra-core --example forces_along_a_path
//! ```

use hapterra_core::Vec3;
use hapterra_core::contact::{Contact, ContactSettings};
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::{FieldError, FieldSize, TileArena};

/// Millimetres a cell: a hill of 8 cells is 16 mm high.
const CELL_MM: f32 = 2.0;
const TICKS: u16 = 1_000;

/// A round hill, 8 cells high, in the middle of 60 × 40 cells.
fn hill(x: i32, y: i32) -> f32 {
    let (x, y) = (x as f32 - 30.0, y as f32 - 20.0);
    8.0 * (-(x * x + y * y) / 100.0).exp()
}

/// Returns the HIP after a share `t` of the path, in cells: down to one cell above the plain, and
/// from west to east through the hill.
fn path(t: f32) -> Vec3 {
    Vec3::new(5.0 + 50.0 * t, 20.3, (9.0 - 80.0 * t).max(1.0))
}

pub(crate) fn main() -> Result<(), FieldError> {
    let mut field = TileArena::<2>::from_fn(FieldSize::new(60, 40), hill)?;
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);

    println!("  HIP x      z   proxy x      z     force east  north     up   state");
    let mut strongest = 0.0_f32;
    for tick in 0..=TICKS {
        let at = path(f32::from(tick) / f32::from(TICKS));
        let hip = GridPoint::new([0; 3], at);
        let output = contact.step(&window, &hip);
        let force_n = SurfaceParams::PREMIUM
            .spring()
            .force_n(output.displacement * CELL_MM);
        strongest = strongest.max(force_n.length());
        if tick % 50 == 0 {
            let proxy = output.proxy.relative_to([0; 3]);
            println!(
                "{:7.2} {:6.2}   {:7.2} {:6.2}   {:10.2} N {:6.2} {:6.2}   {:?}",
                at.x, at.z, proxy.x, proxy.z, force_n.x, force_n.y, force_n.z, output.state
            );
        }
    }
    println!("strongest force: {strongest:.2} N");
    assert!((1.0..=8.5).contains(&strongest), "the hill pushes back");
    Ok(())
}
