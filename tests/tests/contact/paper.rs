//! The statements of *Height Field Haptics*, one by one.

use hapterra::published::{Heights, Paper, Start};
use hapterra_core::contact::ContactState;
use hapterra_core::contact::closest_point::nearest_downhill;
use hapterra_core::contact::surface::patch::Patch;
use hapterra_core::force::SurfaceParams;
use hapterra_tests::whole_field::{FieldContact, position};

/// Result of a rule for a HIP: true in contact, and the proxy.
type Answer = (bool, [f64; 3]);

/// A field of a test's size, defined by a function.
struct Field(fn(i32, i32) -> f32);

impl Heights for Field {
    fn has(&self, cell: [i32; 2]) -> bool {
        cell.iter().all(|i| (0..64).contains(i))
    }

    fn corners(&self, [x, y]: [i32; 2]) -> [f32; 4] {
        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[east, north]| (self.0)(x + east, y + north))
    }
}

/// Returns the paper's rule and the product's over a field of 64 × 64 patches.
fn rules(height: fn(i32, i32) -> f32) -> [Box<dyn FnMut([f64; 3]) -> Answer>; 2] {
    let mut paper = Paper::<_, f64>::new(Field(height), Start::LastPoint, 20);
    let mut swept = FieldContact::new(64, height);
    [
        Box::new(move |hip| {
            let displacement = paper.step(hip);
            let offset = displacement.unwrap_or_default();
            (
                displacement.is_some(),
                [0, 1, 2].map(|i| hip[i] + offset[i]),
            )
        }),
        Box::new(move |hip| {
            let rendered = swept.step(hip);
            let touches = rendered.state == ContactState::Touching;
            (touches, position(&rendered.proxy))
        }),
    ]
}

fn rolling(x: i32, y: i32) -> f32 {
    ((f64::from(x) * 0.37).sin() + (f64::from(y) * 0.23).cos()) as f32
}

/// Corners P00, P10, P01, P11 of a twisted patch.
const CORNERS: [f32; 4] = [0.25, 0.75, 1.5, 0.5];

#[test]
fn eq_1_to_5_the_patch_is_uva_plus_ub_plus_vc_plus_d() {
    let [p00, p10, p01, p11] = CORNERS;
    let patch = Patch::new(CORNERS);
    assert_eq!(patch.a, p11 - p10 - p01 + p00);
    assert_eq!(patch.b, [p10 - p00, p11 - p01]);
    assert_eq!(patch.c, [p01 - p00, p11 - p10]);
    assert_eq!(patch.corners[0], p00);
    let (u, v) = (0.3, 0.8);
    let bilinear = u * v * patch.a + u * patch.b[0] + v * patch.c[0] + patch.corners[0];
    assert!((patch.height(u, v) - bilinear).abs() < 1e-6);
}

#[test]
fn eq_6_and_7_x_and_y_are_cell_plus_u_and_v_on_unit_grid() {
    for mut rule in rules(|_, _| 1.0) {
        rule([37.25, 12.75, 2.0]);
        assert_eq!(rule([37.25, 12.75, 0.9]), (true, [37.25, 12.75, 1.0]));
    }
}

#[test]
fn eq_8_to_11_partial_derivatives_vanish_at_closest_point() {
    let patch = Patch::new(CORNERS.map(|h| h - 0.4));
    let (p, q) = (0.55, 0.45);
    let found = nearest_downhill(&patch, (p, q), (0.5, 0.5));
    let (u, v) = (f64::from(found.u), f64::from(found.v));
    assert!(u > 0.0 && u < 1.0 && v > 0.0 && v < 1.0, "{found:?}");
    let [a, b, c, d] = [patch.a, patch.b[0], patch.c[0], patch.corners[0]].map(f64::from);
    let sigma = [
        u - f64::from(p),
        v - f64::from(q),
        a * u * v + b * u + c * v + d,
    ];
    let along_u = sigma[0] + sigma[2] * (b + a * v);
    let along_v = sigma[1] + sigma[2] * (c + a * u);
    assert!(
        along_u.abs() < 1e-6 && along_v.abs() < 1e-6,
        "{along_u} {along_v}"
    );
}

#[test]
fn section_4_3_2_bounded_closest_point_is_on_edge_or_vertex() {
    let patch = Patch::new(CORNERS.map(|h| h - 0.4));
    for hip in [
        (-0.5, 0.4),
        (1.7, 0.4),
        (0.4, -0.6),
        (0.6, 1.9),
        (-1.0, -1.0),
        (2.0, 2.0),
    ] {
        let found = nearest_downhill(&patch, hip, (0.5, 0.5));
        let distance = |u: f32, v: f32| {
            let z = f64::from(patch.height(u, v));
            f64::from(u - hip.0).powi(2) + f64::from(v - hip.1).powi(2) + z * z
        };
        let edges = (0..=1000).flat_map(|i| {
            let t = i as f32 / 1000.0;
            [(t, 0.0), (t, 1.0), (0.0, t), (1.0, t)]
        });
        let nearest = edges
            .map(|(u, v)| distance(u, v))
            .fold(f64::INFINITY, f64::min);
        let on_border = [found.u, found.v].iter().any(|x| *x == 0.0 || *x == 1.0);
        assert!(on_border, "{hip:?} {found:?}");
        assert!(
            distance(found.u, found.v) < nearest + 1e-6,
            "{hip:?} {found:?}"
        );
    }
}

