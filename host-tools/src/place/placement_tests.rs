//! Tests with every kind of grid at every kind of place: the requested place is under the hand.

use super::*;
use crate::place::{Coordinates, ReachBox};
use crate::terrain::HapticCells;
use crate::terrain::in_file::in_file;
use hapterra_core::Vec3;
use hapterra_core::phantom::{Calibration, Pose};
use heightfield::{CellSize, CellUnit, Certainty, Globe, GroundTransform, Raster, Wait};

const LONLAT: Coordinates = Coordinates::LonLat;
const OWN: Coordinates = Coordinates::Own;

/// Returns hills of 41 × 31 samples, with heights from 0 to 100 units.
fn hills() -> Raster {
    let raster = Raster::from_fn(41, 31, |column, row| {
        let (x, y) = (column as f32 * 0.2, row as f32 * 0.3);
        25.0 * (2.0 + x.sin() + y.cos())
    });
    raster.expect("raster")
}

fn cell(sides: (f64, f64), unit: CellUnit, lean: f64) -> CellSize {
    CellSize {
        east: sides.0,
        north: sides.1,
        lean,
        unit,
        map_scale: (1.0, 1.0),
        latitude: matches!(unit, CellUnit::Degree).then_some(60.0),
        globe: Globe::EARTH,
        certainty: Certainty::Stated,
    }
}

/// Returns rasters at places: name, raster, and whether the place on the globe is known.
fn made() -> Vec<(&'static str, Raster, bool)> {
    let metre = CellUnit::Length { metres: 1.0 };
    let at = |origin, column, row, epsg, size| {
        let ground = GroundTransform::new(origin, column, row).expect("a plane");
        hills().with_cell(size).with_ground(ground, epsg)
    };
    let degrees = cell((0.001, 0.001), CellUnit::Degree, 0.0);
    let tens = cell((10.0, 10.0), metre, 0.0);
    let leaning = cell((10.0, 8.0), metre, 0.28);
    vec![
        (
            "degrees at 60° N",
            at(
                [10.0, 60.0],
                [0.001, 0.0],
                [0.0, 0.001],
                Some(4326),
                degrees,
            ),
            true,
        ),
        (
            "degrees over the antimeridian",
            at([179.98, -10.0], [0.001, 0.0], [0.0, 0.001], None, degrees),
            true,
        ),
        (
            "UTM",
            at([386e3, 379e4], [10.0, 0.0], [0.0, 10.0], Some(26911), tens),
            true,
        ),
        (
            "web Mercator at 60° N",
            at(
                [1e6, 8_399_000.0],
                [10.0, 0.0],
                [0.0, 10.0],
                Some(3857),
                tens,
            ),
            true,
        ),
        (
            "rotated UTM",
            at([386e3, 379e4], [8.0, 6.0], [-6.0, 8.0], Some(32612), tens),
            true,
        ),
        (
            "skewed, no code",
            at([100.0, 50.0], [10.0, 0.0], [2.24, 7.68], None, leaning),
            false,
        ),
        (
            "no code",
            at([386e3, 379e4], [10.0, 0.0], [0.0, 10.0], None, tens),
            false,
        ),
        ("nothing known", hills(), false),
    ]
}

fn reach() -> Reach {
    Reach::of(&Calibration::PREMIUM_1_5)
}

/// Returns the placement and its grid.
fn placed<'r>(
    raster: &'r Raster,
    options: &PlacementOptions,
) -> Result<(HapticGrid<'r>, Placement), PlaceError> {
    let grid = options.target.grid(raster, HapticCells::Square)?;
    let view = Placement::new(&grid, &reach(), options)?;
    Ok((grid, view))
}

fn at(place: [f64; 2], coordinates: Coordinates, sizing: Sizing) -> PlacementOptions {
    PlacementOptions {
        target: Target::At(place, coordinates),
        sizing,
        ..PlacementOptions::default()
    }
}

