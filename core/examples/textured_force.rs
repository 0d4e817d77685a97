//! Draws the force over a grating and over grain in a level plane, and the fade of a texture with
//! increasing speed: `cargo run -p hapterra-core --example textured_force > docs/texture.svg`.

use hapterra_core::Vec3;
use hapterra_core::force::{Pattern, Texture, Texturer};
use hapterra_core::grid::GridPoint;
use hapterra_core::rate::TickRate;

/// Stiffness, N/mm, and depth, mm: half a newton without texture.
const STIFFNESS: f32 = 0.5;
const DEPTH: f32 = 1.0;
/// Path over the plane, mm, and distance between HIPs, mm.
const PATH_MM: f32 = 10.0;
const STEP: f32 = 0.02;
/// Pixels of a millimetre, and of a newton.
const MM: f32 = 70.0;
const NEWTON: f32 = 340.0;

const TEXTURE: Texture = Texture {
    pattern: Pattern::Grating,
    amplitude_mm: 0.1,
    wavelength_mm: 2.0,
    direction_deg: 0.0,
    seed: 5,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{}", picture()?);
    Ok(())
}

/// Returns the picture.
pub(crate) fn picture() -> Result<String, Box<dyn std::error::Error>> {
    let grain = Texture {
        pattern: Pattern::Grain,
        ..TEXTURE
    };
    let mut lines = String::new();
    for (texture, middle) in [(TEXTURE, 90.0), (grain, 230.0)] {
        let forces = rendered(&texture, STEP, (PATH_MM / STEP) as usize)?;
        for (color, part) in [("#1f5f9e", Vec3::Z), ("#b5482c", Vec3::X)] {
            let points = forces.iter().enumerate().map(|(i, force)| {
                let off = part.dot(*force - Vec3::Z * STIFFNESS * DEPTH);
                let (x, y) = (i as f32 * STEP * MM, middle - off * NEWTON);
                format!("{x:.1},{y:.1} ")
            });
            lines += &polyline(color, &points.collect::<String>());
        }
    }
    let faded = (0..=120).map(|i| {
        let speed = 0.0025 * i as f32;
        // Not in step with the ticks.
        let forces = rendered(&TEXTURE, (speed + 1.3e-5) * TEXTURE.wavelength_mm, 20_000);
        let max = forces.map(|forces| forces.iter().fold(0.0, |max, f| f32::max(max, f.z)));
        let share = (max.unwrap_or_default() / STIFFNESS - DEPTH) / TEXTURE.amplitude_mm;
        format!("{:.1},{:.1} ", i as f32 * 5.6, 440.0 - 90.0 * share)
    });
    lines += &polyline("#333", &faded.skip(4).collect::<String>());
    Ok(format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-10 0 720 480" font-family="sans-serif" font-size="13">
<rect x="-10" width="720" height="480" fill="#fff"/>
<path d="M0 90H700M0 230H700M0 440H700" stroke="#bbb"/>
<path d="M280 440v-96M560 440v-96" stroke="#bbb"/>
<text x="0" y="14">A grating of 0.1 mm every 2 mm, over 10 mm, at 1 mm depth: 0.05 N more and less than 0.5 N</text>
<text x="0" y="31"><tspan fill="#1f5f9e">along the normal</tspan>, and up to 0.13 N <tspan fill="#b5482c">along the surface</tspan></text>
<text x="0" y="175">Grain of the same amplitude and wavelength</text>
<text x="0" y="325">Rendered part of a texture against the path of the proxy in a tick</text>
<text x="238" y="460">1/8 wavelength</text><text x="518" y="460">1/4 wavelength</text>
{lines}</svg>"##
    ))
}

fn polyline(color: &str, points: &str) -> String {
    format!(
        "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>\n"
    )
}

/// Returns the forces on a path eastward, after a rest at its start.
fn rendered(texture: &Texture, step_mm: f32, ticks: usize) -> Result<Vec<Vec3>, &'static str> {
    let texturer = Texturer::of(texture, 1.0, TickRate::DEFAULT);
    let mut texturer = texturer.ok_or("no texture")?;
    let at = |i: usize| GridPoint::new([0, 7, 0], Vec3::new(i as f32 * step_mm, 0.3, 0.0));
    let mut step = |i| texturer.add(Vec3::Z * DEPTH, &at(i)) * STIFFNESS;
    for _ in 0..100 {
        step(0);
    }
    let before: Vec<Vec3> = (0..100).map(&mut step).collect();
    let after = (100..ticks + 100).map(&mut step);
    // Slow paths are drawn from their start; at speed the share must first become steady.
    match step_mm <= STEP {
        true => Ok(before.into_iter().chain(after).take(ticks).collect()),
        false => Ok(after.collect()),
    }
}