#[test]
fn step_1_segment_above_all_patches_is_free_space() {
    for mut rule in rules(rolling) {
        for i in 0..100 {
            let hip = [5.0 + 0.5 * f64::from(i), 20.0, 2.25];
            assert_eq!(rule(hip), (false, hip));
        }
    }
}

#[test]
fn step_2_search_continues_over_edges_and_vertices() {
    for mut rule in rules(|x, _| 0.1 * x as f32) {
        rule([10.5, 10.5, 3.0]);
        rule([10.5, 10.5, 1.0]);
        // Diagonally across many patches in one tick.
        let (_, proxy) = rule([17.2, 14.8, 1.2]);
        // The foot of the perpendicular on the plane z = x/10.
        let foot = (17.2 + 0.1 * 1.2) / 1.01;
        assert!((proxy[0] - foot).abs() < 1e-5, "{proxy:?}");
        assert!((proxy[1] - 14.8).abs() < 1e-5, "{proxy:?}");
    }
}

#[test]
fn step_2_concave_places_rest_on_an_edge_or_a_vertex() {
    for mut valley in rules(|x, _| (x - 20).abs() as f32) {
        valley([20.3, 10.5, 2.0]);
        let (_, proxy) = valley([20.1, 10.5, -0.5]);
        assert_eq!(proxy[0], 20.0, "the edge");
    }
    for mut pit in rules(|x, y| (x - 20).abs().max((y - 20).abs()) as f32) {
        pit([20.2, 20.1, 2.0]);
        let (_, proxy) = pit([20.05, 19.95, -0.5]);
        assert_eq!(proxy[..2], [20.0, 20.0], "the vertex");
    }
}

#[test]
fn step_3_sign_of_displacement_along_normal_decides_contact() {
    let [mut paper, _] = rules(rolling);
    let mut both = [0, 0];
    for i in 0..600 {
        let t = f64::from(i) * 0.01;
        let (x, y) = (20.0 + 3.0 * t.sin(), 30.0 + t);
        let z = surface(x, y) + 0.2 * (7.0 * t).cos();
        let (touching, _) = paper([x, y, z]);
        both[usize::from(touching)] += 1;
        assert_eq!(touching, z < surface(x, y), "tick {i}");
    }
    assert!(both[0] > 100 && both[1] > 100, "{both:?}");
}

/// Returns the bilinear surface of `rolling`, in f64.
fn surface(x: f64, y: f64) -> f64 {
    let (i, j) = (x.floor() as i32, y.floor() as i32);
    let (u, v) = (x - x.floor(), y - y.floor());
    let h = |di, dj| f64::from(rolling(i + di, j + dj));
    (h(0, 0) * (1.0 - u) + h(1, 0) * u) * (1.0 - v) + (h(0, 1) * (1.0 - u) + h(1, 1) * u) * v
}

#[test]
fn step_4_force_is_proportional_to_displacement() {
    let params = SurfaceParams::PREMIUM;
    let mut contact = FieldContact::new(64, rolling);
    contact.step([30.5, 30.5, 3.0]);
    for depth in [0.01, 0.1, 0.5] {
        let hip = [30.5, 30.5, surface(30.5, 30.5) - depth];
        let rendered = contact.step(hip);
        let proxy = position(&rendered.proxy);
        let force = params.spring().force_n(rendered.displacement);
        for axis in 0..3 {
            let expected = 0.5 * (proxy[axis] - hip[axis]);
            assert!((f64::from(force[axis]) - expected).abs() < 1e-6);
        }
    }
}

/// Two thin walls, the paper's two thin peaks in cross-section.
fn walls(x: i32, _: i32) -> f32 {
    if x == 20 || x == 26 { 40.0 } else { 0.0 }
}

#[test]
fn figure_8_fast_sweep_does_not_cross_thin_walls() {
    let mut contact = FieldContact::new(64, walls);
    contact.step([10.0, 30.3, 3.0]);
    let rendered = contact.step([50.0, 30.7, 3.0]);
    assert_eq!(rendered.state, ContactState::Touching);
    let proxy = position(&rendered.proxy);
    assert!(
        proxy[0] > 19.0 && proxy[0] < 20.0,
        "stopped by the first wall: {proxy:?}"
    );
    // It stays there until the HIP returns.
    let rendered = contact.step([40.0, 31.0, 3.0]);
    assert!(position(&rendered.proxy)[0] < 20.0);
    let rendered = contact.step([15.0, 31.0, 3.0]);
    assert_eq!(rendered.state, ContactState::Free);
}
