//! Contacts on synthetic terrains.

use std::string::ToString;
use std::vec;
use std::vec::Vec;
use std::{f64, thread};

use crate::*;

fn flat(height: f64) -> Terrain {
    Terrain::from_fn(40, 40, 0.5, |_, _| height).expect("a terrain")
}

fn params(change: impl FnOnce(&mut SurfaceParams)) -> SurfaceParams {
    let mut params = SurfaceParams::PREMIUM;
    change(&mut params);
    params
}

#[test]
fn spring_pushes_up_by_its_stiffness() {
    let mut contact = Contact::new(flat(2.0), Surface::default()).expect("a contact");
    let air = contact.step([7.3, 8.1, 4.0]).expect("a step");
    assert_eq!((air.state, air.force_n), (State::Free, [0.0; 3]));
    assert!((air.proxy_mm[2] - 4.0).abs() < 1e-6);
    let touch = contact.step([7.3, 8.1, 1.0]).expect("a step");
    assert_eq!(
        (touch.state, touch.force_n),
        (State::Touching, [0.0, 0.0, 0.5])
    );
    assert_eq!(touch.proxy_mm[2], 2.0);
}

#[test]
fn start_below_ground_is_reported_without_force() {
    let mut contact = Contact::new(flat(2.0), Surface::default()).expect("a contact");
    let below = contact.step([5.0, 5.0, 1.0]).expect("a step");
    assert_eq!(below.state, State::BelowGround { surface_mm: 2.0 });
    assert_eq!(below.force_n, [0.0; 3]);
    let outside = contact.step([-5.0, 5.0, 1.0]).expect("a step");
    assert_eq!(outside.state, State::Outside);
    let steps = contact
        .run([[5.0, 5.0, 3.0], [5.0, 5.0, 1.5]])
        .expect("steps");
    assert_eq!(steps[1].state, State::Touching);
}

#[test]
fn large_array_fits_a_stack_of_256_kb() {
    let thread = thread::Builder::new().stack_size(256 * 1024);
    let run = || {
        let terrain = Terrain::from_fn(1000, 1000, 0.5, |x, y| (x + y) as f32 * 0.01);
        let mut contact =
            Contact::new(terrain.expect("a terrain"), Surface::default()).expect("a contact");
        contact.step([250.0, 250.0, 20.0]).expect("a step");
        contact.step([250.0, 250.0, 9.0]).expect("a step").force_n
    };
    let force_n = thread
        .spawn(run)
        .expect("a thread")
        .join()
        .expect("no overflow");
    assert!(force_n[2] > 0.4, "{force_n:?}");
}

#[test]
fn row_order_places_rows_south_or_north_first() {
    let rows = [[0.0_f32, 1.0, 2.0], [10.0, 11.0, 12.0]];
    let height = |order, x, y| {
        let terrain = Terrain::from_rows(1.0, order, &rows).expect("a terrain");
        terrain.height_mm(x, y)
    };
    assert_eq!(height(RowOrder::SouthFirst, 1.0, 1.0), Some(11.0));
    assert_eq!(height(RowOrder::NorthFirst, 1.0, 1.0), Some(1.0));
    assert_eq!(height(RowOrder::NorthFirst, 0.5, 0.5), Some(5.5));
    // The force shows the order: the ground rises to the south.
    let terrain = Terrain::from_rows(10.0, RowOrder::NorthFirst, &rows).expect("a terrain");
    let mut contact = Contact::new(terrain, Surface::default()).expect("a contact");
    contact.step([5.0, 5.0, 20.0]).expect("a step");
    assert!(contact.step([5.0, 5.0, 4.0]).expect("a step").force_n[1] > 0.1);
}

#[test]
fn nan_samples_are_no_data() {
    let hole = |x: u32, y: u32| if (x, y) == (10, 10) { f32::NAN } else { 1.0 };
    let terrain = Terrain::from_fn(40, 40, 1.0, hole).expect("a terrain");
    assert_eq!(terrain.height_mm(9.5, 9.5), None);
    let mut contact = Contact::new(terrain, Surface::default()).expect("a contact");
    let steps = contact
        .run([[9.5, 9.5, 3.0], [9.5, 9.5, 0.0]])
        .expect("steps");
    assert_eq!(steps[1].force_n, [0.0; 3]);
}

