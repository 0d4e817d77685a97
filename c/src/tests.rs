//! Numbers pass the interface unchanged.

use std::mem::MaybeUninit;

use hapterra_touch::{Contact, RowOrder, Surface, Terrain};

use crate::contact::{
    HapterraStep, hapterra_contact_begin, hapterra_contact_new, hapterra_contact_run,
};
use crate::surface_params::{
    HapterraShading, HapterraSurface, HapterraTexture, hapterra_surface_default,
};
use crate::terrain::{hapterra_terrain_new, hapterra_terrain_set_f64, hapterra_terrain_set_tip};

/// Returns a surface in which every field differs from the default.
fn rough() -> HapterraSurface {
    HapterraSurface {
        stiffness_n_per_mm: 0.4,
        max_force_n: 6.0,
        static_friction: 0.5,
        dynamic_friction: 0.3,
        viscous_friction_s: 0.004,
        damping_ns_per_m: 2.0,
        shading: HapterraShading::Smooth as u32,
        texture: HapterraTexture::Grain as u32,
        texture_amplitude_mm: 0.1,
        texture_wavelength_mm: 1.5,
        texture_direction_deg: 7.0,
        texture_seed: 3,
    }
}

#[test]
fn surface_round_trips_every_field() {
    let params = rough().params().expect("known numbers");
    assert_eq!(HapterraSurface::of(&params), rough());
    let mut default = MaybeUninit::uninit();
    hapterra_surface_default(Some(&mut default));
    // SAFETY: it was just filled.
    let default = unsafe { default.assume_init() };
    let params = default.params().expect("known numbers");
    assert_eq!(Surface::new(params).expect("in bounds"), Surface::default());
    assert_eq!(
        (size_of::<HapterraSurface>(), size_of::<HapterraStep>()),
        (48, 64)
    );
}

#[test]
fn steps_equal_those_of_the_touch_crate() {
    let heights: Vec<f64> = (0..60 * 50)
        .map(|at| 4.0 * (f64::from(at) * 0.37).sin())
        .collect();
    let path: Vec<_> = (0..3000)
        .map(|n| {
            let t = f64::from(n) * 1e-3;
            [10.0 + 6.0 * t, 8.0 + 3.0 * t, 6.0 - 8.0 * t.min(1.0)]
        })
        .collect();
    let terrain =
        Terrain::from_slice(60, 50, 0.8, RowOrder::NorthFirst, &heights).expect("a terrain");
    let terrain = terrain.with_tip(1.5).expect("a ball");
    let surface = Surface::new(rough().params().expect("known numbers")).expect("a surface");
    let mut contact = Contact::at_rate(terrain, surface, 2000).expect("a contact");
    let expected = contact.run(path.iter().copied()).expect("steps");

    let (mut terrain, mut contact) = (hapterra_terrain_new(), hapterra_contact_new());
    let mut steps = vec![MaybeUninit::<HapterraStep>::uninit(); path.len()];
    // SAFETY: all arrays are as long as stated.
    let status = unsafe {
        [
            hapterra_terrain_set_f64(Some(&mut terrain), heights.as_ptr(), 60, 50, 0.8, 0),
            hapterra_terrain_set_tip(Some(&mut terrain), 1.5),
            hapterra_contact_begin(Some(&mut contact), Some(&terrain), &rough(), 1, 2000),
            hapterra_contact_run(
                Some(&mut contact),
                path.as_ptr().cast(),
                path.len(),
                steps.as_mut_ptr().cast(),
                None,
            ),
        ]
    };
    assert_eq!(status.map(|status| status as u32), [0; 4]);
    // SAFETY: all steps have happened.
    let steps = steps.iter().map(|step| unsafe { step.assume_init() });
    for (step, expected) in steps.zip(expected) {
        let bits = |numbers: [f64; 3]| numbers.map(f64::to_bits);
        let expected = HapterraStep::from(expected);
        assert_eq!(bits(step.force_n), bits(expected.force_n));
        assert_eq!(bits(step.proxy_mm), bits(expected.proxy_mm));
        assert_eq!(step.state, expected.state);
    }
}
