//! The engine against devices that do what no good one does, or that are restarted.

use super::*;
use crate::link::hello;
use crate::place::{Reach, Sizing, View as PlacedView, ViewOptions};
use crate::raster::Raster;
use hapterra_core::force::ForceLaw;
use hapterra_core::phantom::Calibration;
use hapterra_core::terrain::TileIndex;

const ZOOM: Steer = Steer::Change(ViewChange::Zoom(2.0));

/// An engine over a plane, at 1 mm a cell.
fn with<T>(look: impl FnOnce(&mut Steering<'_>) -> T) -> T {
    let raster = Raster::from_fn(65, 65, |x, _| x as f32).expect("raster");
    let options = ViewOptions {
        sizing: Sizing::CellMm(1.0),
        ..ViewOptions::default()
    };
    let grid = options.target.grid(&raster, Default::default());
    let grid = grid.expect("a grid");
    let reach = Reach::of(&Calibration::PREMIUM_1_5);
    let view = PlacedView::new(&grid, &reach, &options).expect("a view");
    let terrain = view.terrain(grid).expect("a terrain");
    let law = ForceLaw::PREMIUM;
    let bounds = Bounds {
        first: Laid { view, law },
        resolution_mm: reach.resolution_mm(),
        level: None,
    };
    look(&mut Steering::new(bounds, Rule::Swept, terrain.clone()))
}

fn samples(steering: &mut Steering<'_>, limits: Limits, count: usize) {
    let sample = Sample {
        limits,
        view: steering.number,
        ..Sample::default()
    };
    (0..count).for_each(|_| steering.on_event(&Event::Sample(&sample)));
}

/// What was asked of the clutch last.
fn asked(steering: &mut Steering<'_>) -> Option<ClutchHold> {
    steering.asks().into_iter().rev().find_map(|ask| match ask {
        Ask::Request(Request::Clutch { hold }) => Some(hold),
        _ => None,
    })
}

fn answer(steering: &mut Steering<'_>, hold: ClutchHold) {
    let request = Request::Clutch { hold };
    let (request, result) = (&request, Ok(()));
    steering.on_event(&Event::Answered { request, result });
}

/// Wants a zoom, and has the clutch opened for it.
fn open(steering: &mut Steering<'_>) {
    steering.steer(ZOOM);
    samples(steering, Limits::empty(), 1);
    assert_eq!(asked(steering), Some(ClutchHold::InPlace));
    // Open by the board's input, before the answer: the host's hold is not there yet.
    samples(steering, Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT, 3);
    assert!(steering.take_put().is_none());
    answer(steering, ClutchHold::InPlace);
    samples(steering, Limits::CLUTCH_MOVES, 3);
    assert!(steering.take_put().is_none(), "the clutch still opens");
}

/// Opens the clutch, and takes the view that is put in.
fn put(steering: &mut Steering<'_>) -> View {
    open(steering);
    samples(steering, Limits::CLUTCH_OPEN, 1);
    steering.take_put().expect("a view").view
}

fn viewed(steering: &mut Steering<'_>, view: &View, taken: bool) {
    steering.on_event(&Event::Viewed { view, taken });
}

#[test]
fn a_view_that_is_taken_is_in_force_and_the_clutch_is_let_go() {
    with(|steering| {
        let view = put(steering);
        assert_eq!((view.number, steering.now().view.scale.cell_mm()), (1, 1.0));
        viewed(steering, &view, true);
        assert_eq!(steering.now().view.scale.cell_mm(), 2.0);
        samples(steering, Limits::CLUTCH_OPEN, 1);
        assert_eq!(asked(steering), Some(ClutchHold::LetGo));
        assert!(!steering.is_settled());
        samples(steering, Limits::CLUTCH_MOVES, 1);
        assert!(steering.is_settled());
    });
}

#[test]
fn a_view_that_is_not_taken_leaves_everything_as_it_was_and_is_told() {
    with(|steering| {
        let view = put(steering);
        viewed(steering, &view, false);
        assert_eq!(steering.now().view.scale.cell_mm(), 1.0);
        assert_eq!(steering.lines().len(), 1);
        samples(steering, Limits::CLUTCH_OPEN, 1);
        assert_eq!(asked(steering), Some(ClutchHold::LetGo));
        // The next one has the same number: the first was never there.
        samples(steering, Limits::empty(), 1);
        assert_eq!(put(steering).number, 1);
    });
}

#[test]
fn a_clutch_that_does_not_open_or_a_device_that_does_not_answer_is_given_up() {
    for answers in [true, false] {
        with(|steering| {
            steering.steer(ZOOM);
            samples(steering, Limits::empty(), 1);
            let hold = asked(steering).expect("asked");
            if answers {
                answer(steering, hold);
                samples(steering, Limits::CLUTCH_MOVES, SAMPLES_TO_OPEN as usize + 1);
            } else {
                let ask = Ask::Request(Request::Clutch { hold });
                steering.on_event(&Event::Unanswered(&ask));
            }
            let told = steering.lines();
            assert!(
                told.len() == 1 && told[0].contains("stays as it was"),
                "{told:?}"
            );
            assert_eq!(asked(steering), Some(ClutchHold::LetGo));
            samples(steering, Limits::empty(), 2);
            assert!(steering.is_settled() && steering.take_put().is_none());
        });
    }
}

/// A proxy that has yet to land says nothing of the ground under it.
#[test]
fn a_view_waits_for_the_tile_under_the_proxy() {
    with(|steering| {
        open(steering);
        let waits = Sample {
            limits: Limits::CLUTCH_OPEN,
            missing_tile: Some(TileIndex::new(0, 0)),
            ..Sample::default()
        };
        for _ in 0..3 {
            steering.on_event(&Event::Sample(&waits));
            assert!(steering.take_put().is_none());
        }
        samples(steering, Limits::CLUTCH_OPEN, 1);
        assert!(steering.take_put().is_some());
    });
}

/// It begins anew with the view that is in force, under the number 0.
#[test]
fn a_device_that_was_restarted_counts_views_anew_and_one_that_was_not_goes_on() {
    for (resumed, number) in [(false, 1), (true, 2)] {
        with(|steering| {
            let view = put(steering);
            viewed(steering, &view, true);
            let device = hello();
            let device = &device;
            steering.on_event(&Event::Opened { device, resumed });
            assert_eq!(put(steering).number, number, "resumed: {resumed}");
            assert_eq!(steering.now().view.scale.cell_mm(), 2.0);
        });
    }
}

/// The board's switch holds it on: the host has let go all the same.
#[test]
fn a_clutch_that_the_boards_input_holds_open_is_let_go_by_the_host() {
    with(|steering| {
        let view = put(steering);
        viewed(steering, &view, true);
        let held = Limits::CLUTCH_OPEN | Limits::CLUTCH_INPUT;
        samples(steering, held, 1);
        assert_eq!(asked(steering), Some(ClutchHold::LetGo));
        samples(steering, held, 1);
        assert!(steering.is_settled());
    });
}
