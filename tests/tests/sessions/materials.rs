//! Materials, from the command line and on the emulated board.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use hapterra::cli::options::surface::table::TableFile;
use hapterra::link::{Emulator, Timeouts};
use hapterra::materials::{ClassMaterial, ClassMaterials, Materials};
use hapterra::replay::{OfflineDevice, on_native};
use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain};
use hapterra_core::contact::{ContactState, Friction};
use hapterra_core::force::{Material, Pattern, Shading, SurfaceParams, Texture};
use hapterra_tests::emulation::emulated_board;
use hapterra_tests::hapterra_binary;
use hapterra_tests::random_paths::wander;
use heightfield::Raster;

const UTM_32: &str = r#"PROJCS["WGS_1984_UTM_Zone_32N",GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",500000.0],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",9.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Meter",1.0]]"#;
const LONLAT: &str = r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]"#;
/// Position of the terrain's first column, east of its zone's origin, m: 9° east lies between two
/// columns.
const FIRST_COLUMN: f64 = 499_503.0;
/// Distance of columns, m; a column is a millimetre in the hand.
const COLUMN: f64 = 10.0;
/// Rows of the trajectory in a millimetre.
const ROWS_PER_MM: u32 = 100;

/// A folder with a terrain, classes, and a path over their border.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        folder.grid(
            "level.asc",
            (101, 81),
            [FIRST_COLUMN, 5_000_000.0],
            COLUMN,
            UTM_32,
            |_| 0,
        );
        folder.classes("classes.asc", 8.99);
        folder.write(
            "table.toml",
            "[class.10]\nname = \"meadow\"\nstiffness = 0.4\n\n[class.80]\nname = \"rock\"\nstiffness = 1.0\n",
        );
        let mut path = "t_s,x_mm,y_mm,z_mm\n0,45,40.3,2\n".to_owned();
        for row in 0..10 * ROWS_PER_MM {
            let x = 45.0 + f64::from(row) / f64::from(ROWS_PER_MM);
            writeln!(path, "{},{x},40.3,-2", f64::from(row + 1) * 1e-3).expect("written");
        }
        folder.write("way.csv", &path);
        folder
    }

    /// Writes classes in degrees, with pixels 15.7 m wide and 22 m high, and a border at the
    /// western edge of the 51st column.
    fn classes(&self, name: &str, west: f64) {
        let class = |column| if column < 50 { 10 } else { 80 };
        self.grid(name, (100, 100), [west + 1e-4, 45.14], 2e-4, LONLAT, class);
    }

    /// Writes a grid, placed by the middle of its south-west cell.
    fn grid(
        &self,
        name: &str,
        (columns, rows): (u32, u32),
        [x, y]: [f64; 2],
        step: f64,
        system: &str,
        value: impl Fn(u32) -> i32,
    ) {
        let mut text = format!(
            "ncols {columns}\nnrows {rows}\nxllcenter {x}\nyllcenter {y}\ncellsize {step}\nNODATA_value -9\n"
        );
        for _ in 0..rows {
            let row: Vec<_> = (0..columns)
                .map(|column| value(column).to_string())
                .collect();
            text += &(row.join(" ") + "\n");
        }
        self.write(name, &text);
        self.write(&name.replace(".asc", ".prj"), system);
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).expect("written");
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.path().join(name)).expect("there")
    }

    /// Returns the success of the command, and its output.
    fn hapterra(&self, args: &[&str]) -> (bool, String) {
        let run = Command::new(hapterra_binary())
            .current_dir(self.0.path())
            .args(args)
            .output()
            .expect("started");
        let [printed, complained] =
            [&run.stdout, &run.stderr].map(|out| String::from_utf8_lossy(out));
        (run.status.success(), format!("{printed}{complained}"))
    }
}

const REPLAY: [&str; 4] = ["replay", "level.asc", "way.csv", "--out"];
const MATERIALS: [&str; 4] = ["--materials", "classes.asc", "--surface", "table.toml"];

/// Returns the position and upward force of each row of a recording in contact.
fn rendered(recording: &str) -> Vec<(f64, f64)> {
    let rows = recording.lines().filter(|line| !line.starts_with('#'));
    let mut rows = rows.map(|row| row.split(',').collect::<Vec<_>>());
    let header = rows.next().expect("a header");
    let place = |name| {
        header
            .iter()
            .position(|column| *column == name)
            .expect(name)
    };
    let (x, force, contact) = (place("x_mm"), place("force_z_n"), place("contact"));
    let number = |cell: &str| cell.parse().expect("a number");
    rows.filter(|row| row[contact] == "1")
        .map(|row| (number(row[x]), number(row[force])))
        .collect()
}

