//! Conversions to coordinates and back, in every kind of coordinates.

use super::*;

fn metres(side: f64) -> CellSize {
    CellSize::stated((side, side), CellUnit::Length { metres: 1.0 }, None)
}

fn degrees(side: f64) -> CellSize {
    CellSize::stated((side, side), CellUnit::Degree, Some(60.0))
}

fn transform(origin: [f64; 2], column: [f64; 2], row: [f64; 2]) -> Option<GroundTransform> {
    GroundTransform::new(origin, column, row)
}

fn reference(epsg: Option<u16>) -> Option<ReferenceSystem> {
    epsg.map(|code| ReferenceSystem::from_code(code).expect("known"))
}

#[test]
fn transform_round_trips_when_rotated_or_skewed() {
    for (column, row) in [
        ([10.0, 0.0], [0.0, 10.0]),
        ([8.0, 6.0], [-6.0, 8.0]),
        ([10.0, 1.0], [3.0, 12.0]),
        ([1e-4, 0.0], [0.0, -2e-4]),
    ] {
        let map = transform([386_000.0, 3_790_000.0], column, row).expect("a plane");
        for sample in [[0.0, 0.0], [17.25, 3.5], [-4.0, 900.0]] {
            let back = map.to_samples(map.to_ground(sample));
            for axis in 0..2 {
                assert!(
                    (back[axis] - sample[axis]).abs() < 1e-4,
                    "{back:?} {sample:?}"
                );
            }
        }
        let turned = map.with_columns_from(9.0).with_rows_from(4.0);
        assert_eq!(turned.to_ground([9.0, 4.0]), map.to_ground([0.0, 0.0]));
    }
    assert_eq!(transform([0.0; 2], [1.0, 1.0], [2.0, 2.0]), None, "a line");
    assert_eq!(transform([0.0; 2], [0.0, 0.0], [0.0, 1.0]), None, "a line");
    assert_eq!(transform([f64::NAN; 2], [1.0, 0.0], [0.0, 1.0]), None);
}

#[test]
fn lonlat_round_trips_in_every_reference_system() {
    for (epsg, origin, step, cell) in [
        (Some(26911), [386_000.0, 3_790_000.0], 10.0, metres(10.0)),
        (Some(3857), [1_000_000.0, 8_399_000.0], 10.0, metres(10.0)),
        (Some(4326), [10.0, 60.0], 0.001, degrees(0.001)),
        (None, [10.0, 60.0], 0.001, degrees(0.001)),
        (Some(4269), [350.0, 40.0], 0.001, degrees(0.001)),
    ] {
        let map = transform(origin, [step, 0.0], [0.0, step]);
        let reference = reference(epsg);
        let place = Georeference::new(map, reference.as_ref(), Some(cell), [100.0, 100.0]);
        let ground = place.transform().to_ground([12.5, 60.25]);
        let lonlat = place.to_lonlat(ground).expect("on the globe");
        assert!(lonlat[0].abs() <= 180.0 && lonlat[1].abs() <= 90.0);
        let back = place.of_lonlat(lonlat).expect("on the map");
        for axis in 0..2 {
            let off = (back[axis] - ground[axis]).abs() / step;
            assert!(off < 1e-4, "{epsg:?}: {back:?} for {ground:?}");
        }
        for nowhere in [[f64::NAN, 0.0], [0.0, 91.0], [400.0, 0.0]] {
            assert_eq!(place.of_lonlat(nowhere), None);
        }
    }
}

/// Against PROJ (`cs2cs EPSG:26911 EPSG:4326`), (longitude, latitude).
#[test]
fn lonlat_is_longitude_first_and_agrees_with_proj() {
    let map = transform([386_000.0, 3_790_000.0], [10.0, 0.0], [0.0, 10.0]);
    let utm = reference(Some(26911));
    let place = Georeference::new(map, utm.as_ref(), Some(metres(10.0)), [9.0, 9.0]);
    let [longitude, latitude] = place.to_lonlat([386_000.0, 3_790_000.0]).expect("there");
    assert!((longitude + 118.237_991).abs() < 1e-5, "{longitude}");
    assert!((latitude - 34.244_867).abs() < 1e-5, "{latitude}");
}

#[test]
fn unstated_reference_system_has_no_lonlat() {
    let map = transform([10.0, 60.0], [0.001, 0.0], [0.0, 0.001]);
    let guessed = CellSize {
        certainty: Certainty::Assumed,
        ..degrees(0.001)
    };
    for (map, cell, system) in [
        (map, Some(guessed), System::Unstated),
        (map, Some(metres(1.0)), System::Unstated),
        (None, None, System::Cells),
        (None, Some(metres(1.0)), System::Cells),
    ] {
        let place = Georeference::new(map, None, cell, [9.0, 9.0]);
        assert_eq!(place.system(), system);
        assert_eq!(place.of_lonlat([10.0, 60.0]), None);
        assert_eq!(place.to_lonlat([10.0, 60.0]), None);
    }
    let cells = Georeference::new(None, None, None, [9.0, 4.0]);
    assert_eq!(cells.bounds(), [0.0, 0.0, 9.0, 4.0]);
}

#[test]
fn longitude_is_found_in_the_turn_of_the_file() {
    let map = transform([170.0, -10.0], [0.1, 0.0], [0.0, 0.1]);
    let pacific = Georeference::new(map, None, Some(degrees(0.1)), [200.0, 100.0]);
    let [x, y] = pacific.of_lonlat([-175.0, -5.0]).expect("there");
    assert!((x - 185.0).abs() < 1e-9 && (y + 5.0).abs() < 1e-9);
    let [longitude, _] = pacific.to_lonlat([185.0, -5.0]).expect("there");
    assert!((longitude + 175.0).abs() < 1e-9);
}

#[test]
fn cell_size_is_that_of_its_position() {
    let map = transform([10.0, 59.0], [0.001, 0.0], [0.0, 0.001]);
    let globe = reference(Some(4326));
    let cell = Some(degrees(0.001));
    let place = Georeference::new(map, globe.as_ref(), cell, [100.0, 2000.0]);
    let side = |latitude: f64| place.cell_at([10.0, latitude]).expect("known").metres();
    assert!(side(59.0).0 > 1.05 * side(61.0).0);
    assert!((side(60.0).0 - 55.8).abs() < 0.1, "{:?}", side(60.0));
    let map = transform([0.0, 0.0], [10.0, 0.0], [0.0, 10.0]);
    let mercator = reference(Some(3857));
    let web = Georeference::new(map, mercator.as_ref(), Some(metres(10.0)), [9.0, 9.0]);
    let cell = web.cell_at([0.0, 8_399_737.9]).expect("known");
    let (east, north) = cell.ground_metres();
    assert!(
        (east - 5.008).abs() < 0.01 && (north - 5.0).abs() < 0.03,
        "{east} {north}"
    );
}
