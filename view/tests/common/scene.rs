//! A scene of hills, and a hand that moves over them.

use hapterra_view_stream::{
    Hello, Layer, Link, Message, Sample, Scene, TILE_CELLS, TILE_POSTS, TickCost, Tile, Tiles,
    VERSION,
};

/// Cells along a side, mm each.
pub const CELLS: i32 = 160;
pub const CELL_MM: f64 = 0.5;
/// Metres in a millimetre.
pub const METRES: f64 = 60.0;
/// Stiffness, N/mm.
const STIFF: f64 = 0.5;

pub fn greeting() -> Message {
    Message::Hello(Hello {
        version: VERSION,
        program: "test".into(),
    })
}

pub fn scene(is_live: bool) -> Message {
    let side = f64::from(CELLS) * CELL_MM;
    Message::Scene(Box::new(Scene {
        title: "hills".into(),
        facts: vec![("1 mm in the hand".into(), "60 m".into())],
        is_live,
        keeps_tiles: false,
        level: 0,
        cell_mm: CELL_MM,
        mm_per_unit: 1.0 / METRES,
        tip_mm: 0.0,
        home_mm: [0.5 * side, 0.5 * side, 20.0],
        fitted_mm: [0.0, 0.0, side, side],
        ground_m_per_mm: Some(METRES),
        height_per_mm: METRES,
        height_unit: "m".into(),
        coordinates: None,
        tick: Some(TickCost {
            unit: "µs".into(),
            per_count: 0.01,
            bound: 1000.0,
        }),
    }))
}

/// Returns the height of the hills at a position, mm.
pub fn height(x: f64, y: f64) -> f64 {
    let ridge = (x * 0.11).sin() * (y * 0.07).cos();
    let rough = (x * 0.9 + (y * 0.4).sin()).sin() * (y * 0.8).cos();
    12.0 + 8.0 * ridge + 0.7 * rough
}

pub fn layer() -> Message {
    let posts = (CELLS + 1) as u32;
    let places = (0..posts).flat_map(|row| (0..posts).map(move |column| (column, row)));
    let heights = places
        .map(|(x, y)| (METRES * height(f64::from(x) * CELL_MM, f64::from(y) * CELL_MM)) as f32);
    Message::Layer(Layer {
        number: 0,
        first: [0, 0],
        step: 1,
        columns: posts,
        rows: posts,
        heights: heights.collect(),
    })
}

pub fn tile(index: [i32; 2]) -> Message {
    let [x, y] = index.map(|i| i * TILE_CELLS - 1);
    let posts = TILE_POSTS as i32;
    let places = (0..posts).flat_map(|row| (0..posts).map(move |column| (x + column, y + row)));
    let heights =
        places.map(|(x, y)| height(f64::from(x) * CELL_MM, f64::from(y) * CELL_MM) as f32);
    Message::Tile(Tile {
        slot: slot(index),
        index,
        heights_mm: heights.collect(),
    })
}

fn slot(index: [i32; 2]) -> u32 {
    (index[1].rem_euclid(4) * 4 + index[0].rem_euclid(4)) as u32
}

/// Returns the sample of the hand at a tick: it slides along a curve, pressed into the hills.
pub fn sample(tick: u64) -> Sample {
    let t_s = tick as f64 / 1000.0;
    let middle = 0.5 * f64::from(CELLS) * CELL_MM;
    let (x, y) = (
        middle + 0.7 * middle * (t_s * 0.31).sin(),
        middle + 0.6 * middle * (t_s * 0.23).cos(),
    );
    let ground = height(x, y);
    let deep = (1.0 + 0.8 * (t_s * 1.9).sin()).max(0.0);
    let contact = deep > 0.3;
    let hip = [x, y, ground - if contact { deep } else { -0.5 }];
    let force = if contact { STIFF * deep } else { 0.0 };
    Sample {
        t_s,
        hip_mm: hip,
        proxy_mm: if contact { [x, y, ground] } else { hip },
        force_n: [0.0, 0.0, force as f32],
        ground_mm: ground,
        contact,
        cost: (tick > 1).then_some(4000 + (tick % 97) as u32),
    }
}

/// Returns the first placement moved to the east by `east_mm`, mm of its own, and enlarged by
/// `scale`. The device keeps its tiles.
pub fn zoomed_scene(scale: f64, east_mm: f64) -> Message {
    let Message::Scene(mut scene) = scene(true) else {
        unreachable!()
    };
    let side = f64::from(CELLS) * CELL_MM;
    scene.keeps_tiles = true;
    scene.cell_mm *= scale;
    scene.mm_per_unit *= scale;
    scene.home_mm = [0.5 * side + east_mm, 0.5 * side, 20.0].map(|mm| scale * mm);
    // The same size in the hand as before.
    let [x, y, _] = scene.home_mm;
    let half = 0.5 * side;
    scene.fitted_mm = [x - half, y - half, x + half, y + half];
    scene.ground_m_per_mm = Some(METRES / scale);
    scene.height_per_mm = METRES / scale;
    Message::Scene(scene)
}

/// Returns samples of a hand that rests over the surface at the home position of such a placement,
/// so that no arrow hides the proxy.
pub fn resting(scale: f64, east_mm: f64) -> impl Fn(u64) -> Sample {
    let middle = 0.5 * f64::from(CELLS) * CELL_MM;
    let (x, y) = (middle + east_mm, middle);
    let ground = scale * height(x, y);
    let hip = [scale * x, scale * y, ground + scale];
    move |tick| Sample {
        t_s: tick as f64 / 1000.0,
        hip_mm: hip,
        proxy_mm: hip,
        force_n: [0.0; 3],
        ground_mm: ground,
        contact: false,
        cost: None,
    }
}

/// Returns the tiles around one, with the message that the device stores them.
pub fn tiles_around([col, row]: [i32; 2]) -> Vec<Message> {
    let around: Vec<_> = (-1..2)
        .flat_map(|dy| (-1..2).map(move |dx| [col + dx, row + dy]))
        .collect();
    let mut messages: Vec<_> = around.iter().map(|index| tile(*index)).collect();
    messages.push(Message::Tiles(Tiles {
        held: around,
        awaited: vec![],
    }));
    messages
}

/// Returns the batch that ends at a tick: samples, the tiles around the hand where
/// they have changed, and the link.
pub fn batch(from: u64, to: u64, held: &mut Vec<[i32; 2]>) -> Vec<Message> {
    let mut messages = Vec::new();
    let at = sample(to).hip_mm;
    let [col, row] = [at[0], at[1]].map(|mm| (mm / CELL_MM / 32.0).floor() as i32);
    let around: Vec<[i32; 2]> = (-1..3)
        .flat_map(|dy| (-1..3).map(move |dx| [col + dx, row + dy]))
        .filter(|index| index.iter().all(|i| (0..CELLS / TILE_CELLS).contains(i)))
        .collect();
    if *held != around {
        let new = around.iter().filter(|index| !held.contains(index));
        messages.extend(new.map(|index| tile(*index)));
        messages.push(Message::Tiles(Tiles {
            held: around.clone(),
            awaited: vec![],
        }));
        *held = around;
    }
    messages.push(Message::Samples((from..to).map(sample).collect()));
    messages.push(Message::Link(Link {
        t_s: to as f64 / 1000.0,
        tiles: to / 500,
        tile_bytes: to * 9,
        samples: to,
        ..Link::default()
    }));
    messages
}