fn boxed(sides: [f64; 4], coordinates: Coordinates) -> PlacementOptions {
    PlacementOptions {
        target: Target::Box(sides, coordinates),
        ..PlacementOptions::default()
    }
}

/// Returns the coordinates under the home position of a device's scene.
fn ground_at_home(grid: &HapticGrid<'_>, view: &Placement) -> [f64; 2] {
    let terrain = view.terrain(*grid).expect("a terrain");
    let scene = view
        .scene(&terrain, SurfaceParams::PREMIUM)
        .expect("a scene");
    let [east, north, _] = terrain.scale().to_mm(&scene.home);
    grid.to_ground([east, north].map(|mm| mm / view.scale.cell_mm()))
}

#[test]
fn home_position_is_above_the_requested_location() {
    for (name, raster, on_globe) in made() {
        let file = raster.georeference();
        for sample in [[20.0, 15.0], [3.3, 28.9], [37.7, 1.2]] {
            let ground = file.transform().to_ground(sample);
            for level in [None, Some(0), Some(2)] {
                for sizing in [Sizing::Fit, Sizing::CellMm(0.37), Sizing::CellMm(5.0)] {
                    let options = PlacementOptions {
                        level,
                        ..at(ground, OWN, sizing)
                    };
                    let (grid, view) = placed(&raster, &options).expect(name);
                    let found = grid.of_ground(ground_at_home(&grid, &view));
                    let expected = grid.of_ground(ground);
                    let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
                    assert!(off < 0.5, "{name}, {sample:?}: {off} cells");
                    // The real error is much smaller.
                    assert!(off < 1e-3, "{name}, {sample:?}: {off} cells");
                    let height = grid.surface(expected).expect("known");
                    let up = height * view.scale.height_mm_per_unit();
                    assert!((view.home_mm[2] - up - ABOVE_MM).abs() < 1e-6, "{name}");
                }
            }
            let lonlat = file.to_lonlat(ground);
            assert_eq!(lonlat.is_some(), on_globe, "{name}");
            if let Some(lonlat) = lonlat {
                let (_, view) = placed(&raster, &at(lonlat, LONLAT, Sizing::Fit)).expect(name);
                let off = [0, 1].map(|axis| view.home_ground[axis] - ground[axis]);
                let step = file.transform().column_step();
                let share = off[0].hypot(off[1]) / step[0].hypot(step[1]);
                assert!(share < 1e-2, "{name}: {share} samples");
            }
        }
    }
}

#[test]
fn fit_fills_the_workspace_of_every_premium() {
    for record in [
        Calibration::PREMIUM_1_0,
        Calibration::PREMIUM_1_5,
        Calibration::PREMIUM_3_0,
    ] {
        let reach = Reach::of(&record);
        for (name, raster, _) in made() {
            for times in [1.0, -2.0, 20.0] {
                let grid = HapticGrid::new(&raster, HapticCells::Square);
                let options = PlacementOptions {
                    heights: Heights::Exaggerated(times),
                    ..PlacementOptions::default()
                };
                let view = Placement::new(&grid, &reach, &options).expect(name);
                let around_home = |spare: f64| {
                    let (extent_mm, heights) = (view.extent_mm, view.heights_mm);
                    let low = [extent_mm[0], extent_mm[1], heights[0] - spare];
                    let high = [extent_mm[2], extent_mm[3], heights[1] + spare];
                    ReachBox {
                        low: [0, 1, 2].map(|axis| low[axis] - view.home_mm[axis]),
                        high: [0, 1, 2].map(|axis| high[axis] - view.home_mm[axis]),
                    }
                };
                assert!(
                    reach.contains(&around_home(9.9)),
                    "{name} {:?}",
                    record.model
                );
                let tip = Pose::from_angles(&record, Vec3::ZERO).tip_mm();
                let held = around_home(9.9);
                for corner in 0..8 {
                    let [east, north, up] = [0, 1, 2].map(|axis| match corner >> axis & 1 {
                        0 => held.low[axis] as f32,
                        _ => held.high[axis] as f32,
                    });
                    let at = tip + Vec3::new(-north, east, up);
                    assert!(record.joints_at(at).is_ok(), "{name}: {at}");
                }
                let size = [
                    view.extent_mm[2] - view.extent_mm[0],
                    view.extent_mm[3] - view.extent_mm[1],
                    view.heights_mm[1] - view.heights_mm[0],
                ];
                let larger = size.map(|side| 1.05 * side + 26.0);
                assert_eq!(reach.middle_of(larger), None, "{name}: {size:?} mm");
            }
        }
    }
}

