use hapterra_tests::scene::run::Scene;
fn main() {
    let a: Vec<u64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let s = Scene::random(a[0], a[1]);
    for t in a[2]..=a[3] {
        let p = s.path[t as usize];
        println!(
            "{t} {p:?} gap {:?} corners {:?}",
            p[2] - s.terrain.height_about(p[0], p[1]),
            s.terrain.patch([p[0].floor() as i32, p[1].floor() as i32])
        );
    }
}
