//! A terrain is rendered in its true shape: planes of known slope on the ellipsoid, stored in
//! degrees.

use std::path::PathBuf;

use hapterra::replay::on_native;
use hapterra::terrain::{HapticCells, HapticGrid, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use heightfield::{OpenOptions, Raster};

/// Samples along a side, and degrees between them.
const SIDE: u32 = 80;
const STEP_DEG: f64 = 0.001;

/// Returns the metres in a degree of longitude and of latitude at a latitude, from the radii of
/// curvature of WGS 84.
fn degree_m(latitude_deg: f64) -> [f64; 2] {
    let (a, e2) = (6_378_137.0_f64, 0.006_694_379_990_14);
    let (sin, cos) = latitude_deg.to_radians().sin_cos();
    let w = 1.0 - e2 * sin * sin;
    [a * cos / w.sqrt(), a * (1.0 - e2) / (w * w.sqrt())].map(f64::to_radians)
}

/// Writes a grid of degrees at a latitude whose heights rise by `slope` metres a metre east and
/// north.
fn plane(latitude_deg: f64, slope: [f64; 2]) -> PathBuf {
    let middle = latitude_deg + f64::from(SIDE) * STEP_DEG / 2.0;
    let [east, north] = degree_m(middle).map(|metres| metres * STEP_DEG);
    let mut text = format!(
        "ncols {SIDE}\nnrows {SIDE}\nxllcorner 10\nyllcorner {latitude_deg}\ncellsize {STEP_DEG}\n"
    );
    for row in (0..SIDE).rev() {
        let heights = (0..SIDE).map(|column| {
            let (column, row) = (f64::from(column), f64::from(row));
            format!("{:.6}", column * east * slope[0] + row * north * slope[1])
        });
        text += &(heights.collect::<Vec<_>>().join(" ") + "\n");
    }
    let name = format!("plane_{latitude_deg}_{}_{}.asc", slope[0], slope[1]);
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).expect("writable");
    path
}

/// Returns the force over the middle of a terrain, a cell deep.
fn force(terrain: &Terrain<'_>) -> [f64; 3] {
    let mut replayer = on_native(terrain, SurfaceParams::PREMIUM).expect("opened");
    let [east, north] = terrain.size_mm().map(|size| size / 2.0);
    let ground = terrain.height_mm(east, north).expect("known");
    for depth in [-2.0, 1.0] {
        let hip = terrain.scale().to_grid([east, north, ground - depth]);
        let sample = replayer.step(hip.expect("addressable")).expect("rendered");
        if depth > 0.0 {
            assert_eq!(sample.state, ContactState::Touching);
            return sample.force_n.to_array().map(f64::from);
        }
    }
    unreachable!("the second point is below ground")
}

#[test]
fn slope_on_degree_grid_is_rendered_true_in_any_direction() {
    for latitude in [0.0, 35.0, 60.0, -72.0] {
        for slope in [[1.0, 0.0], [0.0, 1.0], [0.5, -0.5]] {
            let raster = Raster::open(plane(latitude, slope), &OpenOptions::default());
            let raster = raster.expect("opens");
            let grid = HapticGrid::new(&raster, HapticCells::Square);
            let scale = grid.true_scale(1.0).expect("scale");
            let terrain = Terrain::over(grid, scale, 0).expect("terrain");
            let [x, y, z] = force(&terrain);
            let rendered = [-x / z, -y / z];
            for axis in 0..2 {
                let off = (rendered[axis] - slope[axis]).abs();
                assert!(off < 1e-3, "at {latitude}°: {rendered:?} for {slope:?}");
            }
        }
    }
}

/// Same through the command: at 1 mm a cell, a millimetre of the trajectory is a rendered cell, so
/// a step east and a step north are equally far on the ground.
#[test]
fn replay_at_60_degrees_renders_slopes_alike_on_both_axes() {
    let folder = tempfile::tempdir().expect("a folder");
    let [path, out] = ["path.csv", "felt.csv"].map(|name| folder.path().join(name));
    for (slope, axis) in [([1.0, 0.0], 0), ([0.0, 1.0], 1)] {
        // From high above to ten millimetres below the plane at (30, 30) mm.
        std::fs::write(&path, "t_s,x_mm,y_mm,z_mm\n0,30,30,90\n1,30,30,20\n").expect("written");
        let run = std::process::Command::new(hapterra_tests::hapterra_binary())
            .arg("replay")
            .args([&plane(60.0, slope), &path])
            .args(["--scale", "1mm/cell", "-o"])
            .arg(&out)
            .output()
            .expect("started");
        let printed = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{printed}");
        let text = std::fs::read_to_string(&out).expect("there");
        let last = text.lines().last().expect("a row").split(',');
        let rendered: Vec<f64> = last
            .take(11)
            .map(|x| x.parse().expect("a number"))
            .collect();
        let [proxy, force] = [&rendered[5..8], &rendered[8..11]];
        assert_eq!(rendered[4], 1.0, "{rendered:?}");
        assert!(
            (-force[axis] / force[2] - 1.0).abs() < 1e-3,
            "{slope:?}: {rendered:?}"
        );
        assert!(
            force[1 - axis].abs() < 1e-3 * force[2],
            "{slope:?}: {rendered:?}"
        );
        // At 45° the proxy is half way between the plane's points above and beside the HIP.
        assert!((proxy[axis] - 25.0).abs() < 0.05, "{slope:?}: {rendered:?}");
        assert!((proxy[2] - 25.0).abs() < 0.05, "{slope:?}: {rendered:?}");
    }
}

#[test]
fn stored_cells_are_rendered_as_squares_of_the_same_area() {
    let raster = Raster::open(plane(60.0, [1.0, 0.0]), &OpenOptions::default()).expect("opens");
    let grid = HapticGrid::new(&raster, HapticCells::Stored);
    assert_eq!((grid.columns(), grid.rows()), (SIDE, SIDE));
    let terrain = Terrain::over(grid, grid.true_scale(1.0).expect("scale"), 0);
    let [x, _, z] = force(&terrain.expect("terrain"));
    assert!((x / z).abs() < 0.75, "a cell is half as wide as it is long");
}