#[test]
fn suitable_heights_are_true_to_scale_or_exaggerated() {
    let metre = CellUnit::Length { metres: 1.0 };
    let options = |sizing| PlacementOptions {
        heights: Heights::Suited,
        sizing,
        ..PlacementOptions::default()
    };
    for side in [10.0, 1000.0, 1e5] {
        let raster = hills().with_cell(cell((side, side), metre, 0.0));
        for sizing in [Sizing::Fit, Sizing::GroundMPerMm(side / 4.0)] {
            let (_, view) = placed(&raster, &options(sizing)).expect("fits");
            let relief = view.heights_mm[1] - view.heights_mm[0];
            let times = view.exaggeration.expect("known");
            match side > 10.0 {
                true => assert!(
                    (relief - CLEAR_RELIEF_MM).abs() < 1e-6 && times > 2.0,
                    "{view:?}"
                ),
                false => assert!(relief > CLEAR_RELIEF_MM && times == 1.0, "{view:?}"),
            }
        }
    }
    assert_eq!(suited_height(0.5, 0.0), 0.5, "a plain that is level");
}

#[test]
fn reported_scale_matches_location_and_level() {
    for (name, raster, side) in [
        ("degrees", &made()[0].1, 55.66),
        ("UTM", &made()[2].1, 10.0),
        ("web Mercator", &made()[3].1, 5.0),
    ] {
        let file = raster.georeference();
        let ground = file.transform().to_ground([20.0, 15.0]);
        let options = PlacementOptions {
            level: Some(2),
            ..at(ground, OWN, Sizing::GroundMPerMm(40.0))
        };
        let (grid, view) = placed(raster, &options).expect(name);
        let found = view.ground_m_per_mm().expect("known");
        assert!((found - 40.0).abs() < 1e-9, "{name}: {found}");
        let haptic = view.haptic_cell_m().expect("known");
        assert!(
            (haptic / (4.0 * side) - 1.0).abs() < 5e-3,
            "{name}: {haptic}"
        );
        assert!(
            (haptic / view.haptic_cell_mm() - 40.0).abs() < 1e-9,
            "{name}"
        );
        assert_eq!(
            view.exaggeration.map(|times| (times * 1e6).round()),
            Some(1e6)
        );
        let terrain = view.terrain(grid).expect("a terrain");
        assert_eq!(terrain.scale().cell_mm(), view.haptic_cell_mm());
    }
}

#[test]
fn cells_are_square_at_the_touched_place() {
    let degrees = cell((0.01, 0.01), CellUnit::Degree, 0.0);
    let raster = Raster::from_fn(50, 600, |column, row| (column + row) as f32).expect("raster");
    let ground = GroundTransform::new([10.0, 57.0], [0.01, 0.0], [0.0, 0.01]);
    let raster = raster
        .with_cell(degrees)
        .with_ground(ground.expect("a plane"), Some(4326));
    for latitude in [57.5_f64, 62.5] {
        let options = at([10.2, latitude], OWN, Sizing::Fit);
        let (grid, _) = placed(&raster, &options).expect("there");
        let side = grid.side_m().expect("known");
        let (a, e2) = (6_378_137.0_f64, 0.006_694_379_990_14);
        let (sin, cos) = latitude.to_radians().sin_cos();
        let true_side = (a * cos / (1.0 - e2 * sin * sin).sqrt()).to_radians() * 0.01;
        assert!(
            (side / true_side - 1.0).abs() < 1e-3,
            "{latitude}: {side} for {true_side}"
        );
    }
}