#[test]
fn classes_in_another_system_and_resolution_are_in_place() {
    let folder = Folder::new();
    let (succeeded, printed) = folder.hapterra(&[&REPLAY[..], &["a.csv"], &MATERIALS].concat());
    assert!(succeeded, "{printed}");
    assert!(printed.contains("materials      "), "{printed}");
    assert!(
        printed.contains("rock") && printed.contains("meadow"),
        "{printed}"
    );
    let rendered = rendered(&folder.read("a.csv"));
    assert_eq!(rendered.len(), 10 * ROWS_PER_MM as usize);
    // 9° east is at 49.7 mm, between the columns 49 and 50: a border may be off by half a cell and
    // half a pixel.
    let border = (500_000.0 - FIRST_COLUMN) / COLUMN;
    let (first, last) = (0.4 * 2.0, 1.0 * 2.0);
    let changed = rendered
        .iter()
        .position(|(_, force)| (force - first).abs() > 1e-6);
    let (at, _) = rendered[changed.expect("it changes")];
    assert!(
        (at - border).abs() < 0.5 + 0.5 * 15.7 / COLUMN,
        "{at}, not {border}"
    );
    // By the samples themselves it is half way between 49 and 50.
    assert!((at - 49.5).abs() < 0.011, "{at}");
    let (_, end) = rendered[rendered.len() - 1];
    assert!((end - last).abs() < 1e-6, "{end}");
    // Over 100 ms, linearly.
    let steps = rendered.windows(2).map(|pair| pair[1].1 - pair[0].1);
    let most = steps.fold(0.0, f64::max);
    assert!(
        (most - (last - first) / 100.0).abs() < 1e-5,
        "{most} N in a tick"
    );
    let rows = rendered
        .iter()
        .filter(|(_, force)| *force > first + 1e-6 && *force < last - 1e-6);
    assert_eq!(rows.count(), 99);
}

#[test]
fn replay_uses_the_materials_of_the_recording() {
    let folder = Folder::new();
    let replay = |more: &[&str], output: &str| {
        folder.hapterra(&[&["replay", "level.asc", "a.csv", "--out", output][..], more].concat())
    };
    let (succeeded, printed) = folder.hapterra(&[&REPLAY[..], &["a.csv"], &MATERIALS].concat());
    assert!(succeeded, "{printed}");
    let recorded = folder.read("a.csv");
    assert!(
        recorded.contains("# [materials]\n# file = \"classes.asc\"\n"),
        "{recorded:.2000}"
    );
    assert!(recorded.contains("name = \"rock\""));
    // The table is in the recording; the classes are read again.
    std::fs::remove_file(folder.0.path().join("table.toml")).expect("removed");
    let (again, printed) = replay(&[], "b.csv");
    assert!(again && printed.contains("rock"), "{printed}");
    assert_eq!(rendered(&folder.read("b.csv")), rendered(&recorded));
    let (again, printed) = replay(&["--stiffness", "1"], "c.csv");
    assert!(again, "{printed}");
    // Each material is twice as stiff as with the 0.5 N/mm of the recording.
    for ((_, twice), (_, once)) in rendered(&folder.read("c.csv"))
        .iter()
        .zip(rendered(&recorded))
    {
        assert!((twice - 2.0 * once).abs() < 1e-5, "{twice} {once}");
    }
    // Options that each material has itself cannot be given as well.
    for option in [["--friction", "0.4"], ["--surface", "sand"]] {
        let (again, printed) = replay(&option, "no.csv");
        assert!(!again && printed.contains("hint: "), "{printed}");
        assert!(
            printed.contains(option[0]) && printed.contains("materials"),
            "{printed}"
        );
    }
    // The path alone has no materials.
    let (again, printed) = replay(&["--ignore-settings"], "d.csv");
    assert!(again && !printed.contains("rock"), "{printed}");
    assert!(
        rendered(&folder.read("d.csv"))
            .iter()
            .all(|(_, force)| (force - 1.0).abs() < 1e-6)
    );
    // The same classes at another position are different classes.
    folder.classes("classes.asc", 8.9902);
    let (again, printed) = replay(&[], "e.csv");
    assert!(
        !again && printed.contains("classes of its materials differ"),
        "{printed}"
    );
}

