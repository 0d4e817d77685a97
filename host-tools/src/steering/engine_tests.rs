//! Tests of the engine with devices that misbehave or restart.

#[path = "engine/automatic_level_tests.rs"]
mod automatic_level;

use super::*;
use crate::link::hello;
use crate::place::{Placement, PlacementOptions, Reach, Sizing};
use hapterra_core::force::SurfaceParams;
use hapterra_core::phantom::Calibration;
use hapterra_core::terrain::TileIndex;
use heightfield::Raster;

const ZOOM: Steer = Steer::Change(PlacementChange::Zoom(2.0));

/// Runs `test` on an engine over a plane, at 1 mm a cell.
fn with<T>(test: impl FnOnce(&mut Steering<'_>) -> T) -> T {
    with_raster(
        &Raster::from_fn(65, 65, |x, _| x as f32).expect("raster"),
        test,
    )
}

fn with_raster<T>(raster: &Raster, test: impl FnOnce(&mut Steering<'_>) -> T) -> T {
    let options = PlacementOptions {
        sizing: Sizing::CellMm(1.0),
        ..PlacementOptions::default()
    };
    let grid = options.target.grid(raster, Default::default());
    let grid = grid.expect("a grid");
    let reach = Reach::of(&Calibration::PREMIUM_1_5);
    let view = Placement::new(&grid, &reach, &options).expect("a view");
    let terrain = view.terrain(grid).expect("a terrain");
    let params = SurfaceParams::PREMIUM;
    let bounds = Bounds {
        first: PlacedSurface { view, params },
        resolution_mm: reach.resolution_mm(),
        level: None,
        tip_mm: 0.0,
        coarser: 0,
    };
    test(&mut Steering::new(bounds, terrain.clone()))
}

fn samples(steering: &mut Steering<'_>, limits: Limits, count: usize) {
    let sample = TickRecord {
        limits,
        view: steering.number,
        ..TickRecord::default()
    };
    (0..count).for_each(|_| steering.on_event(&Event::Sample(&sample)));
}

/// Returns the last request to the clutch.
fn requested_hold(steering: &mut Steering<'_>) -> Option<ClutchMode> {
    steering
        .requests()
        .into_iter()
        .rev()
        .find_map(|request| match request {
            HostRequest::Request(Request::Clutch { hold }) => Some(hold),
            _ => None,
        })
}

fn answer(steering: &mut Steering<'_>, hold: ClutchMode) {
    let request = Request::Clutch { hold };
    let (request, result) = (&request, Ok(()));
    steering.on_event(&Event::Answered { request, result });
}

/// Requests a zoom, for which the clutch starts to open.
fn open(steering: &mut Steering<'_>) {
    steering.steer(ZOOM);
    samples(steering, Limits::empty(), 1);
    assert_eq!(requested_hold(steering), Some(ClutchMode::InPlace));
    // The board's input holds it open before the answer: the host's hold has not arrived.
    samples(steering, Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT, 3);
    assert!(steering.take_update().is_none());
    answer(steering, ClutchMode::InPlace);
    samples(steering, Limits::CLUTCH_MOVES, 3);
    assert!(steering.take_update().is_none(), "the clutch still opens");
}

/// Opens the clutch, and returns the change that is sent.
fn update(steering: &mut Steering<'_>) -> SceneChange {
    open(steering);
    samples(steering, Limits::CLUTCH_OPEN, 1);
    steering.take_update().expect("a view").view
}

fn report_result(steering: &mut Steering<'_>, view: &SceneChange, accepted: bool) {
    steering.on_event(&Event::SceneChangeResult { view, accepted });
}

#[test]
fn accepted_placement_is_applied_and_releases_the_clutch() {
    with(|steering| {
        let view = update(steering);
        assert_eq!((view.number, steering.now().view.scale.cell_mm()), (1, 1.0));
        report_result(steering, &view, true);
        assert_eq!(steering.now().view.scale.cell_mm(), 2.0);
        samples(steering, Limits::CLUTCH_OPEN, 1);
        assert_eq!(requested_hold(steering), Some(ClutchMode::Released));
        assert!(!steering.is_settled());
        samples(steering, Limits::CLUTCH_MOVES, 1);
        assert!(steering.is_settled());
    });
}

#[test]
fn refused_placement_changes_nothing_and_is_reported() {
    with(|steering| {
        let view = update(steering);
        report_result(steering, &view, false);
        assert_eq!(steering.now().view.scale.cell_mm(), 1.0);
        assert_eq!(steering.lines().len(), 1);
        samples(steering, Limits::CLUTCH_OPEN, 1);
        assert_eq!(requested_hold(steering), Some(ClutchMode::Released));
        // The next one has the same number, because the first was refused.
        samples(steering, Limits::empty(), 1);
        assert_eq!(update(steering).number, 1);
    });
}

#[test]
fn unopened_clutch_or_silent_device_times_out() {
    for answers in [true, false] {
        with(|steering| {
            steering.steer(ZOOM);
            samples(steering, Limits::empty(), 1);
            let hold = requested_hold(steering).expect("asked");
            if answers {
                answer(steering, hold);
                samples(
                    steering,
                    Limits::CLUTCH_MOVES,
                    MAX_SAMPLES_TO_OPEN as usize + 1,
                );
            } else {
                let request = HostRequest::Request(Request::Clutch { hold });
                steering.on_event(&Event::Unanswered(&request));
            }
            let reported = steering.lines();
            assert!(
                reported.len() == 1 && reported[0].contains("no further change is made"),
                "{reported:?}"
            );
            assert_eq!(requested_hold(steering), Some(ClutchMode::Released));
            samples(steering, Limits::empty(), 2);
            assert!(steering.is_settled() && steering.take_update().is_none());
        });
    }
}

/// The ground height is unknown until the proxy has landed.
#[test]
fn placement_waits_for_the_tile_under_the_proxy() {
    with(|steering| {
        open(steering);
        let waits = TickRecord {
            limits: Limits::CLUTCH_OPEN,
            missing_tile: Some(TileIndex::new(0, 0)),
            ..TickRecord::default()
        };
        for _ in 0..3 {
            steering.on_event(&Event::Sample(&waits));
            assert!(steering.take_update().is_none());
        }
        samples(steering, Limits::CLUTCH_OPEN, 1);
        assert!(steering.take_update().is_some());
    });
}

/// A restarted device starts with the current placement, as number 0.
#[test]
fn restarted_device_counts_placements_from_zero() {
    for (resumed, number) in [(false, 1), (true, 2)] {
        with(|steering| {
            let view = update(steering);
            report_result(steering, &view, true);
            let device = hello();
            let device = &device;
            steering.on_event(&Event::Opened { device, resumed });
            assert_eq!(update(steering).number, number, "resumed: {resumed}");
            assert_eq!(steering.now().view.scale.cell_mm(), 2.0);
        });
    }
}

/// The board's switch still holds the clutch; the host has released it.
#[test]
fn host_releases_a_clutch_held_by_the_board_input() {
    with(|steering| {
        let view = update(steering);
        report_result(steering, &view, true);
        let held = Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT;
        samples(steering, held, 1);
        assert_eq!(requested_hold(steering), Some(ClutchMode::Released));
        samples(steering, held, 1);
        assert!(steering.is_settled());
    });
}

/// Returns a raster of ten degrees from south to north, in cells of 0.05°.
fn degrees() -> Raster {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("degrees.asc");
    let mut text = "ncols 41\nnrows 201\nxllcenter 10\nyllcenter 50\ncellsize 0.05\n".to_owned();
    text += &("7 ".repeat(41) + "\n").repeat(201);
    std::fs::write(&path, text).expect("written");
    let system = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]"#;
    std::fs::write(path.with_extension("prj"), system).expect("written");
    Raster::open(path, &Default::default()).expect("opens")
}

/// Returns a sample with the hand `north_mm` north of the middle, by its own motion or with the
/// clutch; no change was requested.
fn sample_at(steering: &Steering<'_>, north_mm: f64, limits: Limits) -> TickRecord {
    let cell_mm = steering.terrain.scale().cell_mm();
    let middle = steering.terrain.grid().of_ground([11.0, 55.0]);
    let [east, north] = middle.map(|cells| cells * cell_mm);
    let hip = [east, north + north_mm, 50.0];
    TickRecord {
        limits,
        view: steering.number,
        hip: steering.terrain.scale().to_grid(hip).expect("on the grid"),
        ..TickRecord::default()
    }
}

#[test]
fn far_clutch_motion_measures_cells_again() {
    let raster = degrees();
    let held = Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT;
    for (north_mm, by_input) in [(80.0, false), (80.0, true), (0.1, false), (0.1, true)] {
        with_raster(&raster, |steering| {
            let metres = |steering: &Steering<'_>| steering.now().view.ground_m_per_mm();
            let before = metres(steering).expect("known");
            let limits = if by_input { held } else { Limits::empty() };
            if !by_input {
                steering.steer(Steer::Clutch(true));
            }
            let sample = sample_at(steering, north_mm, limits);
            steering.on_event(&Event::Sample(&sample));
            let requested_hold = requested_hold(steering);
            let expected = match by_input {
                true => (north_mm > 1.0).then_some(ClutchMode::InPlace),
                false => Some(ClutchMode::WithHand),
            };
            assert_eq!(requested_hold, expected);
            if let Some(hold) = requested_hold {
                answer(steering, hold);
            }
            let open = sample_at(steering, north_mm, limits | Limits::CLUTCH_OPEN);
            steering.on_event(&Event::Sample(&open));
            let update = steering.take_update();
            assert_eq!(update.is_some(), north_mm > 1.0);
            let Some(update) = update else {
                return;
            };
            let [_, latitude] = update.terrain.grid().measured_at().expect("a place");
            assert!((57.0..58.0).contains(&latitude), "{latitude}");
            assert!(!update.view.keeps_tiles);
            report_result(steering, &update.view, true);
            assert!((metres(steering).expect("known") / before - 1.0).abs() < 1e-12);
            // The cells are measured once; the clutch is released when the user releases it.
            let open = TickRecord {
                view: 1,
                hip: update.view.hip,
                ..open
            };
            steering.on_event(&Event::Sample(&open));
            assert!(steering.take_update().is_none());
            let is_at_rest = match by_input {
                true => self::requested_hold(steering) == Some(ClutchMode::Released),
                false => steering.is_settled(),
            };
            assert!(is_at_rest);
        });
    }
}

/// Returns a sample of a hand that presses on the middle of the plane, 2 mm deep.
fn pressing(steering: &Steering<'_>, limits: Limits) -> TickRecord {
    let scale = steering.terrain.scale();
    let mm = 32.0 * scale.cell_mm();
    let [proxy, hip] = [0.0, -2.0].map(|dz| {
        let ground = scale.height_mm_per_unit() * 32.0;
        scale.to_grid([mm, mm, ground + dz]).expect("on the grid")
    });
    TickRecord {
        limits,
        view: steering.number,
        mode: Mode::Armed,
        state: ContactState::Touching,
        hip,
        proxy,
        ..TickRecord::default()
    }
}

fn press(steering: &mut Steering<'_>, limits: Limits, count: usize) {
    let sample = pressing(steering, limits);
    (0..count).for_each(|_| steering.on_event(&Event::Sample(&sample)));
}

/// Zooms under a pressing hand, and returns the change that is sent.
fn zoom_in_contact(steering: &mut Steering<'_>) -> SceneChange {
    steering.steer(ZOOM);
    press(steering, Limits::empty(), 1);
    assert_eq!(requested_hold(steering), None);
    let view = steering.take_update().expect("a view").view;
    assert!(view.in_contact.is_some());
    view
}

#[test]
fn change_under_a_pressing_hand_needs_no_clutch() {
    with(|steering| {
        let view = zoom_in_contact(steering);
        let map = view.in_contact.expect("a map");
        let [from, to] = [map.from, map.to].map(|at| at.relative_to([0; 3]));
        assert!(
            (to - from).length() < 1e-3 && (map.scale - 1.0).length() < 1e-6,
            "{map:?}"
        );
        report_result(steering, &view, true);
        // The device still renders the placement before, until the coarse tiles have arrived.
        let before = TickRecord {
            view: 0,
            ..pressing(steering, Limits::empty())
        };
        (0..20).for_each(|_| steering.on_event(&Event::Sample(&before)));
        assert!(!steering.is_settled());
        press(steering, Limits::CLUTCH_MOVES, 3);
        assert!(steering.is_settled());
        // The next change waits until the force has turned.
        steering.steer(ZOOM);
        press(steering, Limits::CLUTCH_MOVES, 3);
        assert!(steering.take_update().is_none());
        press(steering, Limits::empty(), 1);
        assert_eq!(steering.take_update().expect("a view").view.number, 2);
        assert_eq!(requested_hold(steering), None);
    });
}

#[test]
fn refused_change_under_a_pressing_hand_opens_the_clutch() {
    with(|steering| {
        let view = zoom_in_contact(steering);
        report_result(steering, &view, false);
        assert_eq!(requested_hold(steering), Some(ClutchMode::InPlace));
        answer(steering, ClutchMode::InPlace);
        press(steering, Limits::CLUTCH_OPEN, 1);
        let view = steering.take_update().expect("a view").view;
        assert_eq!((view.number, view.in_contact), (1, None));
    });
}

/// The hand lifts off while the device waits for the terrain, or the terrain does not arrive.
#[test]
fn impossible_change_under_a_pressing_hand_opens_no_clutch() {
    with(|steering| {
        steering.steer(Steer::Change(PlacementChange::Stiffness(50.0)));
        press(steering, Limits::empty(), 1);
        assert_eq!(requested_hold(steering), None);
        assert!(steering.take_update().is_none() && steering.is_settled());
        let lines = steering.lines();
        assert!(lines.len() == 1 && lines[0].contains("N/mm"), "{lines:?}");
    });
}

#[test]
fn change_that_is_not_made_in_contact_opens_the_clutch() {
    for lifts in [true, false] {
        with(|steering| {
            let view = zoom_in_contact(steering);
            report_result(steering, &view, true);
            let waits = TickRecord {
                view: 0,
                state: match lifts {
                    true => ContactState::Free,
                    false => ContactState::Touching,
                },
                ..pressing(steering, Limits::empty())
            };
            let count = 1 + if lifts { 0 } else { MAX_SAMPLES_IN_CONTACT };
            (0..count).for_each(|_| steering.on_event(&Event::Sample(&waits)));
            assert_eq!(requested_hold(steering), Some(ClutchMode::InPlace));
        });
    }
}

#[test]
fn change_waits_for_the_tile_under_the_pressing_hand() {
    with(|steering| {
        steering.steer(ZOOM);
        press(steering, Limits::TERRAIN_COARSE, 20);
        assert!(steering.take_update().is_none() && requested_hold(steering).is_none());
        press(steering, Limits::empty(), 1);
        assert!(steering.take_update().is_some());
    });
    with(|steering| {
        steering.steer(ZOOM);
        press(
            steering,
            Limits::TERRAIN_COARSE,
            MAX_SAMPLES_WITHOUT_GROUND as usize,
        );
        assert_eq!(requested_hold(steering), None);
        press(steering, Limits::TERRAIN_COARSE, 1);
        assert_eq!(requested_hold(steering), Some(ClutchMode::InPlace));
    });
    // A force that does not turn, because the tile in the current placement is late.
    with(|steering| {
        steering.steer(ZOOM);
        press(steering, Limits::CLUTCH_MOVES, MAX_SAMPLES_TURNING as usize);
        assert_eq!(requested_hold(steering), None);
        press(steering, Limits::CLUTCH_MOVES, 1);
        assert_eq!(requested_hold(steering), Some(ClutchMode::InPlace));
    });
}

/// The device has not answered a change before the link was lost. Its session's end released the
/// clutch, and a request for it is no longer known to the engine.
#[test]
fn lost_link_leaves_no_request_for_the_clutch() {
    with(|steering| {
        let view = zoom_in_contact(steering);
        report_result(steering, &view, false);
        let device = &hello();
        let resumed = true;
        steering.on_event(&Event::Opened { device, resumed });
        assert_eq!(requested_hold(steering), None);
        press(steering, Limits::empty(), 1);
        assert!(steering.take_update().is_some(), "the change still waits");
    });
}

/// The board's switch is held again while a change waits; after it the cells are measured.
#[test]
fn second_hold_of_the_board_input_is_measured() {
    let raster = degrees();
    let held = Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT;
    with_raster(&raster, |steering| {
        let near = sample_at(steering, 0.1, held);
        steering.on_event(&Event::Sample(&near));
        assert!(requested_hold(steering).is_none());
        steering.stage = Stage::InContact { samples: 0 };
        let waits = TickRecord {
            view: 9,
            mode: Mode::Armed,
            state: ContactState::Touching,
            ..sample_at(steering, 0.1, Limits::empty())
        };
        steering.on_event(&Event::Sample(&waits));
        let far = sample_at(steering, 80.0, held);
        steering.on_event(&Event::Sample(&far));
        assert_eq!(requested_hold(steering), Some(ClutchMode::InPlace));
    });
}
