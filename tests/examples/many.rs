use hapterra_tests::soak::{Until, soak};
fn main() {
    let a: Vec<u64> = std::env::args()
        .skip(1)
        .map(|x| x.parse().unwrap())
        .collect();
    let t = soak(a[0], a[1], Until::Scenes(a[2]), 2, |_| ());
    println!("{t}");
    for b in &t.broken {
        println!(
            "{} {} {:?} {}",
            a[0],
            b.number,
            b.kind,
            &b.what[..b.what.len().min(160)]
        );
    }
}
