//! Texture in a replay, checked by the stress test's oracle, and from the command line.

use std::path::Path;
use std::process::Command;

use hapterra::replay::on_native;
use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{HapticCells, HapticGrid, Terrain};
use hapterra_core::contact::{ContactOutput, ContactState};
use hapterra_core::force::{Pattern, Shading, SurfaceParams, Texture};
use hapterra_core::scene::TickRecord;
use hapterra_tests::invariants::observed_tick::ObservedTick;
use hapterra_tests::invariants::texture::TextureOracle;
use hapterra_tests::whole_field::position;
use hapterra_tests::{hapterra_binary, terrain_file};
use heightfield::{OpenOptions, Raster};

/// HIPs of a path, and their distance, mm.
const STEPS: u32 = 4_000;
const STEP: f64 = 0.02;

const GRAIN: Texture = Texture {
    pattern: Pattern::Grain,
    amplitude_mm: 0.1,
    wavelength_mm: 1.0,
    direction_deg: 0.0,
    seed: 3,
};
const GRATING: Texture = Texture {
    pattern: Pattern::Grating,
    direction_deg: -30.0,
    ..GRAIN
};

/// Returns synthetic ground, and the files of real ground on this machine.
fn rasters() -> Vec<(&'static str, Raster)> {
    let made = Synth::new(Kind::Fractal, 3, 25.0).raster(300, 200);
    let mut all = vec![("fractal", made.expect("raster"))];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/dem/real");
    for name in ["mt_rainier_90m.tif", "LisbonElevation.tif"] {
        let path = folder.join(name);
        match path.exists() {
            true => all.push((
                name,
                Raster::open(&path, &OpenOptions::default()).expect("opens"),
            )),
            false => println!("skipped: no {name} in ../shared/dem/real"),
        }
    }
    all
}

/// Returns the samples of a HIP on a circle, half a millimetre deep, that starts in the air. In the
/// middle it lifts twice and is fast for some time. A cell is a millimetre, so that the force is
/// exactly half of the displacement.
fn circle(terrain: &Terrain<'_>, params: SurfaceParams) -> Vec<TickRecord> {
    let mut replayer = on_native(terrain, params).expect("opened");
    let size = terrain.size_mm();
    let radius = STEP * f64::from(STEPS) / std::f64::consts::TAU;
    let radius = radius.min(0.4 * size[0].min(size[1]));
    let mut way = 0.0;
    let rendered = (0..=STEPS).filter_map(|tick| {
        let is_fast = (1_600..1_650).contains(&tick);
        way += if is_fast { 0.3 } else { STEP };
        let angle = way / radius;
        let at = [
            size[0] / 2.0 + radius * angle.cos(),
            size[1] / 2.0 + radius * angle.sin(),
        ];
        let ground = terrain.height_mm(at[0], at[1])?;
        let lifts = tick % 1_200 < 20;
        let above = if lifts { 1.0 } else { -0.5 };
        let hip = terrain.scale().to_grid([at[0], at[1], ground + above]);
        Some(replayer.step(hip.expect("addressable")).expect("rendered"))
    });
    rendered.collect()
}

/// Returns the textured tick for the oracle: the displacement is that of the same scene without
/// texture.
fn observed(plain: &TickRecord, textured: &TickRecord) -> ObservedTick {
    let rendered = ContactOutput {
        state: textured.state,
        proxy: textured.proxy,
        displacement: plain.force_n * 2.0,
        converged: true,
        ..ContactOutput::default()
    };
    ObservedTick {
        textured: Some(textured.force_n * 2.0),
        ..ObservedTick::new(position(&textured.hip), rendered, [0; 3])
    }
}

#[test]
fn texture_changes_the_force_but_not_the_proxy() {
    for (name, raster) in &rasters() {
        let grid = HapticGrid::new(raster, HapticCells::Square);
        let scale = grid.true_scale(1.0).expect("scale");
        let terrain = Terrain::over(grid, scale, 0).expect("terrain");
        let params = SurfaceParams {
            shading: Shading::Smooth,
            ..SurfaceParams::PREMIUM
        };
        let plain = circle(&terrain, params);
        for texture in [GRAIN, GRATING] {
            let textured = circle(&terrain, SurfaceParams { texture, ..params });
            assert_eq!(plain.len(), textured.len());
            let mut judge = TextureOracle::new(texture);
            let (mut touched, mut most) = (0, 0.0_f32);
            for (tick, (plain, textured)) in plain.iter().zip(&textured).enumerate() {
                assert_eq!(plain.proxy, textured.proxy);
                let judged = judge.check(&observed(plain, textured));
                assert_eq!(judged, Ok(()), "{name}, {texture:?}, tick {tick}");
                touched += u32::from(textured.state == ContactState::Touching);
                most = most.max((textured.force_n - plain.force_n).length());
            }
            println!(
                "{name}, {:?}: {touched} ticks, up to {most} N",
                texture.pattern
            );
            assert!(touched > STEPS / 2, "{name}: {touched}");
            assert!((0.03..0.09).contains(&most), "{name}: {most} N");
        }
    }
}

/// A demonstration with a texture is recorded with it, replayed with it, and replayed again to the
/// same bytes.
#[test]
fn replay_uses_the_texture_of_the_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let hapterra = |args: &[&str]| {
        let run = Command::new(hapterra_binary())
            .args(args)
            .current_dir(folder.path())
            .output()
            .expect("started");
        let printed = String::from_utf8_lossy(&run.stderr).into_owned();
        (run.status.success(), printed)
    };
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("there");
    terrain_file(&folder.path().join("hills.tif"), Kind::Fractal, 129, 4);
    let demo = [
        "demo",
        "hills.tif",
        "--duration",
        "4s",
        "--surface",
        concat!(env!("CARGO_MANIFEST_DIR"), "/data/surfaces/grating.toml"),
    ];
    let (rendered, printed) = hapterra(&demo);
    assert!(rendered, "{printed}");
    let recording = read("demo/hills.csv");
    assert!(
        recording.contains("# [force.texture]\n# pattern = \"grating\"\n"),
        "{printed}"
    );
    for (more, output) in [
        (&[][..], "a.csv"),
        (&[], "b.csv"),
        (&["--surface", "ice"], "c.csv"),
    ] {
        let replay = ["replay", "hills.tif", "demo/hills.csv", "--out", output];
        let (replayed, printed) = hapterra(&[&replay[..], more].concat());
        assert!(replayed, "{printed}");
    }
    let [a, b, c] = ["a.csv", "b.csv", "c.csv"].map(read);
    assert_eq!(a, b);
    assert!(a.contains("# wavelength_mm = 2.5\n"));
    assert!(!c.contains("force.texture"));
    let rows = |text: &str| -> Vec<String> {
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        rows.map(str::to_owned).collect()
    };
    assert!(rows(&a).len() > 3_000 && rows(&a) != rows(&c));
    let high = "[default]\ntexture = \"grain\"\ntexture_amplitude = 0.5\n";
    std::fs::write(folder.path().join("high.toml"), high).expect("written");
    let (replayed, printed) = hapterra(
        &[
            &["replay", "hills.tif", "demo/hills.csv", "--out", "d.csv"][..],
            &["--surface", "high.toml"],
        ]
        .concat(),
    );
    assert!(
        !replayed && printed.contains("hint: texture_amplitude"),
        "{printed}"
    );
}
