//! A tip of finite radius, compared with a ball on the bilinear surface in `f64` without code of
//! the tiles: the ground nearest to the ball's centre is one radius away.

use std::process::Command;

use hapterra::replay::{OfflineDevice, on_native};
use hapterra::synth::Kind;
use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain};
use hapterra_core::Vec3;
use hapterra_core::contact::{ContactState, Friction};
use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::TickRecord;
use hapterra_tests::random_paths::wander;
use hapterra_tests::{UNCONTROLLED, hapterra_binary, shared, terrain_file};
use heightfield::{OpenOptions, Raster};

/// Returns the distance of a point from the bilinear surface of samples, all in cells: over dense
/// lines of each near patch, with the nearest point on each line.
fn distance(height: &dyn Fn(i64, i64) -> f64, [x, y, z]: [f64; 3], within: f64) -> f64 {
    const LINES: u32 = 32;
    let cells = |at: f64| (at - within).floor() as i64..=(at + within).floor() as i64;
    let mut least = f64::INFINITY;
    for row in cells(y) {
        for column in cells(x) {
            let at = |dx: i64, dy: i64| height(column + dx, row + dy);
            let [sw, se, nw, ne] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
            if [sw, se, nw, ne].iter().any(|h| h.is_nan()) {
                continue;
            }
            for line in 0..=LINES {
                let t = f64::from(line) / f64::from(LINES);
                let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
                let (column, row) = (column as f64, row as f64);
                let east = [
                    [column, row + t, mix(sw, nw)],
                    [column + 1.0, row + t, mix(se, ne)],
                ];
                let north = [
                    [column + t, row, mix(sw, se)],
                    [column + t, row + 1.0, mix(nw, ne)],
                ];
                for [from, to] in [east, north] {
                    least = least.min(to_stretch([x, y, z], from, to));
                }
            }
        }
    }
    least
}

/// Returns the distance of a point from a line segment.
fn to_stretch(place: [f64; 3], from: [f64; 3], to: [f64; 3]) -> f64 {
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (along, off) = (minus(to, from), minus(place, from));
    let share = (dot(off, along) / dot(along, along)).clamp(0.0, 1.0);
    let gap = minus(off, along.map(|x| x * share));
    dot(gap, gap).sqrt()
}

/// Returns the heights of a terrain's ground in cells, not those of a ball's centre.
fn ground<'t>(terrain: &'t Terrain<'_>) -> impl Fn(i64, i64) -> f64 + 't {
    let scale = terrain.scale_of_level_0().at_level(terrain.level());
    move |x, y| match (u32::try_from(x), u32::try_from(y)) {
        (Ok(x), Ok(y)) => {
            let height = terrain.grid().height_of_level(terrain.level(), x, y);
            height * scale.height_mm_per_unit() / scale.cell_mm()
        }
        _ => f64::NAN,
    }
}

fn step(replayer: &mut OfflineDevice<'_>, hip_mm: [f64; 3]) -> TickRecord {
    let hip = replayer.terrain().scale().to_grid(hip_mm);
    replayer.step(hip.expect("addressable")).expect("rendered")
}

/// Returns the terrain for a ball with this radius in cells, and for a point.
fn terrains(raster: &Raster, scale: Scale, radius: f64) -> [Terrain<'_>; 2] {
    let grid = HapticGrid::new(raster, HapticCells::default());
    let ball = grid.with_tip(radius * scale.cell_mm());
    [ball, grid].map(|grid| Terrain::over(grid, scale, 0).expect("terrain"))
}