#[test]
fn blocks_of_a_callback_are_rendered_as_an_array() {
    let height = |x: u32, y: u32| 3.0 * f64::sin(f64::from(x) * 0.3) + f64::from(y) * 0.1;
    let array = Terrain::from_fn(300, 200, 0.7, height).expect("a terrain");
    let tiles = Terrain::from_tiles(300, 200, 0.7, move |block: Block, heights: &mut [f64]| {
        assert!(block.column + block.columns <= 300 && block.row + block.rows <= 200);
        assert_eq!(heights.len(), (block.columns * block.rows) as usize);
        for (at, out) in heights.iter_mut().enumerate() {
            let at = at as u32;
            *out = height(
                block.column + at % block.columns,
                block.row + at / block.columns,
            );
        }
        Ok(())
    });
    let surface =
        Surface::new(params(|it| it.friction = Friction::coulomb(0.3))).expect("a surface");
    let path = (0..4000).map(|n| {
        let t = f64::from(n) * 1e-3;
        [20.0 + 40.0 * t, 15.0 + 25.0 * t, 20.0 - 12.0 * t.min(1.0)]
    });
    let path: Vec<_> = path.collect();
    let run = |terrain| {
        let mut contact = Contact::new(terrain, surface.clone()).expect("a contact");
        contact.run(path.iter().copied()).expect("steps")
    };
    let (of_array, of_tiles) = (run(array), run(tiles.expect("a terrain")));
    assert_eq!(of_array, of_tiles);
    assert!(of_array.iter().any(|step| step.state == State::Touching));
}

#[test]
fn failed_read_leaves_the_contact_unchanged() {
    use core::sync::atomic::{AtomicBool, Ordering};
    static FAILS: AtomicBool = AtomicBool::new(false);
    let tiles = |_: Block, heights: &mut [f64]| match FAILS.load(Ordering::Relaxed) {
        true => Err(Unread(7)),
        false => {
            heights.fill(1.0);
            Ok(())
        }
    };
    let terrain = Terrain::from_tiles(5000, 5000, 1.0, tiles).expect("a terrain");
    let mut contact = Contact::new(terrain, Surface::default()).expect("a contact");
    contact
        .run([[10.0, 10.0, 2.0], [10.0, 10.0, 0.5]])
        .expect("steps");
    FAILS.store(true, Ordering::Relaxed);
    let error = contact.step([60.0, 10.0, 0.5]).expect_err("not read");
    assert_eq!(error, StepError::Unread(Unread(7)));
    assert_eq!(
        error.to_string(),
        "the source of the heights reported error 7"
    );
    FAILS.store(false, Ordering::Relaxed);
    let step = contact.step([60.0, 10.0, 0.5]).expect("a step");
    assert_eq!(
        (step.state, step.force_n),
        (State::Touching, [0.0, 0.0, 0.25])
    );
}

#[test]
fn every_parameter_changes_the_force() {
    let wavy = |x: u32, _| 2.0 * f64::sin(f64::from(x) * 0.5);
    let terrain = Terrain::from_fn(200, 200, 1.0, wavy).expect("a terrain");
    // Down, then a rest on the slope, then along it.
    let path = (0..2500).map(|n| {
        let t = f64::from(n);
        [
            20.0 + 0.01 * (t - 800.0).max(0.0),
            30.0,
            (8.0 - 0.02 * t).max(-2.0),
        ]
    });
    let path: Vec<_> = path.collect();
    let run = |params: SurfaceParams| {
        let surface = Surface::new(params).expect("a surface");
        let mut contact = Contact::new(terrain.clone(), surface).expect("a contact");
        let steps = contact.run(path.iter().copied()).expect("steps");
        steps.iter().map(|step| step.force_n).collect::<Vec<_>>()
    };
    let grain = Texture {
        pattern: Pattern::Grain,
        amplitude_mm: 0.1,
        wavelength_mm: 1.0,
        ..Texture::NONE
    };
    let plain = run(SurfaceParams::PREMIUM);
    let viscous = Friction {
        viscous_s: 0.02,
        ..Friction::NONE
    };
    let statics = Friction {
        static_mu: 0.6,
        ..Friction::coulomb(0.2)
    };
    let changed: [SurfaceParams; 7] = [
        params(|it| it.stiffness_n_per_mm = 0.6),
        params(|it| it.max_force_n = 0.7),
        params(|it| it.friction = Friction::coulomb(0.2)),
        params(|it| it.friction = viscous),
        params(|it| it.damping.ns_per_m = 5.0),
        params(|it| it.shading = Shading::Smooth),
        params(|it| it.texture = grain),
    ];
    for params in changed {
        assert!(run(params) != plain, "{params:?}");
    }
    assert!(run(params(|it| it.friction = statics)) != run(changed[2]));
}