#[test]
fn box_is_centred_and_no_finer_than_the_encoders() {
    let raster = Raster::from_fn(30_000, 60, |column, _| (column % 100) as f32).expect("raster");
    let ground = GroundTransform::new([5e5, 4e6], [1.0, 0.0], [0.0, 1.0]).expect("a plane");
    let raster = raster.with_ground(ground, Some(32612));
    let whole = placed(&raster, &PlacementOptions::default())
        .expect("whole")
        .1;
    let resolution = reach().resolution_mm();
    // Single samples are finer than a count, pairs of them are not.
    assert!(whole.scale.cell_mm() < resolution, "{whole:?}");
    assert!(whole.haptic_cell_mm() >= resolution, "{whole:?}");
    assert_eq!(whole.level, 1, "{} mm", whole.haptic_cell_mm());
    assert!(0.5 * whole.haptic_cell_mm() < resolution, "{whole:?}");
    let sides = [501_000.0, 4_000_010.0, 501_060.0, 4_000_050.0];
    let (grid, view) = placed(&raster, &boxed(sides, OWN)).expect("there");
    assert_eq!(view.level, 0);
    let [west, south, east, north] = view.extent_mm.map(|mm| mm / view.scale.cell_mm());
    let corners = [grid.to_ground([west, south]), grid.to_ground([east, north])];
    for (found, expected) in corners.as_flattened().iter().zip(sides) {
        assert!((found - expected).abs() < 1e-3, "{corners:?}");
    }
    // The middle is directly in front of the home position.
    assert!((view.home_ground[0] - 501_030.0).abs() < 1e-3, "{view:?}");
    assert!(whole.ground_m_per_mm() > view.ground_m_per_mm());
}

#[test]
fn boxes_by_longitude_and_latitude_also_over_the_antimeridian() {
    let grids = made();
    let degrees = &grids[0].1;
    let by = |raster: &Raster, sides, coordinates| {
        placed(raster, &boxed(sides, coordinates)).map(|(_, view)| view.extent_mm)
    };
    let sides = [10.005, 60.005, 10.025, 60.02];
    let own = by(degrees, sides, OWN).expect("there");
    let lonlat = by(degrees, sides, LONLAT).expect("there");
    for side in 0..4 {
        assert!(
            (own[side] - lonlat[side]).abs() < 1e-6,
            "{own:?} {lonlat:?}"
        );
    }
    let utm = &grids[2].1;
    let file = utm.georeference();
    let [west, south] = file.to_lonlat([386_100.0, 3_790_100.0]).expect("there");
    let [east, north] = file.to_lonlat([386_200.0, 3_790_200.0]).expect("there");
    assert!(by(utm, [west, south, east, north], LONLAT).is_ok());
    // From 179.99 to 180.01, in any notation of the longitudes.
    let pacific = &grids[1].1;
    let first = by(pacific, [179.99, -9.99, -179.99, -9.98], LONLAT).expect("there");
    for sides in [
        [179.99, -9.99, 180.01, -9.98],
        [-180.01, -9.99, -179.99, -9.98],
    ] {
        for coordinates in [OWN, LONLAT] {
            let again = by(pacific, sides, coordinates).expect("there");
            for side in 0..4 {
                assert!(
                    (again[side] - first[side]).abs() < 1e-5,
                    "{again:?} {first:?}"
                );
            }
        }
    }
    assert!(by(pacific, [179.99, -9.99, -179.99, -9.98], OWN).is_ok());
    // The map of the world has its seam there.
    let web = &grids[3].1;
    let torn = by(web, [170.0, -10.0, -170.0, 10.0], LONLAT);
    assert!(
        matches!(torn, Err(PlaceError::BoxAcrossSeam { .. })),
        "{torn:?}"
    );
}