/// Raises a path to the same height over a ball's terrain as it has over the ground.
fn raised(path: Vec<[f64; 3]>, [ball, ground]: &[Terrain<'_>; 2]) -> Vec<[f64; 3]> {
    let raise = |[x, y, z]: [f64; 3]| {
        let heights = [ball, ground].map(|terrain| terrain.height_mm(x, y));
        let [Some(centre), Some(ground)] = heights else {
            return [x, y, z];
        };
        [x, y, z + centre - ground]
    };
    path.into_iter().map(raise).collect()
}

/// Returns the sorted errors of the proxies' distance from the ground, as fractions of the radius.
fn walked(raster: &Raster, scale: Scale, radius: f64, rows: usize) -> Vec<f64> {
    let terrains = terrains(raster, scale, radius);
    let [terrain, point] = &terrains;
    let height = ground(terrain);
    let mut off = Vec::new();
    for seed in 0..3 {
        let mut replayer = on_native(terrain, SurfaceParams::PREMIUM).expect("opened");
        for hip_mm in raised(wander(point, seed, rows, 0.5), &terrains) {
            let sample = step(&mut replayer, hip_mm);
            if sample.state == ContactState::Touching {
                let proxy = terrain.scale().to_mm(&sample.proxy);
                let proxy = proxy.map(|mm| mm / scale.cell_mm());
                let found = distance(&height, proxy, radius + 1.0);
                off.push(((found - radius) / radius).abs());
            }
        }
    }
    off.sort_by(f64::total_cmp);
    off
}

/// Largest error of a proxy, as a fraction of the radius.
const MAX_ERROR: f64 = 0.02;

/// Walks over a raster, and checks that the centre is a radius away from the ground.
fn check_distance(name: &str, raster: &Raster, radius: f64) {
    let scale = HapticGrid::new(raster, HapticCells::default()).true_scale(1.0);
    let off = walked(raster, scale.expect("scale"), radius, 1_000);
    let share = |part: f64| off[(part * (off.len() - 1) as f64) as usize];
    let found = format!(
        "half within {:.4}, 99 % {:.4}, all {:.4} of the radius",
        share(0.5),
        share(0.99),
        share(1.0)
    );
    eprintln!("{name}, {radius} cells, {} ticks: {found}", off.len());
    assert!(off.len() > 1500, "{name}: the walk hardly touches");
    assert!(share(1.0) < MAX_ERROR, "{name}, {radius} cells: {found}");
}

/// Radii in cells of a millimetre.
const RADII: [f64; 4] = [0.5, 2.0, 4.0, 8.0];

#[test]
fn ball_touches_real_ground_a_radius_away() {
    for file in [
        "dem/real/bigtujunga.tif",
        "dem/real/mt_everest_90m.tif",
        // A city with walls.
        "dem/real/dom1_32_356_5699_1_nw_2020.tif",
    ] {
        let Some(path) = shared(file) else { return };
        let raster = Raster::open(path, &OpenOptions::default()).expect("opens");
        for radius in RADII {
            check_distance(file, &raster, radius);
        }
    }
}

/// Predicate of column and row: true for a sample that differs from its surroundings.
type Shape<'s> = &'s dyn Fn(u32, u32) -> bool;

#[test]
fn ball_touches_poles_walls_and_pits_a_radius_away() {
    let every = |x: u32, n: u32| x % n == n / 2;
    let shapes: [(&str, Shape<'_>, f32); 5] = [
        ("poles", &|x, y| every(x, 5) && every(y, 5), 10.0),
        ("pits", &|x, y| every(x, 5) && every(y, 5), -10.0),
        ("walls", &|x, _| x % 12 < 6, 20.0),
        ("diagonal walls", &|x, y| (x + y) % 12 < 6, 20.0),
        ("trenches", &|_, y| every(y, 7), -6.0),
    ];
    for (name, is_there, height) in shapes {
        let raster = Raster::from_fn(60, 60, |x, y| if is_there(x, y) { height } else { 0.0 });
        let raster = raster.expect("raster");
        for radius in RADII {
            check_distance(name, &raster, radius);
        }
    }
}

/// Returns in how many of 20 passes a pole is rendered: one sample, 20 cells high, passed at half
/// its height and at most a fraction of the radius beside it. Speed is in cells a tick, cells are a
/// millimetre.
fn passes_touching(radius: f64, speed: f64, (most_beside, friction): (f64, f32)) -> usize {
    let pole = |x: u32, y: u32| if (x, y) == (60, 30) { 20.0 } else { 0.0 };
    let raster = Raster::from_fn(120, 60, pole).expect("raster");
    let [terrain, _] = terrains(&raster, Scale::new(1.0, 1.0).expect("scale"), radius);
    let params = SurfaceParams {
        friction: Friction::coulomb(friction),
        ..SurfaceParams::PREMIUM
    };
    let mut replayer = on_native(&terrain, params).expect("opened");
    let is_rendered = |pass: &u32| {
        let share = (f64::from(*pass) + 0.5) / 20.0;
        let beside = radius.max(0.5) * most_beside * (2.0 * share - 1.0);
        let mut x = 15.0 + share * speed;
        step(&mut replayer, [x, 30.0 + beside, 40.0]);
        let mut rendered = 0.0f32;
        while x < 105.0 {
            let sample = step(&mut replayer, [x, 30.0 + beside, 10.0]);
            rendered = rendered.max(sample.force_n.length());
            x += speed;
        }
        rendered > 0.0
    };
    (0..20).filter(is_rendered).count()
}

/// A step that is no longer than a ball's pole is wide ends within it. For a ball of 2 mm this is 3
/// m/s, at which the guard stops an arm.
#[test]
fn pole_is_rendered_at_steps_of_one_and_a_half_radii() {
    for radius in [1.0, 2.0, 4.0, 8.0] {
        for step in [0.1, 0.5 * radius, radius, 1.5 * radius] {
            assert_eq!(
                passes_touching(radius, step, (0.5, 0.0)),
                20,
                "radius {radius}, {step} cells a tick"
            );
        }
    }
    // A point's steps end beyond it.
    assert!(passes_touching(0.0, 12.0, (0.5, 0.0)) < 10);
}

/// A longer step also meets the pole. Without friction its proxy slides around the pole to a HIP
/// beyond it; with friction it stays where the cone holds it.
#[test]
fn friction_stops_a_ball_at_a_pole_at_any_speed() {
    for radius in [1.0, 2.0, 4.0, 8.0] {
        for speed in [5.0, 12.0, 30.0] {
            // A step longer than the window restarts the contact; 32 haptic cells are a radius.
            if speed / radius * 32.0 > 512.0 {
                continue;
            }
            let [ice, rough] = [0.0, 0.4].map(|mu| passes_touching(radius, speed, (0.3, mu)));
            let found =
                format!("radius {radius}, {speed} cells a tick: {ice} on ice, {rough} of 20");
            eprintln!("{found}");
            assert_eq!(rough, 20, "{found}");
            // Without friction, each pass in which a HIP is inside the pole: its chord at 0.3 radii
            // is 1.9 radii. More than these if a HIP close behind it still holds the proxy.
            let inside = (20.0 * 1.9 * radius / speed).min(20.0) as usize;
            assert!(ice >= inside, "{found}: at least {inside}");
            assert!(speed > 1.5 * radius || ice == 20, "{found}");
        }
    }
}

/// Returns the number of steps of the force above 0.05 N along a path.
fn steps_of_force(terrain: &Terrain<'_>, path: &[[f64; 3]]) -> usize {
    let mut replayer = on_native(terrain, SurfaceParams::PREMIUM).expect("opened");
    let forces = path.iter().map(|hip| step(&mut replayer, *hip).force_n);
    let forces: Vec<_> = forces.collect();
    let is_step = |pair: &&[Vec3]| (pair[1] - pair[0]).length() > 0.05;
    forces.windows(2).filter(is_step).count()
}

/// Returns a hand's path along a row of a terrain at 30 mm/s, below the mean of the surface within
/// 1 mm around.
fn path_over(terrain: &Terrain<'_>, north_mm: f64, deep_mm: f64) -> Vec<[f64; 3]> {
    const AROUND: usize = 33;
    let east = |tick: usize| 5.0 + 0.03 * tick as f64;
    let heights = (0..5_000).map(|tick| terrain.height_mm(east(tick), north_mm).expect("a city"));
    let heights: Vec<_> = heights.collect();
    let means = heights.windows(2 * AROUND + 1).enumerate();
    let below = means.map(|(tick, around)| {
        let mean = around.iter().sum::<f64>() / around.len() as f64;
        [east(tick + AROUND), north_mm, mean - deep_mm]
    });
    let mut path: Vec<_> = below.collect();
    // It starts in the air, where a contact begins, and descends within 200 ticks.
    for (tick, hip) in path.iter_mut().take(200).enumerate() {
        hip[2] += 0.2 * (200 - tick) as f64;
    }
    path
}

/// The same paths with the ball of a hand and with a point, each as deep in its own terrain.
#[test]
fn steps_of_force_on_lidar_fall_five_times_under_a_ball() {
    let Some(path) = shared("dem/real/dom1_32_356_5699_1_nw_2020.tif") else {
        return;
    };
    let raster = Raster::open(path, &OpenOptions::default()).expect("opens");
    let grid = HapticGrid::new(&raster, HapticCells::default());
    // The size at which it fits a Premium's workspace.
    let scale = grid.true_scale(0.23).expect("scale");
    let ball = Terrain::over(grid.with_tip(7.0), scale, 2).expect("terrain");
    let point = Terrain::over(grid, scale, 0).expect("terrain");
    for deep_mm in [0.1, 0.3, 0.5] {
        let count = |terrain: &Terrain<'_>| {
            let ways = (1..=6).map(|row| path_over(terrain, f64::from(row) * 27.3, deep_mm));
            ways.map(|path| steps_of_force(terrain, &path)).sum()
        };
        let [of_point, of_ball]: [usize; 2] = [&point, &ball].map(count);
        eprintln!("{deep_mm} mm deep: {of_point} steps of a point, {of_ball} of the ball");
        assert!(
            of_point > 100 && of_ball * 5 <= of_point,
            "{deep_mm} mm deep: {of_ball} of {of_point} steps"
        );
    }
}

#[test]
fn samples_without_data_have_none_under_a_ball() {
    let hole = |x: u32, y: u32| (20..30).contains(&x) && (10..50).contains(&y);
    let raster = Raster::from_fn(60, 60, |x, y| if hole(x, y) { f32::NAN } else { 3.0 });
    let raster = raster.expect("raster");
    let grid = HapticGrid::new(&raster, HapticCells::default()).with_tip(4.0);
    let terrain = Terrain::over(grid, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let point = Terrain::over(grid.with_tip(0.0), Scale::new(1.0, 1.0).expect("scale"), 0);
    let point = point.expect("terrain");
    for y in 0..118 {
        for x in 0..118 {
            let place = [f64::from(x) / 2.0, f64::from(y) / 2.0];
            let [ball, ground] = [&terrain, &point].map(|it| it.height_mm(place[0], place[1]));
            assert_eq!(ball, ground.map(|ground| ground + 4.0), "{place:?}");
        }
    }
}

/// Returns the standard error of a command that succeeds.
fn runs(folder: &std::path::Path, arguments: &[&str]) -> String {
    let mut command = Command::new(hapterra_binary());
    let run = command
        .current_dir(folder)
        .args(arguments)
        .env_remove("HAPTERRA_MPS2_ELF");
    let run = run.output().expect("started");
    let [out, printed] = [&run.stdout, &run.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(run.status.success(), "{arguments:?}: {out}{printed}");
    format!("{out}{printed}")
}

/// Returns the rows without the columns that the guard affects.
fn rendered(text: &str) -> Vec<String> {
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    let part = |row: &str| row.split(',').take(8).collect::<Vec<_>>().join(",");
    rows.map(part).collect()
}

#[test]
fn recordings_of_a_ball_are_replayed_with_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("there");
    terrain_file(&folder.join("hills.tif"), Kind::Crater, 512, 1);
    let native = [
        "--device",
        "native",
        "--duration",
        "5s",
        "--surface",
        UNCONTROLLED,
        "--tip",
        "6mm",
    ];
    let printed = runs(
        folder,
        &[&["run", "hills.tif", "--out", "run.csv"][..], &native].concat(),
    );
    assert!(
        printed.contains("rendered with a ball of 6 mm"),
        "{printed}"
    );
    runs(
        folder,
        &[&["demo", "hills.tif", "--out", "demo"][..], &native].concat(),
    );
    for recording in ["run.csv", "demo/hills.csv"] {
        let text = read(recording);
        assert!(text.contains("# tip_mm = 6.0\n"), "{recording}");
        runs(
            folder,
            &["replay", "hills.tif", recording, "-o", "again.csv"],
        );
        let again = read("again.csv");
        assert!(again.contains("# tip_mm = 6.0\n"));
        let (live, again) = (rendered(&text), rendered(&again));
        assert!(
            live.iter().filter(|row| row.contains(",1,")).count() > 500,
            "{recording}"
        );
        assert!(live == again, "{recording} has other forces");
        let printed = runs(
            folder,
            &[
                "replay",
                "hills.tif",
                recording,
                "-o",
                "point.csv",
                "--tip",
                "0",
            ],
        );
        assert!(
            printed.contains("--tip 0mm, where the recording has 6mm"),
            "{printed}"
        );
        assert!(!read("point.csv").contains("tip_mm") && rendered(&read("point.csv")) != live);
    }
}

#[test]
fn tip_of_too_many_cells_selects_a_coarser_level() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    terrain_file(&folder.join("hills.tif"), Kind::Fractal, 256, 1);
    std::fs::write(folder.join("in.csv"), "t_s,x_mm,y_mm,z_mm\n0,60,60,500\n").expect("written");
    runs(
        folder,
        &[
            "replay",
            "hills.tif",
            "in.csv",
            "-o",
            "out.csv",
            "--tip",
            "20",
        ],
    );
    let text = std::fs::read_to_string(folder.join("out.csv")).expect("there");
    assert!(text.contains("# level = 2\n"), "{text}");
    for (arguments, expected) in [
        (
            ["--tip=20", "--level=0"],
            "a tip of 20 mm: 20.0 cells of level 0, where 0 to 8 can be rendered",
        ),
        (
            ["--tip=-1", "--level=0"],
            "a length at the device from 0 to 100 mm",
        ),
        (["--tip=two", "--level=0"], "a number in mm"),
    ] {
        let mut command = Command::new(hapterra_binary());
        let command =
            command
                .current_dir(folder)
                .args(["replay", "hills.tif", "in.csv", "-o", "o.csv"]);
        let run = command.args(arguments).output().expect("started");
        let printed = String::from_utf8_lossy(&run.stderr);
        assert!(
            !run.status.success() && printed.contains(expected),
            "{printed}"
        );
    }
}

/// `run` and `demo` are for a hand; a replay is for comparisons.
#[test]
fn run_and_demo_default_to_a_ball_but_replay_to_a_point() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    terrain_file(&folder.join("hills.tif"), Kind::Crater, 256, 1);
    std::fs::write(folder.join("in.csv"), "t_s,x_mm,y_mm,z_mm\n0,60,60,500\n").expect("written");
    let run = ["run", "hills.tif", "--device", "native", "--duration", "1s"];
    let demo = [
        "demo",
        "hills.tif",
        "--device",
        "native",
        "--duration",
        "1s",
    ];
    let replay = ["replay", "hills.tif", "in.csv", "-o", "out.csv"];
    let line = "rendered with a ball of 7 mm over level";
    for (arguments, more, is_ball) in [
        (&run[..], &[][..], true),
        (&run[..], &["--tip", "0"][..], false),
        // A stated level is as fine as for a point.
        (&run[..], &["--level", "0"][..], false),
        (&demo[..], &[][..], true),
        (&replay[..], &[][..], false),
    ] {
        let printed = runs(folder, &[arguments, more].concat());
        assert_eq!(
            printed.contains(line),
            is_ball,
            "{arguments:?} {more:?}: {printed}"
        );
    }
}

