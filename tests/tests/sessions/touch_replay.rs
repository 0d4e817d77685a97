//! Forces of the library for arrays equal those of `replay` on a file of the same heights, to the
//! bit.

use hapterra::materials::{ClassMaterial, ClassMaterials, Materials};
use hapterra::replay::{on_native_at, state_name};
use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain};
use hapterra_core::rate::TickRate;
use hapterra_tests::random_paths::wander;
use hapterra_touch as touch;
use hapterra_touch::{
    Contact, Damping, Friction, Material, Pattern, RowOrder, Shading, State, Surface,
    SurfaceParams, Texture,
};
use heightfield::{OpenOptions, Raster};

const COLUMNS: u32 = 130;
const ROWS: u32 = 97;
const CELL_MM: f64 = 0.7;

/// Returns rough hills with no-data, the northern row first.
fn heights() -> Vec<f64> {
    let height = |at: u32| {
        let (x, y) = (f64::from(at % COLUMNS), f64::from(at / COLUMNS));
        let hole = at.is_multiple_of(997);
        let hill = 6.0 * (0.21 * x).sin() * (0.13 * y).cos() + 0.4 * (2.1 * x + 1.3 * y).sin();
        if hole { f64::NAN } else { hill - 1000.3 }
    };
    (0..COLUMNS * ROWS).map(height).collect()
}

/// Writes and opens a `.npy` file of heights of a type.
fn npy(descr: &str, samples: impl Iterator<Item = Vec<u8>>) -> Raster {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({ROWS}, {COLUMNS}), }}");
    let header = format!("{header:<117}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(samples.flatten());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("heights.npy");
    std::fs::write(&path, bytes).expect("written");
    Raster::open(&path, &OpenOptions::default()).expect("a raster")
}

fn rough() -> SurfaceParams {
    SurfaceParams {
        stiffness_n_per_mm: 0.4,
        max_force_n: 6.0,
        friction: Friction {
            static_mu: 0.5,
            dynamic_mu: 0.3,
            viscous_s: 0.004,
        },
        damping: Damping {
            ns_per_m: 2.0,
            ..Damping::NONE
        },
        shading: Shading::Smooth,
        texture: Texture {
            pattern: Pattern::Grain,
            amplitude_mm: 0.1,
            wavelength_mm: 1.5,
            direction_deg: 0.0,
            seed: 3,
        },
    }
}

fn name(state: State) -> &'static str {
    match state {
        State::Free => "free",
        State::Touching => "touching",
        State::Releasing => "releasing",
        State::BelowGround { .. } | State::Outside => "unseeded",
    }
}

/// Checks that both render the same on a wandering path, bit for bit. Returns the number of
/// positions in contact.
fn same(
    terrain: &Terrain<'_>,
    contact: &mut Contact,
    params: SurfaceParams,
    rate: u32,
    seed: u64,
) -> usize {
    let rate = TickRate::new(rate).expect("a rate");
    let mut replayer = on_native_at(rate, terrain, params).expect("opened");
    let mut touched = 0;
    for (row, hip_mm) in wander(terrain, seed, 4_000, -2.0).into_iter().enumerate() {
        let hip = terrain.scale().to_grid(hip_mm).expect("addressable");
        let sample = replayer.step(hip).expect("rendered");
        let proxy_mm = terrain.scale().to_mm(&sample.proxy);
        let step = contact.step(hip_mm).expect("a step");
        let bits = step.force_n.map(f32::to_bits);
        assert_eq!(
            (bits, step.proxy_mm.map(f64::to_bits), name(step.state)),
            (
                sample.force_n.to_array().map(f32::to_bits),
                proxy_mm.map(f64::to_bits),
                state_name(sample.state)
            ),
            "row {row} at {hip_mm:?}: {step:?}, not {sample:?}"
        );
        assert_eq!(
            contact.terrain().height_mm(hip_mm[0], hip_mm[1]),
            terrain.height_mm(hip_mm[0], hip_mm[1])
        );
        touched += usize::from(step.state == State::Touching);
    }
    touched
}

#[test]
fn forces_over_an_array_are_those_of_a_replay() {
    let heights = heights();
    let raster = npy(
        "<f8",
        heights.iter().map(|height| height.to_le_bytes().to_vec()),
    );
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
    let ground = touch::Terrain::from_slice(COLUMNS, ROWS, CELL_MM, RowOrder::NorthFirst, &heights);
    let ground = ground.expect("a terrain");
    for (params, rate, seed) in [
        (SurfaceParams::PREMIUM, 1_000, 1),
        (rough(), 1_000, 2),
        (rough(), 4_000, 3),
    ] {
        let surface = Surface::new(params).expect("a surface");
        let mut contact = Contact::at_rate(ground.clone(), surface, rate).expect("a contact");
        let touched = same(&terrain, &mut contact, params, rate, seed);
        assert!(touched > 1_000, "{touched} in contact");
    }
}