#[test]
fn out_of_range_parameters_are_reported() {
    let bad = [
        (
            params(|it| it.stiffness_n_per_mm = -1.0),
            "stiffness, N/mm, is -1: use 0 to",
        ),
        (
            params(|it| it.max_force_n = f32::NAN),
            "max_force, N, is NaN",
        ),
        (
            params(|it| it.friction.dynamic_mu = 11.0),
            "dynamic friction is 11: use 0 to 10",
        ),
        (
            params(|it| it.friction.static_mu = -0.5),
            "static friction is -0.5",
        ),
        (
            params(|it| it.friction.dynamic_mu = 0.5),
            "static friction is never less",
        ),
        (
            params(|it| it.friction.viscous_s = 2.0),
            "viscous friction, s, is 2: use 0 to 1",
        ),
        (
            params(|it| it.damping.ns_per_m = 21.0),
            "damping, N·s/m, is 21: use 0 to 20",
        ),
        (
            params(|it| it.texture.pattern = Pattern::Grain),
            "texture wavelength, mm, is 0: use 0.25 to 100",
        ),
    ];
    for (params, text) in bad {
        let error = Surface::new(params).expect_err("is refused").to_string();
        assert!(error.contains(text), "{error}");
        assert!(!params.is_valid());
    }
    assert_eq!(
        Surface::default(),
        Surface::new(SurfaceParams::PREMIUM).expect("valid")
    );
}

#[test]
fn invalid_terrains_are_errors() {
    let of = |columns, rows, cell_mm, heights: &[f64]| {
        let terrain = Terrain::from_slice(columns, rows, cell_mm, RowOrder::SouthFirst, heights);
        let made = terrain.map_err(|error| error.to_string());
        let made = made.map(|it| Contact::new(it, Surface::default()));
        match made {
            Err(error) => error,
            Ok(contact) => contact.err().expect("is refused").to_string(),
        }
    };
    assert!(of(1, 4, 1.0, &[0.0; 4]).contains("1 × 4 samples"));
    assert!(of(2, 3, 1.0, &[0.0; 5]).contains("5 samples for 2 columns and 3 rows"));
    assert!(of(2, 2, 0.0, &[0.0; 4]).contains("a cell of 0 mm"));
    assert!(of(2, 2, 1.0, &[0.0, 0.0, 1e10, 0.0]).contains("1.0000e10 cells"));
    assert!(of(2, 2, 1.0, &[0.0, 0.0, f64::INFINITY, 0.0]).contains("inf cells"));
    assert!(of(2, 2, 1.0, &[0.0, 0.0, 1e5, 0.0]).contains("sample 0, 0, from the south-west"));
    let ragged = [vec![0.0; 3], vec![0.0; 2]];
    let error = Terrain::from_rows(1.0, RowOrder::NorthFirst, &ragged).expect_err("is refused");
    assert_eq!(
        error.to_string(),
        "row 1 has 2 samples and row 0 has 3: make all rows equally long"
    );
    let metres = Terrain::from_fn(3, 3, 0.1, |x, _| x as i16 * 2000).expect("a terrain");
    let metres = metres.with_height_scale(0.01).expect("a scale");
    assert!(Contact::new(metres, Surface::default()).is_ok());
    let none: [[f64; 0]; 0] = [];
    assert!(Terrain::from_rows(1.0, RowOrder::NorthFirst, &none).is_err());
}