#[test]
fn demo_and_run_accept_and_record_materials() {
    let folder = Folder::new();
    let demo = [
        "demo",
        "level.asc",
        "--device",
        "native",
        "--duration",
        "3s",
    ];
    let (succeeded, printed) = folder.hapterra(&[&demo[..], &MATERIALS].concat());
    assert!(
        succeeded && printed.contains("materials      "),
        "{printed}"
    );
    assert!(folder.read("demo/level.csv").contains("# [materials]\n"));
    let run = [
        "run",
        "level.asc",
        "--device",
        "native",
        "--duration",
        "3s",
        "--out",
        "r.csv",
    ];
    let (succeeded, printed) = folder.hapterra(&[&run[..], &MATERIALS].concat());
    assert!(
        succeeded && printed.contains("materials      "),
        "{printed}"
    );
    assert!(folder.read("r.csv").contains("# [materials]\n"));
}

#[test]
fn stiffness_change_is_limited_by_the_stiffest_material() {
    // The default has 0.5 N/mm and rock 1.0.
    let folder = Folder::new();
    let run = ["run", "level.asc", "--device", "native", "--duration", "3s"];
    let output_of = |factor: &str| {
        folder.write("steps.txt", &format!("at 1 stiffness {factor}\n"));
        let (_, printed) =
            folder.hapterra(&[&run[..], &["--commands", "steps.txt"], &MATERIALS].concat());
        printed
    };
    let refused = output_of("1.5");
    assert!(
        refused.contains("the stiffest of the materials would have 1.500 N/mm"),
        "{refused}"
    );
    let softer = output_of("0.8");
    assert!(!softer.contains("would have"), "{softer}");
}

#[test]
fn invalid_materials_are_refused_with_a_hint() {
    let folder = Folder::new();
    let fails = |materials: &str, table: &str, parts: &[&str]| {
        let options = ["x.csv", "--materials", materials, "--surface", table];
        let (succeeded, printed) = folder.hapterra(&[&REPLAY[..], &options].concat());
        assert!(!succeeded && printed.contains("hint: "), "{printed}");
        for part in parts {
            assert!(printed.contains(part), "{part}: {printed}");
        }
    };
    folder.classes("elsewhere.asc", 12.0);
    fails(
        "elsewhere.asc",
        "table.toml",
        &["longitude 12.0", "longitude 8.99"],
    );
    std::fs::copy(
        folder.0.path().join("classes.asc"),
        folder.0.path().join("bare.asc"),
    )
    .expect("copied");
    fails("no.asc", "table.toml", &["no.asc"]);
    folder.write("odd.toml", "[class.10]\nfrictoin = 0.3\n");
    fails("classes.asc", "odd.toml", &["line 2", "frictoin"]);
    folder.write("wild.toml", "[default]\n[class.10]\nfriction = 30\n");
    fails(
        "classes.asc",
        "wild.toml",
        &["wild.toml, line 2, class 10", "friction of 30"],
    );
    let (succeeded, printed) =
        folder.hapterra(&[&REPLAY[..], &["x.csv"], &MATERIALS[..2]].concat());
    assert!(!succeeded && printed.contains("--surface"), "{printed}");
    // No output may overwrite one of them.
    let (succeeded, printed) =
        folder.hapterra(&[&REPLAY[..], &["table.toml"], &MATERIALS].concat());
    assert!(
        !succeeded && folder.read("table.toml").contains("rock"),
        "{printed}"
    );
}

/// Returns the example of the documentation.
fn worldcover() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/worldcover.toml")
}

#[test]
fn worldcover_table_names_all_classes_and_is_valid() {
    let table = TableFile::open(&worldcover()).expect("a table");
    let classes: Vec<_> = table.classes.iter().map(|(class, ..)| *class).collect();
    assert_eq!(classes, [10, 20, 30, 40, 50, 60, 70, 80, 90, 95, 100]);
    assert!(table.classes.iter().all(|(_, _, look)| look.name.is_some()));
    let folder = Folder::new();
    let file = worldcover();
    let options = ["w.csv", "--materials", "classes.asc", "--surface"];
    let replay = [&REPLAY[..], &options, &[file.to_str().expect("text")]].concat();
    let (succeeded, printed) = folder.hapterra(&replay);
    assert!(succeeded, "{printed}");
    assert!(
        printed.contains("permanent water bodies") && !printed.contains("warn"),
        "{printed}"
    );
}

