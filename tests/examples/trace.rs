use hapterra_tests::scene::run::Scene;
use hapterra_tests::scene::stage::Buffers;
fn main() {
    let a: Vec<u64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let seed = a[0];
    for k in &a[1..] {
        let s = Scene::random(seed, *k);
        match s.run(&mut Buffers::default()) {
            Ok(_) => println!(
                "{seed} {k} {:?} {:?} {:?} {:?} holds",
                s.terrain.kind, s.pace, s.supply, s.rule
            ),
            Err(v) => {
                let t = v.to_string();
                println!(
                    "{seed} {k} {:?} {:?} {:?}: {}",
                    s.terrain.kind,
                    s.pace,
                    s.supply,
                    &t[..t.len().min(700)]
                );
            }
        }
    }
}
