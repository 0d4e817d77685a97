//! near SEED SCENE TICK: the patch search from the proxy, traced, and the truth.
use hapterra_core::terrain::Altitude;
use hapterra_tests::scene::run::{Player, Scene};
use hapterra_tests::scene::stage::{Buffers, SIDE};
#[allow(dead_code, unused)]
mod contact {
    pub use hapterra_core::contact::patch;
    #[path = "/tmp/wt/judge-dbg/closest.rs"]
    pub mod closest;
    #[path = "/tmp/wt/judge-dbg/ruling.rs"]
    pub mod ruling;
}
use hapterra_tests::invariants::descent;
use hapterra_tests::invariants::surface::Patch as P64;
fn main() {
    let a: Vec<u64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let s = Scene::random(a[0], a[1]);
    let t = a[2] as usize;
    let mut b = Buffers::default();
    let mut p = Player::<SIDE>::new(&s, &mut b, [0; 3], s.supply);
    for i in 0..t {
        p.feel(s.path[i]);
    }
    println!("before {:?}", p.contact);
    let f = p.feel(s.path[t]).unwrap();
    println!("{:?} hip {:?}", f, s.path[t]);
    let c = p.contact.patch().unwrap();
    let c = if a.len() > 4 {
        [a[3] as i32, a[4] as i32]
    } else {
        c
    };
    let hip = s.path[t];
    println!("cell {c:?} corners {:?}", s.terrain.patch(c));
    let k = s.terrain.patch(c).unwrap();
    let alt = Altitude::new(hip[2].floor() as i32, (hip[2] - hip[2].floor()) as f32);
    let patch = contact::patch::Patch::new(k.map(|h| h as f32)).seen_from(alt, 0);
    println!("{patch:?}");
    let hand = ((hip[0] - c[0] as f64) as f32, (hip[1] - c[1] as f64) as f32);
    let pr = hapterra_tests::field::position(&f.proxy);
    let st = ((pr[0] - c[0] as f64) as f32, (pr[1] - c[1] as f64) as f32);
    println!("hand {hand:?} start {st:?}");
    let st = if a.len() > 5 {
        (f32::from_bits(a[5] as u32), f32::from_bits(a[6] as u32))
    } else {
        st
    };
    println!("{:?}", contact::closest::nearest_downhill(&patch, hand, st));
    let d = descent::from(
        &s.terrain,
        hip,
        [pr[0], pr[1]],
        P64::at(&s.terrain, c).unwrap(),
    );
    println!(
        "truth {:?} u {:.9} v {:.9} patches {}",
        d,
        d.at[0] - c[0] as f64,
        d.at[1] - c[1] as f64,
        d.patches
    );
}
