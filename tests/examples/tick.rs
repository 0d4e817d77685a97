//! tick SEED SCENE TICK STEPS: each contact step at that tick.
use hapterra_core::contact::Pace;
use hapterra_tests::field::point;
use hapterra_tests::scene::run::{Player, Scene};
use hapterra_tests::scene::stage::{Buffers, SIDE};
fn main() {
    let a: Vec<u64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let s = Scene::random(a[0], a[1]);
    let (t, n) = (a[2] as usize, a[3] as usize);
    let mut b = Buffers::default();
    let mut p = Player::<SIDE>::new(&s, &mut b, [0; 3], s.supply);
    println!(
        "{:?} {:?} {:?} size {:?}",
        s.terrain.kind, s.pace, s.supply, s.terrain.size
    );
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
        p.stage.supply(1000000 + i as u32, &p.contact, &f, &h);
        println!("step {i}: {f:?}\n    {:?}", p.contact);
        if let Some(c) = p.contact.patch() {
            println!("    corners {:?}", s.terrain.patch(c));
        }
        if f.settled || s.pace == Pace::RealTime {
            break;
        }
    }
}