/// Contact of a hand in a demo's recording.
struct Touched {
    /// Distances from HIP to proxy in contact, sorted, mm.
    penetration_mm: Vec<f64>,
    /// Longest time that the proxy stayed within 0.25 mm while the HIP moved on by 3 mm or more, s.
    held_s: f64,
}

impl Touched {
    fn in_demo(folder: &std::path::Path, file: &std::path::Path, friction: &str) -> Self {
        let file_text = file.to_string_lossy();
        let arguments = ["demo", &file_text, "--device", "native", "--out", friction];
        runs(
            folder,
            &[&arguments[..], &["--friction", friction]].concat(),
        );
        let name = file.file_stem().expect("a name").to_string_lossy();
        let recording = folder.join(friction).join(format!("{name}.csv"));
        let text = std::fs::read_to_string(recording).expect("there");
        let rows = text.lines().filter_map(|row| {
            let row: Vec<f64> = row.split(',').map_while(|x| x.parse().ok()).collect();
            row.get(..8).and_then(|row| row.try_into().ok())
        });
        Self::of(&rows.collect::<Vec<[f64; 8]>>())
    }

    /// Rows have a time, the HIP, the contact flag, and the proxy.
    fn of(rows: &[[f64; 8]]) -> Self {
        let apart = |a: &[f64], b: &[f64]| {
            let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let touching = rows.iter().filter(|row| row[4] == 1.0);
        let penetrations = touching.map(|row| apart(&row[1..4], &row[5..8]));
        let mut penetration_mm: Vec<_> = penetrations.collect();
        penetration_mm.sort_by(f64::total_cmp);
        let (mut held_s, mut from) = (0.0f64, 0);
        for (at, row) in rows.iter().enumerate() {
            let since = &rows[from];
            if row[4] == 0.0 || since[4] == 0.0 || apart(&row[5..8], &since[5..8]) >= 0.25 {
                from = at;
            } else if apart(&row[1..3], &since[1..3]) > 3.0 {
                held_s = held_s.max(row[0] - since[0]);
            }
        }
        Self {
            penetration_mm,
            held_s,
        }
    }

    fn mean(&self) -> f64 {
        self.penetration_mm.iter().sum::<f64>() / self.penetration_mm.len() as f64
    }

    fn of_all(&self, share: f64) -> f64 {
        self.penetration_mm[(share * (self.penetration_mm.len() - 1) as f64) as usize]
    }
}

/// With the default ball of a hand.
#[test]
fn friction_catches_no_hand_on_ten_real_terrains() {
    for name in [
        "dom1_32_356_5699_1_nw_2020.tif",
        "bijou_gully_5m.asc",
        "west_bijou_gully.asc",
        "mt_everest_90m.tif",
        "mt_rainier_90m.tif",
        "bigtujunga.tif",
        "SainteHelens.dem",
        "LisbonElevation.tif",
        "Kilauea.utm.nc",
        "red_butte_slc_utm12_f32.tif",
    ] {
        let Some(file) = shared(&format!("dem/real/{name}")) else {
            return;
        };
        let is_own = name.ends_with(".tif") || name.ends_with(".asc");
        if !is_own && heightfield::gdal().is_err() {
            println!("skipped: there is no libgdal for {name}");
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let [ice, rough] = ["0", "0.4"].map(|mu| Touched::in_demo(folder.path(), &file, mu));
        let times = [0.95, 1.0].map(|share| rough.of_all(share) / ice.of_all(share));
        let [mean, held_s] = [rough.mean() / ice.mean(), rough.held_s];
        let found = format!(
            "{name}: penetration × {mean:.2}, 95 % × {:.2}, largest × {:.2}; held {held_s:.2} s",
            times[0], times[1]
        );
        eprintln!("{found}");
        assert!(rough.penetration_mm.len() > 3000, "{name}: hardly touched");
        assert!(mean <= 2.0 && times[0] <= 2.0 && held_s <= 1.0, "{found}");
        // Walls and the steepest ridges hold the proxy for longest.
        let max = match name {
            "dom1_32_356_5699_1_nw_2020.tif" | "mt_everest_90m.tif" => 4.5,
            _ => 2.0,
        };
        assert!(times[1] <= max, "{found}: at most {max}");
    }
}