/// Radii from less than a cell to 8 cells; the smallest has haptic cells of half a count.
#[test]
fn forces_under_a_tip_are_those_of_a_replay() {
    let heights = heights();
    let raster = npy(
        "<f8",
        heights.iter().map(|height| height.to_le_bytes().to_vec()),
    );
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    let ground = touch::Terrain::from_slice(COLUMNS, ROWS, CELL_MM, RowOrder::NorthFirst, &heights);
    let ground = ground.expect("a terrain");
    for (tip_mm, seed) in [(0.2, 6), (1.0, 7), (2.0, 8), (8.0 * CELL_MM, 9)] {
        let grid = HapticGrid::new(&raster, HapticCells::default()).with_tip(tip_mm);
        let terrain = Terrain::over(grid, scale, 0).expect("a terrain");
        let surface = Surface::new(rough()).expect("a surface");
        let ball = ground.clone().with_tip(tip_mm).expect("a ball");
        let mut contact = Contact::new(ball, surface).expect("a contact");
        let touched = same(&terrain, &mut contact, rough(), 1_000, seed);
        assert!(touched > 1_000, "{tip_mm} mm: {touched} in contact");
    }
}

#[test]
fn integers_at_a_height_scale_are_those_of_a_replay() {
    let heights: Vec<i16> = heights()
        .iter()
        .map(|height| (height * 9.0) as i16)
        .collect();
    let raster = npy(
        "<i2",
        heights.iter().map(|height| height.to_le_bytes().to_vec()),
    );
    let (cell_mm, mm_per_unit) = (0.3, 0.017);
    let scale = Scale::new(cell_mm, mm_per_unit).expect("a scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("a terrain");
    let ground = touch::Terrain::from_vec(COLUMNS, ROWS, cell_mm, RowOrder::NorthFirst, heights);
    let ground = ground.and_then(|it| it.with_height_scale(mm_per_unit));
    let surface = Surface::new(rough()).expect("a surface");
    let mut contact = Contact::new(ground.expect("a terrain"), surface).expect("a contact");
    assert!(same(&terrain, &mut contact, rough(), 1_000, 4) > 1_000);
}

#[test]
fn materials_are_those_of_a_replay() {
    let heights = heights();
    let class = |at: usize| [0, 7, 9][(at % COLUMNS as usize / 11 + at / 1300) % 3];
    let classes: Vec<u8> = (0..heights.len()).map(class).collect();
    let raster = npy(
        "<f8",
        heights.iter().map(|height| height.to_le_bytes().to_vec()),
    );
    let of_classes = npy("|u1", classes.iter().map(|class| vec![*class]));
    let materials = [
        Material {
            stiffness_n_per_mm: 0.2,
            ..Material::of(&rough())
        },
        Material {
            friction: Friction::coulomb(0.7),
            texture: Texture::NONE,
            ..Material::of(&rough())
        },
    ];
    let named = [7, 9].into_iter().zip(materials);
    let class_materials = ClassMaterials {
        default: Material::of(&rough()),
        class: named
            .map(|(class, material)| ClassMaterial {
                class,
                name: None,
                material,
            })
            .collect(),
    };
    let over = Materials::over(
        ("heights", &raster),
        ("classes", of_classes),
        class_materials,
    );
    let over = over.expect("they overlap");
    let grid = HapticGrid::new(&raster, HapticCells::default()).with_materials(Some(&over));
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    let params = over.params(&rough());
    let ground = touch::Terrain::from_vec(COLUMNS, ROWS, CELL_MM, RowOrder::NorthFirst, heights);
    let index = |class: &u8| {
        [0, 7, 9]
            .iter()
            .position(|it| it == class)
            .expect("a class") as u8
    };
    let indices = classes.iter().map(index).collect();
    let ground = ground.and_then(|it| it.with_materials(RowOrder::NorthFirst, indices));
    let surface = Surface::new(params).and_then(|it| it.with_materials(&materials));
    let (ground, surface) = (ground.expect("a terrain"), surface.expect("a surface"));
    for (tip_mm, seed) in [(0.0, 5), (3.0, 10)] {
        let terrain = Terrain::over(grid.with_tip(tip_mm), scale, 0).expect("a terrain");
        let ball = ground.clone().with_tip(tip_mm).expect("a ball");
        let mut contact = Contact::new(ball, surface.clone()).expect("a contact");
        let touched = same(&terrain, &mut contact, params, 1_000, seed);
        assert!(touched > 1_000, "{tip_mm} mm: {touched} in contact");
    }
}
