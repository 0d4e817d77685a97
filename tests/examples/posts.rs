use hapterra_tests::scene::run::Scene;
fn main() {
    let a: Vec<i64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let s = Scene::random(a[0] as u64, a[1] as u64);
    for y in a[3]..=a[5] {
        for x in a[2]..=a[4] {
            print!("({x},{y}) {:?}  ", s.terrain.post(x as i32, y as i32));
        }
        println!();
    }
    for t in a[6]..=a[7] {
        println!("{:?}", s.path[t as usize]);
    }
}
