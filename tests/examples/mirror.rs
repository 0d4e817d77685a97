//! mirror SEED SCENE TICK STEPS mx my t
use hapterra_tests::field::point;
use hapterra_tests::scene::run::{Player, Scene};
use hapterra_tests::scene::stage::{Buffers, SIDE};
use hapterra_tests::scene::symmetry::Symmetry;
fn main() {
    let a: Vec<u64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let s0 = Scene::random(a[0], a[1]);
    let sy = Symmetry {
        mirror_x: a[4] == 1,
        mirror_y: a[5] == 1,
        transpose: a[6] == 1,
    };
    let path = s0
        .path
        .iter()
        .map(|p| {
            let w = |i: usize| p[i].clamp(0.5, f64::from(s0.terrain.size[i]) - 0.5);
            sy.point(&s0.terrain, [w(0), w(1), p[2]])
        })
        .collect();
    let s = s0.with(sy.terrain(&s0.terrain), path);
    let (t, n) = (a[2] as usize, a[3] as usize);
    let mut b = Buffers::default();
    let mut p = Player::<SIDE>::new(&s, &mut b, [0; 3], s.supply);
    for i in 0..t {
        let f = p.feel(s.path[i]);
        if i + 3 >= t {
            println!("{i} hip {:?} {:?}", s.path[i], f);
        }
    }
    println!("--- {t} hip {:?}\n{:?}", s.path[t], p.contact);
    let h = point(s.path[t]);
    for i in 0..n {
        let f = *p.contact.step(&p.stage.window, h, s.rule, s.pace);
        println!("step {i}: {f:?}\n    {:?}", p.contact);
        if let Some(c) = p.contact.patch() {
            println!("    corners {:?}", s.terrain.patch(c));
        }
        if f.settled {
            break;
        }
    }
}