/// With a quarter of a degree between columns, the raster does not go around the globe.
#[test]
fn box_with_west_and_east_swapped_is_refused() {
    let raster = Raster::from_fn(4, 4, |column, row| (column + row) as f32).expect("raster");
    let ground = GroundTransform::new([-122.0, 46.0], [0.25, 0.0], [0.0, 0.25]);
    let raster = raster
        .with_cell(cell((0.25, 0.25), CellUnit::Degree, 0.0))
        .with_ground(ground.expect("a plane"), Some(4326));
    for coordinates in [OWN, LONLAT] {
        for sides in [[-121.5, 46.1, -121.8, 46.4], [-121.5, 46.1, -122.0, 46.4]] {
            let error = placed(&raster, &boxed(sides, coordinates)).expect_err("swapped");
            assert_eq!(error, PlaceError::WestInTheEast(sides));
        }
        let right = boxed([-121.8, 46.1, -121.5, 46.4], coordinates);
        assert!(placed(&raster, &right).is_ok());
    }
}

/// Rasters around the globe have a border, and half of a box is an error.
#[test]
fn box_across_globe_seam_is_refused_with_its_two_parts() {
    let globe = |west: f64| {
        let raster = Raster::from_fn(360, 90, |column, row| (column + row) as f32);
        let ground = GroundTransform::new([west, -44.5], [1.0, 0.0], [0.0, 1.0]);
        let raster = raster
            .expect("raster")
            .with_cell(cell((1.0, 1.0), CellUnit::Degree, 0.0));
        raster.with_ground(ground.expect("a plane"), Some(4326))
    };
    let requested = [170.0, -20.0, -170.0, -10.0];
    for (west, sides, parts) in [
        (
            -179.5,
            requested,
            ["--bbox -179.5,-20,-170,-10", "--bbox 170,-20,179.5,-10"],
        ),
        (
            0.5,
            [-10.0, -20.0, 10.0, -10.0],
            ["--bbox 0.5,-20,10,-10", "--bbox 350,-20,359.5,-10"],
        ),
    ] {
        let globe = globe(west);
        for coordinates in [OWN, LONLAT] {
            let error = placed(&globe, &boxed(sides, coordinates)).expect_err("two parts");
            let message = error.to_string();
            for part in parts {
                assert!(message.contains(part), "{part} in: {message}");
            }
        }
        // Each part is accepted, and so are a box elsewhere and the whole globe.
        for part in parts {
            let numbers = part.trim_start_matches("--bbox ").split(',');
            let numbers: Vec<f64> = numbers
                .map(|side| side.parse().expect("a number"))
                .collect();
            let sides = numbers.try_into().expect("four");
            assert!(placed(&globe, &boxed(sides, OWN)).is_ok(), "{part}");
        }
        assert!(placed(&globe, &boxed([20.0, -20.0, 40.0, -10.0], LONLAT)).is_ok());
        let (_, whole) = placed(&globe, &boxed([-180.0, -30.0, 180.0, 30.0], LONLAT)).expect("all");
        let columns = (whole.extent_mm[2] - whole.extent_mm[0]) / whole.scale.cell_mm();
        assert!(columns > 358.0, "{columns} columns");
    }
    // A raster that extends farther beyond 180° than the box contains it in one part.
    assert!(placed(&globe(0.5), &boxed(requested, LONLAT)).is_ok());
}

