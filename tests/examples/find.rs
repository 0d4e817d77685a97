use hapterra_core::contact::{Pace, Rule};
use hapterra_tests::chance::Chance;
use hapterra_tests::scene::run::Scene;
use hapterra_tests::scene::stage::{Buffers, Supply};
use hapterra_tests::scene::terrain::{Kind, Terrain};
fn main() {
    let mut c = Chance::new(7);
    let mut b = Buffers::default();
    let g = (1u32 << 20) as f64;
    let mut found = 0;
    for n in 0..400000 {
        let t = Terrain::from_fn(Kind::Rough, [24, 12], |x, y| match (x, y) {
            (9 | 11, 6) => 1e6,
            _ => 0.0,
        });
        let r = |x: f64| (x * g).round() / g;
        let w = 10f64.powf(-(c.below(7) as f64) / 2.0);
        let mut p = |x: f64, y: f64, z: f64| {
            [
                r(x + w * c.between(-1., 1.)),
                r(y + w * c.between(-1., 1.)),
                r(z + w * c.between(-1., 1.)),
            ]
        };
        let a = p(4.5298, 2.4367, 8.17);
        let path = vec![
            [a[0], a[1], 2e6],
            a,
            p(16.9955, 8.998, 8.42),
            p(16.9955, 8.998, 7.75),
            p(16.9955, 8.998, 7.75),
        ];
        let s = Scene::given(t, path.clone(), Rule::Swept, Pace::RealTime, Supply::Held);
        let e = s.feel(&mut b, [0; 3], Supply::Held, |_| Ok(())).map(|_| ());
        let mut j = hapterra_tests::invariants::judge::Judge::new(&s.terrain, Rule::Swept);
        let v = s.feel(&mut b, [0; 3], Supply::Held, |seen| j.look(seen));
        let _ = e;
        if let Err(v) = v {
            println!("{n} {path:?}\n  {}", &v.to_string()[..200]);
            found += 1;
            if found > 3 {
                return;
            }
        }
    }
}
