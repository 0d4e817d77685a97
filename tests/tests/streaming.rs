//! A terrain far larger than the device: the device stores its window, the host the raster, once.

use hapterra::replay::on_native;
use hapterra::terrain::{Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use heightfield::Raster;

const SIDE: u32 = 4096;

/// Returns the peak resident memory of this program, MiB; `None` if the system does not report it.
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024.0)
}

#[test]
fn field_of_4096_by_4096_streams_through_a_window() {
    let raster = Raster::from_fn(SIDE, SIDE, |x, y| {
        8.0 * (x as f32 * 0.021).sin() + 6.0 * (y as f32 * 0.033).cos()
    })
    .expect("raster");
    let before = peak_mib();
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let mut replayer = on_native(&terrain, SurfaceParams::PREMIUM).expect("opened");
    let window = u64::from(replayer.device().window).pow(2);
    let mut touched = 0u32;
    let steps = 40_000;
    for i in 0..steps {
        let t = f64::from(i) / f64::from(steps);
        // From corner to corner, with two crossings on the way.
        let x = 20.0 + 4050.0 * t;
        let y = 2048.0 + 2000.0 * (t * 9.0).sin();
        let ground = terrain.height_mm(x, y).expect("known");
        let above = if i == 0 { 30.0 } else { -0.5 };
        let hip = terrain.scale().to_grid([x, y, ground + above]);
        let sample = replayer.step(hip.expect("addressable")).expect("rendered");
        touched += u32::from(sample.state == ContactState::Touching);
        assert!(sample.force_n.is_finite());
    }
    assert_eq!(touched, steps as u32 - 1, "lost contact on the way");
    let stats = replayer.stats();
    let all = u64::from(SIDE / 32).pow(2);
    eprintln!(
        "{} tiles sent of {all}, {} again; window {window}",
        stats.tiles, stats.repeated
    );
    // It passed over far more tiles than it can store, and requested far fewer than all.
    assert!(stats.tiles > 2 * window && stats.tiles < all / 4);
    assert!(stats.repeated < stats.tiles / 4);
    if let (Some(before), Some(after)) = (before, peak_mib()) {
        let field = f64::from(SIDE) * f64::from(SIDE) * 4.0 / 1024.0 / 1024.0;
        eprintln!("{before:.0} MiB with the raster of {field} MiB, {after:.0} MiB at most");
        assert!(after - before < 0.25 * field, "the raster was copied");
    } else {
        eprintln!("skipped: no /proc to read the peak of memory from");
    }
}

#[test]
fn coarser_levels_render_the_same_plane_with_fewer_tiles() {
    let raster = Raster::from_fn(1025, 1025, |x, y| (x + 2 * y) as f32 / 16.0).expect("raster");
    let tiles = [0u8, 3].map(|level| {
        let scale = Scale::new(0.25, 0.25).expect("scale");
        let terrain = Terrain::new(&raster, scale, level).expect("terrain");
        let mut replayer = on_native(&terrain, SurfaceParams::PREMIUM).expect("opened");
        for i in 0..2000 {
            let [x, y] = [10.0 + 0.1 * f64::from(i), 128.0];
            let ground = terrain.height_mm(x, y).expect("known");
            let above = if i == 0 { 30.0 } else { -1.0 };
            let hip = terrain.scale().to_grid([x, y, ground + above]);
            let sample = replayer.step(hip.expect("addressable")).expect("rendered");
            if i > 0 {
                // A plane is the same at every level, and so is its force.
                let normal = 1.0 / (1.0 + (1.0 / 16.0f64).powi(2) + 0.125f64.powi(2)).sqrt();
                let expected = 0.5 * normal;
                let force = f64::from(sample.force_n.length());
                assert!((force - expected).abs() < 1e-4, "level {level}: {force}");
            }
        }
        replayer.stats().tiles
    });
    assert!(tiles[1] * 4 < tiles[0], "{tiles:?}");
}
