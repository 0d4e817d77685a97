//! Draws how a tip sticks and slips: a compliant hand drags it slowly over a plane with more
//! friction at rest than during sliding:
//! `cargo run -p hapterra-core --example stick_slip > docs/stick-slip.svg`.

use std::error::Error;

use hapterra_core::Vec3;
use hapterra_core::contact::{Contact, ContactSettings, Friction};
use hapterra_core::grid::GridPoint;
use hapterra_core::rate::TickRate;
use hapterra_core::terrain::{FieldSize, TileArena};

const FRICTION: Friction = Friction {
    static_mu: 0.6,
    dynamic_mu: 0.3,
    viscous_s: 0.0,
};
/// The stiffness of the surface, N/mm, and the depth of the HIP, cells of a millimetre: it presses
/// with 1 N.
const STIFFNESS: f32 = 0.5;
const DEPTH: f32 = 2.0;
/// The grasp, N/mm and N·s/mm, and the mass that moves with the tip, N·s²/mm: 0.1 kg.
const GRASP: f32 = 0.05;
const DAMPING: f32 = 1e-3;
const MASS: f32 = 1e-4;
/// The hand's speed, mm/s, and the duration, ticks.
const SPEED: f32 = 12.0;
const TICKS: u16 = 4000;
/// Steps of the motion in a tick.
const STEPS: u16 = 20;
/// Pixels of a second, of a newton and of a millimetre.
const SECOND: f32 = 155.0;
const NEWTON: f32 = 170.0;
const MM: f32 = 5.0;

/// Zero force, and zero distance, in pixels from the top.
const ICE: f32 = 160.0;
const START: f32 = 460.0;

/// Record of a tick: s, newtons along the surface, and mm from the start.
struct TickState {
    time: f32,
    force: f32,
    hand: f32,
    hip: f32,
    proxy: f32,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("{}", picture()?);
    Ok(())
}

/// Returns the picture.
pub(crate) fn picture() -> Result<String, Box<dyn Error>> {
    let states = simulate()?;
    let line = |color: &str, height: fn(&TickState) -> f32| {
        // Every fourth tick is less than a pixel.
        let points = states.iter().step_by(4);
        let points = points.map(|at| format!("{:.1},{:.1} ", at.time * SECOND, height(at)));
        let points: String = points.collect();
        format!(
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>\n"
        )
    };
    let lines = [
        line("#b5482c", |at| ICE - at.force * NEWTON),
        line("#888", |at| START - at.hand * MM),
        line("#1f5f9e", |at| START - at.hip * MM),
        line("#333", |at| START - at.proxy * MM),
    ]
    .concat();
    let [stuck, slid] = [FRICTION.static_mu, FRICTION.dynamic_mu].map(|mu| ICE - mu * NEWTON);
    Ok(format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="-10 0 720 480" font-family="sans-serif" font-size="13">
<rect x="-10" width="720" height="480" fill="#fff"/>
<path d="M0 {ICE}H620M0 {START}H620" stroke="#bbb"/>
<path d="M0 {stuck:.0}H620M0 {slid:.0}H620" stroke="#bbb" stroke-dasharray="4 4"/>
<text x="0" y="14" fill="#b5482c">Force along the surface, for 4 s; the tip presses with 1 N</text>
<text x="625" y="{stuck:.0}">0.6 N: breaks</text><text x="625" y="{slid:.0}">0.3 N: slides</text>
<text x="0" y="200">Path of <tspan fill="#888">the hand, 12 mm a second</tspan>, <tspan fill="#1f5f9e">the HIP</tspan> and <tspan fill="#333">the proxy</tspan></text>
{lines}</svg>"##
    ))
}

/// Runs a hand that moves east, and the tip that it drags.
fn simulate() -> Result<Vec<TickState>, Box<dyn Error>> {
    let size = FieldSize::new(64, 4);
    let mut field = TileArena::<2>::from_fn(size, |_, _| 0.0)?;
    let window = field.window();
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ.with_friction(FRICTION));
    // Counted from the place of contact onset.
    let at = |x: f32, height: f32| GridPoint::new([5, 2, 0], Vec3::new(x, 0.5, height));
    contact.step(&window, &at(0.0, 1.0));
    let tick_s = TickRate::DEFAULT.tick_s();
    let step_s = tick_s / f32::from(STEPS);
    let (mut hip, mut speed) = (0.0_f32, 0.0_f32);
    let mut states = Vec::new();
    for tick in 0..TICKS {
        let time = f32::from(tick) * tick_s;
        let hand = SPEED * time;
        let output = *contact.step(&window, &at(hip, -DEPTH));
        let pull = output.displacement.x;
        states.push(TickState {
            time,
            force: -pull * STIFFNESS,
            hand,
            hip,
            proxy: hip + pull,
        });
        for _ in 0..STEPS {
            let grasp = (hand - hip) * GRASP + (SPEED - speed) * DAMPING;
            speed += (grasp + pull * STIFFNESS) / MASS * step_s;
            hip += speed * step_s;
        }
    }
    Ok(states)
}