#[test]
fn invalid_placement_is_refused_with_the_bounds() {
    let grids = made();
    let utm = &grids[2].1;
    let no_code = &grids[6].1;
    let holes = Raster::from_fn(41, 31, |column, _| match column {
        0..20 => f32::NAN,
        _ => 7.0,
    });
    let holes = holes.expect("raster");
    let refused = |raster: &Raster, options: PlacementOptions| {
        let refused = placed(raster, &options).map(|_| ()).expect_err("refused");
        refused.to_string()
    };
    let utm_bounds =
        "x 386000 to 386400, y 3790000 to 3790300 (EPSG:26911), which is longitude -118.2";
    for (message, parts) in [
        (
            refused(utm, at([0.0, 0.0], OWN, Sizing::Fit)),
            ["x 0, y 0 (EPSG:26911) is outside", utm_bounds],
        ),
        (
            refused(utm, at([-72.5, 44.0], LONLAT, Sizing::Fit)),
            ["longitude -72.5, latitude 44 is outside", utm_bounds],
        ),
        (
            refused(utm, at([10.0, 95.0], LONLAT, Sizing::Fit)),
            ["latitude 95 is no place of the file's map", utm_bounds],
        ),
        (
            refused(utm, at([34.2454, -118.2365], LONLAT, Sizing::Fit)),
            ["longitude comes first", "-118.2365,34.2454 is"],
        ),
        (
            refused(no_code, at([-118.2, 34.2], LONLAT, Sizing::Fit)),
            ["states no reference system", "x 386000 to 386400"],
        ),
        (
            refused(&holes, at([5.0, 5.0], OWN, Sizing::Fit)),
            ["no data at column 5, row 5", "column 0 to 40, row 0 to 30"],
        ),
        (
            refused(&holes, boxed([1.0, 1.0, 9.0, 9.0], OWN)),
            ["no data in the box 1,1,9,9", "column 0 to 40"],
        ),
        (
            refused(&holes, boxed([25.0, 10.0, 25.5, 20.0], OWN)),
            ["smaller than a cell", "column 0 to 40"],
        ),
        (
            refused(utm, boxed([0.0, 0.0, 1.0, 1.0], OWN)),
            ["the box 0,0,1,1 is outside", utm_bounds],
        ),
        (
            refused(utm, boxed([2.0, 0.0, 1.0, 1.0], OWN)),
            ["west,south,east,north", "2,0,1,1 is not"],
        ),
        (
            refused(utm, boxed([f64::NAN, 0.0, 1.0, 1.0], OWN)),
            ["west,south,east,north", "NaN,0,1,1 is not"],
        ),
    ] {
        for part in parts {
            assert!(message.contains(part), "{part} in: {message}");
        }
    }
    let sized = |sizing| {
        let options = PlacementOptions {
            sizing,
            ..PlacementOptions::default()
        };
        placed(utm, &options).map(|_| ())
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            sized(Sizing::GroundMPerMm(bad)),
            Err(PlaceError::GroundScale(_))
        ));
        assert!(matches!(
            sized(Sizing::CellMm(bad)),
            Err(PlaceError::Scale(_))
        ));
    }
    let tall = PlacementOptions {
        heights: Heights::MmPerUnit(50.0),
        ..PlacementOptions::default()
    };
    assert!(matches!(
        placed(utm, &tall),
        Err(PlaceError::TooTall { .. })
    ));
    for times in [0.0, f64::NAN] {
        let flat = PlacementOptions {
            heights: Heights::Exaggerated(times),
            ..PlacementOptions::default()
        };
        assert!(matches!(
            placed(utm, &flat),
            Err(PlaceError::Exaggeration(_))
        ));
    }
}

#[test]
fn rounded_numbers_have_three_digits() {
    for (x, up, down) in [
        (0.123_45, 0.124, 0.123),
        (300.0, 300.0, 300.0),
        (9.999, 10.0, 9.99),
        (1234.0, 1240.0, 1230.0),
        (0.3, 0.3, 0.3),
    ] {
        assert_eq!((rounded_up(x), rounded_down(x)), (up, down), "{x}");
    }
}