/// Returns materials of all kinds in patches of some cells, over a terrain.
fn patchwork(raster: &Raster) -> Materials {
    let plain = Material::of(&SurfaceParams::PREMIUM);
    let texture = |pattern, wavelength_mm| Texture {
        pattern,
        amplitude_mm: 0.1,
        wavelength_mm,
        direction_deg: 20.0,
        seed: 5,
    };
    let friction = Friction {
        static_mu: 0.6,
        dynamic_mu: 0.4,
        viscous_s: 0.003,
    };
    let materials = [
        Material {
            stiffness_n_per_mm: 0.9,
            friction,
            ..plain
        },
        Material {
            texture: texture(Pattern::Grain, 1.3),
            damping_ns_per_m: 3.0,
            ..plain
        },
        Material {
            texture: texture(Pattern::Grating, 2.1),
            friction: Friction::coulomb(0.2),
            ..plain
        },
    ];
    let classes = Raster::from_fn(raster.columns(), raster.rows(), |x, y| {
        ((x / 5 + y / 7) % 4) as f32
    });
    let class = |(i, material): (i64, &Material)| ClassMaterial {
        class: i,
        name: None,
        material: *material,
    };
    let class_materials = ClassMaterials {
        default: plain,
        class: (1..).zip(&materials).map(class).collect(),
    };
    let classes = ("classes", classes.expect("raster"));
    Materials::over(("terrain", raster), classes, class_materials).expect("they overlap")
}

fn walk(replayer: &mut OfflineDevice<'_>, path: &[[f64; 3]]) -> Vec<(ContactState, [u32; 9])> {
    let scale = *replayer.terrain().scale();
    let step = |mm: &[f64; 3]| {
        let hip = scale.to_grid(*mm).expect("addressable");
        let sample = replayer.step(hip).expect("rendered");
        let [x, y, z] = sample.proxy.cell().map(|cell| cell as u32);
        let [u, v, w] = sample.proxy.frac().to_array().map(f32::to_bits);
        let [fx, fy, fz] = sample.force_n.to_array().map(f32::to_bits);
        (sample.state, [x, y, z, u, v, w, fx, fy, fz])
    };
    path.iter().map(step).collect()
}

#[test]
fn replay_with_materials_is_bit_identical_on_emulated_board() {
    let raster = Synth::new(Kind::Fractal, 3, 25.0).raster(150, 140);
    let raster = raster.expect("raster");
    let materials = patchwork(&raster);
    let grid = HapticGrid::new(&raster, HapticCells::Stored);
    let scale = Scale::new(0.8, 0.9).expect("scale");
    let one = Terrain::over(grid, scale, 0).expect("terrain");
    let several = grid.with_materials(Some(&materials));
    let several = Terrain::over(several, scale, 0).expect("terrain");
    let path = wander(&one, 17, 400, -1.0);
    let params = SurfaceParams {
        shading: Shading::Smooth,
        ..SurfaceParams::PREMIUM
    };
    let mut native = on_native(&several, params).expect("opened");
    let expected = walk(&mut native, &path);
    let mut plain = on_native(&one, params).expect("opened");
    let plain = walk(&mut plain, &path);
    let touching = |rendered: &&(ContactState, [u32; 9])| rendered.0 == ContactState::Touching;
    assert!(expected.iter().filter(touching).count() > 80);
    let differ = expected
        .iter()
        .zip(&plain)
        .filter(|(one, other)| one != other);
    assert!(differ.count() > 50, "the materials are rendered");
    let Some((qemu, image)) = emulated_board() else {
        return;
    };
    let (emulator, lines) = Emulator::start(&qemu, &image).expect("started");
    let _plant = lines.plant;
    let link = Box::new(lines.link);
    let mut board =
        OfflineDevice::open(&several, params, link, Timeouts::EMULATED).expect("opened");
    let got = walk(&mut board, &path);
    for (i, (expected, got)) in expected.iter().zip(&got).enumerate() {
        assert_eq!(expected, got, "row {i} at {:?}", path[i]);
    }
    board.close().expect("sent");
    emulator.finish().expect("the board ended well");
}
