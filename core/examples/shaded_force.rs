//! Draws how far the force leans east over a valley, a ridge and a cliff, without and with shading:
//! `cargo run -p hapterra-core --example shaded_force > docs/shading.svg`.

use hapterra_core::Vec3;
use hapterra_core::contact::{Contact, ContactSettings};
use hapterra_core::force::{Shader, Shading};
use hapterra_core::grid::GridPoint;
use hapterra_core::terrain::{FieldSize, TileArena};

/// Heights of a section, cells: the ground is the same from south to north.
const SECTION: [f32; 11] = [1.5, 1.5, 1.0, 0.5, 1.0, 1.5, 1.0, 0.5, 0.5, 6.5, 6.5];
/// HIPs per cell, and their depth, cells.
const A_CELL: i32 = 100;
const DEPTH: f32 = 0.02;
/// Pixels of a cell, of its height, and of a degree.
const CELL: f32 = 70.0;
const HEIGHT: f32 = 20.0;
const DEGREE: f32 = 1.1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{}", picture()?);
    Ok(())
}

/// Returns the picture.
pub(crate) fn picture() -> Result<String, Box<dyn std::error::Error>> {
    let size = FieldSize::new(SECTION.len() as i32 - 1, 4);
    let mut field = TileArena::<1>::from_fn(size, |x, _| SECTION[x as usize])?;
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut shader = Shader::of(Shading::Smooth).ok_or("no shading")?;
    let (mut plain, mut shaded) = (String::new(), String::new());
    contact.step(&window, &hip(A_CELL, 1.0));
    for i in A_CELL..=(size.columns - 1) * A_CELL {
        let output = *contact.step(&window, &hip(i, -DEPTH));
        let x = i as f32 / A_CELL as f32 * CELL;
        for (line, force) in [
            (&mut plain, output.displacement),
            (&mut shaded, shader.shade(&window, &contact)),
        ] {
            let lean = force.x.atan2(force.z).to_degrees();
            line.push_str(&format!("{x:.1},{:.1} ", 120.0 - lean * DEGREE));
        }
    }
    let place =
        |(i, z): (usize, &f32)| format!("{:.0},{:.0} ", i as f32 * CELL, 370.0 - z * HEIGHT);
    let ground: String = SECTION.iter().enumerate().map(place).collect();
    Ok(format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-10 0 720 390" font-family="sans-serif" font-size="13">
<rect x="-10" width="720" height="390" fill="#fff"/>
<path d="M0 120H700" stroke="#bbb"/>
<text x="0" y="14">How far the force leans east, degrees; the line is upright</text>
<text x="0" y="140" fill="#b5482c">without shading</text><text x="0" y="158" fill="#1f5f9e">with shading</text>
<polyline points="{plain}" fill="none" stroke="#b5482c" stroke-width="1.5"/>
<polyline points="{shaded}" fill="none" stroke="#1f5f9e" stroke-width="2"/>
<polyline points="{ground}" fill="none" stroke="#333" stroke-width="2"/>
<text x="0" y="386">The ground, in section: a valley, a ridge, and a cliff; heights at two sevenths</text>
</svg>"##
    ))
}

/// Returns a HIP at a height above the section; HIPs are a hundredth of a cell apart.
fn hip(i: i32, above: f32) -> GridPoint {
    let (cell, u) = (i / A_CELL, (i % A_CELL) as f32 / A_CELL as f32);
    let [from, to] = [0, 1].map(|next| SECTION[(cell as usize + next).min(SECTION.len() - 1)]);
    let height = from + (to - from) * u + above;
    GridPoint::new([cell, 2, 0], Vec3::new(u, 0.5, height))
}