#[test]
fn unaddressable_home_position_is_refused() {
    let raster = hills();
    let grid = Target::Whole
        .grid(&raster, HapticCells::default())
        .expect("a grid");
    let reach = Reach::of(&Calibration::PREMIUM_1_5);
    let view = Placement::new(&grid, &reach, &PlacementOptions::default()).expect("a view");
    let terrain = view.terrain(grid).expect("a terrain");
    let far = Placement {
        home_mm: [1e15, 0.0, 0.0],
        ..view
    };
    let scene = |view: &Placement| view.scene(&terrain, SurfaceParams::PREMIUM);
    assert!(scene(&view).is_ok());
    assert_eq!(scene(&far), Err(PlaceError::FarAway(far.home_mm)));
}

#[test]
fn place_in_another_reference_system_is_the_same_place() {
    let grids = made();
    let (degrees, utm, bare) = (&grids[0].1, &grids[2].1, &grids[6].1);
    let ground = |raster: &Raster, place, coordinates| {
        let view = placed(raster, &at(place, coordinates, Sizing::Fit));
        view.map(|(_, view)| view.home_ground)
    };
    let near = |found: [f64; 2], place: [f64; 2], within: f64| {
        (0..2).all(|axis| (found[axis] - place[axis]).abs() < within)
    };
    // NAD83 and WGS 84 are treated as the same.
    let place = [386_200.0, 3_790_100.0];
    for code in [26911, 32611] {
        let found = ground(utm, place, Coordinates::Epsg(code)).expect("there");
        assert!(near(found, place, 1e-2), "EPSG:{code}: {found:?}");
    }
    let lonlat = [10.02_f64, 60.015_f64];
    let radius_m = 6_378_137.0;
    let half = 0.5 * lonlat[1].to_radians();
    let web = [
        radius_m * lonlat[0].to_radians(),
        radius_m * (std::f64::consts::FRAC_PI_4 + half).tan().ln(),
    ];
    let found = ground(degrees, web, Coordinates::Epsg(3857)).expect("there");
    assert!(near(found, lonlat, 1e-7), "{found:?}");
    let sides = [386_100.0, 3_790_050.0, 386_300.0, 3_790_200.0];
    let extent_mm = |coordinates| {
        let (_, view) = placed(utm, &boxed(sides, coordinates)).expect("there");
        view.extent_mm
    };
    let (own, other) = (extent_mm(OWN), extent_mm(Coordinates::Epsg(32611)));
    for side in 0..4 {
        assert!((own[side] - other[side]).abs() < 1e-2, "{own:?} {other:?}");
    }
    let error = |raster, place, code| {
        let found = ground(raster, place, Coordinates::Epsg(code));
        found.expect_err("no such place").to_string()
    };
    let why = error(utm, place, 1);
    assert!(why.contains("EPSG:1 is not supported"), "{why}");
    let why = error(bare, place, 32611);
    assert!(why.contains("states no reference system"), "{why}");
    let why = error(utm, [9e9, 9e9], 32612);
    assert!(
        why.contains("no place of") || why.contains("outside"),
        "{why}"
    );
}

#[test]
fn unread_heights_are_reported_as_unread_not_no_data() {
    let folder = tempfile::tempdir().expect("a folder");
    let raster = in_file(folder.path(), [600, 600], |x, y| (x + y) as f32);
    let grid = HapticGrid::new(&raster, HapticCells::Stored).with_wait(Wait::Never);
    for (target, words) in [
        // Each case reads a block that no earlier case has read.
        (Target::At([30.0, 20.0], OWN), "column 30, row 20"),
        (Target::Whole, "the middle of the terrain"),
        (
            Target::Box([500.0, 9.0, 590.0, 99.0], OWN),
            "the box 500,9,590,99",
        ),
    ] {
        let options = PlacementOptions {
            target,
            sizing: Sizing::CellMm(1.0),
            ..PlacementOptions::default()
        };
        let reach = Reach::of(&Calibration::PREMIUM_1_5);
        let fault = Placement::new(&grid, &reach, &options).expect_err("not read");
        let PlaceError::Unread { place } = &fault else {
            panic!("{fault}");
        };
        assert!(place.starts_with(words), "{place}");
    }
}