#[test]
fn out_of_range_positions_and_rates_are_errors() {
    let mut contact = Contact::new(flat(0.0), Surface::default()).expect("a contact");
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        assert!(matches!(
            contact.step([0.0, bad, 0.0]),
            Err(StepError::Place { .. })
        ));
    }
    let error = contact
        .run([[1.0; 3], [f64::NAN; 3]])
        .expect_err("is refused");
    assert_eq!(error.done.len(), 1);
    let rate = Contact::at_rate(flat(0.0), Surface::default(), 1500).err();
    assert_eq!(rate, Some(ContactError::Rate(1500)));
}

#[test]
fn rate_sets_the_speed_of_damping() {
    let surface = || Surface::new(params(|it| it.damping.ns_per_m = 10.0)).expect("a surface");
    let force = |rate_hz| {
        let mut contact = Contact::at_rate(flat(0.0), surface(), rate_hz).expect("a contact");
        contact.step([5.0, 5.0, 1.0]).expect("a step");
        let path = (0..100).map(|n| [5.0, 5.0, -0.01 * f64::from(n)]);
        contact.run(path).expect("steps")[99].force_n[2]
    };
    // 0.99 mm deep, at 10 and at 40 mm/s.
    assert!((force(1000) - 0.595).abs() < 1e-3, "{}", force(1000));
    assert!((force(4000) - 0.895).abs() < 1e-3, "{}", force(4000));
}

#[test]
fn surface_change_keeps_the_contact() {
    let mut contact = Contact::new(flat(2.0), Surface::default()).expect("a contact");
    contact.step([5.0, 5.0, 3.0]).expect("a step");
    let stiff = || Surface::new(params(|it| it.stiffness_n_per_mm = 1.0)).expect("a surface");
    // In the air, and through the surface in the next step.
    contact.set_surface(stiff()).expect("fits");
    let step = contact.step([5.0, 5.0, 1.5]).expect("a step");
    assert_eq!(
        (step.state, step.force_n),
        (State::Touching, [0.0, 0.0, 0.5])
    );
    // On the ground.
    let rough = Surface::new(params(|it| it.friction = Friction::coulomb(0.5))).expect("a surface");
    contact.set_surface(rough).expect("fits");
    let step = contact.step([5.0, 5.0, 1.5]).expect("a step");
    assert_eq!(
        (step.state, step.force_n),
        (State::Touching, [0.0, 0.0, 0.25])
    );
    let step = contact.step([5.1, 5.0, 1.5]).expect("a step");
    assert!(step.force_n[0] < -0.04, "friction holds: {step:?}");
}

#[test]
fn materials_are_rendered_in_place() {
    let soft = Material {
        stiffness_n_per_mm: 0.1,
        ..Material::of(&SurfaceParams::PREMIUM)
    };
    let surface = Surface::default()
        .with_materials(&[soft])
        .expect("a surface");
    let east = (0..40 * 40)
        .map(|at| u8::from(at % 40 >= 20))
        .collect::<Vec<_>>();
    let terrain = flat(1.0)
        .with_materials(RowOrder::SouthFirst, east)
        .expect("fits");
    let mut contact = Contact::new(terrain.clone(), surface.clone()).expect("a contact");
    let mut force = |x: f64| {
        contact.step([x, 5.0, 3.0]).expect("a step");
        let steps = contact.run(vec![[x, 5.0, 0.0]; 300]).expect("steps");
        steps[299].force_n[2]
    };
    assert_eq!((force(3.0), force(17.0)), (0.5, 0.1));
    let error = Contact::new(terrain, Surface::default()).err();
    assert_eq!(error, Some(ContactError::Material { found: 1, count: 1 }));
    // A terrain without materials: the surface itself.
    let mut contact = Contact::new(flat(1.0), surface).expect("a contact");
    let steps = contact
        .run([[17.0, 5.0, 3.0], [17.0, 5.0, 0.0]])
        .expect("steps");
    assert_eq!(steps[1].force_n[2], 0.5);
}

#[test]
fn contact_moves_to_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<Contact>();
    is_send::<Terrain>();
}
