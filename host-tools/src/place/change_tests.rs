use super::*;
use crate::place::{Heights, PlacementOptions, Reach, Sizing, Target};
use crate::terrain::in_file::in_file;
use crate::timeouts::wait_until;
use hapterra_core::phantom::Calibration;
use heightfield::Raster;

/// Returns 2049 × 2049 samples, 10 m apart, that rise by 1 m each to the east.
fn raster() -> Raster {
    let raster = Raster::from_fn(2049, 2049, |x, _| x as f32).expect("raster");
    let mut cell = raster.cell().expect("metres");
    (cell.east, cell.north) = (10.0, 10.0);
    raster.with_cell(cell)
}

struct Bench {
    raster: Raster,
    level: Option<u8>,
}

impl Bench {
    fn new() -> Self {
        Self {
            raster: raster(),
            level: None,
        }
    }

    /// Calls `check` with the terrain at 0.05 mm a cell, and its bounds.
    fn with<T>(&self, check: impl FnOnce(&Terrain<'_>, Bounds) -> T) -> T {
        let options = PlacementOptions {
            target: Target::Whole,
            sizing: Sizing::CellMm(0.05),
            heights: Heights::default(),
            level: self.level,
        };
        let grid = options.target.grid(&self.raster, Default::default());
        let grid = grid.expect("a grid");
        let reach = Reach::of(&Calibration::PREMIUM_1_5);
        let view = Placement::new(&grid, &reach, &options).expect("a view");
        let terrain = view.terrain(grid).expect("a terrain");
        let bounds = Bounds {
            first: PlacedSurface {
                view,
                params: SurfaceParams::PREMIUM,
            },
            resolution_mm: reach.resolution_mm(),
            level: self.level,
            tip_mm: 0.0,
            coarser: 0,
        };
        check(&terrain, bounds)
    }
}

/// Returns a hand with the HIP 2 mm under the ground of the middle, and a proxy beside it.
fn pressing(terrain: &Terrain<'_>) -> Hand {
    let ground = terrain.height_mm(51.0, 51.2).expect("ground");
    Hand {
        hip_mm: [51.2, 51.2, ground - 2.0],
        proxy_mm: Some([51.0, 51.2, ground]),
    }
}

#[test]
fn zoom_keeps_ground_under_proxy_and_hip_depth() {
    Bench::new().with(|terrain, bounds| {
        let hand = pressing(terrain);
        let before = bounds.first;
        let zoom = [PlacementChange::Zoom(8.0)];
        let changed = bounds
            .apply(terrain, &before, &zoom, (&hand, Measure::Again))
            .expect("zoomed");
        let view = changed.placed_surface.view;
        assert!((view.scale.cell_mm() - 0.4).abs() < 1e-12);
        assert_eq!(view.exaggeration, before.view.exaggeration);
        // The proxy's ground, now eight times as far from the first sample.
        let ground = changed.terrain.height_mm(408.0, 409.6).expect("ground");
        let [x, y, z] = changed.hip_mm;
        assert!(
            (x - 408.2).abs() < 1e-9 && (y - 409.6).abs() < 1e-9,
            "{x} {y}"
        );
        assert!((ground - z - 2.0).abs() < 1e-9, "{}", ground - z);
        // The arm has not moved: home and HIP move together.
        for axis in 0..3 {
            let then = before.view.home_mm[axis] - hand.hip_mm[axis];
            let now = view.home_mm[axis] - changed.hip_mm[axis];
            assert!((then - now).abs() < 1e-9);
        }
        // The part in front of the arm has grown by the same factor.
        for (now, then) in view.extent_mm.iter().zip(before.view.extent_mm) {
            assert!((now - 8.0 * then).abs() < 1e-9, "{now} {then}");
        }
        for (now, then) in view.heights_mm.iter().zip(before.view.heights_mm) {
            assert!((now - 8.0 * then).abs() < 1e-9, "{now} {then}");
        }
        // The place under the home position, in the file's coordinates.
        let columns = view.home_mm[0] / 0.4;
        assert!((view.home_ground[0] - terrain.grid().to_ground([columns, 0.0])[0]).abs() < 1e-6);
    });
}

#[test]
fn level_follows_the_scale_unless_it_is_stated() {
    for (fixed_level, expected) in [(None, [0, 3, 0]), (Some(2), [2, 2, 2])] {
        let bench = Bench {
            level: fixed_level,
            ..Bench::new()
        };
        bench.with(|terrain, bounds| {
            let hand = pressing(terrain);
            let level = |factor: f64| {
                let zoom = [PlacementChange::Zoom(factor)];
                let changed = bounds.apply(terrain, &bounds.first, &zoom, (&hand, Measure::Again));
                changed.expect("zoomed").placed_surface.view.level
            };
            // One count is 0.029 mm.
            assert_eq!([level(1.0), level(0.1), level(10.0)], expected);
        });
    }
}

#[test]
fn pan_keeps_hip_depth_and_is_refused_outside_terrain() {
    Bench::new().with(|terrain, bounds| {
        let hand = pressing(terrain);
        let pan = |change| bounds.apply(terrain, &bounds.first, &[change], (&hand, Measure::Again));
        let panned = pan(PlacementChange::Pan {
            east_mm: 5.0,
            north_mm: -1.0,
        });
        let panned = panned.expect("panned");
        let ground = terrain.height_mm(56.0, 50.2).expect("ground");
        let expected = [56.2, 50.2, ground - 2.0];
        for (now, expected) in panned.hip_mm.iter().zip(expected) {
            assert!((now - expected).abs() < 1e-9);
        }
        assert!(panned.terrain.has_tiles_of(terrain));
        // 1000 m are 100 cells of 0.05 mm.
        let far = pan(PlacementChange::PanGround {
            east_m: 1000.0,
            north_m: -200.0,
        });
        assert!((far.expect("panned").hip_mm[0] - expected[0]).abs() < 1e-9);
        let outside = pan(PlacementChange::Pan {
            east_mm: 60.0,
            north_mm: 0.0,
        });
        assert_eq!(outside.err(), Some(ChangeError::Outside));
    });
}

#[test]
fn exaggeration_and_stiffness_changes_are_undone_by_reset() {
    Bench::new().with(|terrain, bounds| {
        let hand = pressing(terrain);
        let steeper = [
            PlacementChange::Exaggerate(3.0),
            PlacementChange::Stiffness(0.5),
        ];
        let changed = bounds.apply(terrain, &bounds.first, &steeper, (&hand, Measure::Again));
        let changed = changed.expect("changed");
        let PlacedSurface { view, params } = changed.placed_surface;
        assert!((view.exaggeration.expect("known") - 3.0).abs() < 1e-9);
        assert_eq!(params.stiffness_n_per_mm, 0.25);
        assert!(!changed.terrain.has_tiles_of(terrain));
        let there = Hand {
            hip_mm: changed.hip_mm,
            proxy_mm: None,
        };
        let back = [PlacementChange::Reset];
        let back = bounds.apply(
            &changed.terrain,
            &changed.placed_surface,
            &back,
            (&there, Measure::Again),
        );
        let back = back.expect("back").placed_surface;
        assert_eq!(
            (back.view.scale, back.params),
            (bounds.first.view.scale, bounds.first.params)
        );
        assert_eq!(back.view.exaggeration, bounds.first.view.exaggeration);
    });
}

#[test]
fn refused_placement_change_names_the_bound() {
    Bench::new().with(|terrain, bounds| {
        let hand = pressing(terrain);
        for (change, expected) in [
            (PlacementChange::Zoom(2000.0), "no more detail"),
            (PlacementChange::Zoom(1e-3), "mm wide"),
            (PlacementChange::Zoom(-1.0), "not a valid factor"),
            (PlacementChange::Zoom(f64::NAN), "not a valid factor"),
            (PlacementChange::Exaggerate(0.0), "not a valid factor"),
            (PlacementChange::Exaggerate(1e12), "can be rendered"),
            (PlacementChange::Stiffness(3.0), "1 N/mm"),
            (PlacementChange::Stiffness(1e-4), "0.005"),
        ] {
            let refused = bounds.apply(terrain, &bounds.first, &[change], (&hand, Measure::Again));
            let message = refused.err().expect("refused").to_string();
            assert!(message.contains(expected), "{change:?}: {message}");
        }
    });
    // A terrain that is already too large may be made smaller.
    let bench = Bench::new();
    bench.with(|terrain, bounds| {
        let hand = pressing(terrain);
        let mut first = bounds.first;
        first.view = first.view.scaled(80.0, 8.0).expect("a scale");
        let smaller = [PlacementChange::Zoom(0.9)];
        assert!(
            bounds
                .apply(terrain, &first, &smaller, (&hand, Measure::Again))
                .is_ok()
        );
    });
}

#[test]
fn zoom_in_air_keeps_height_above_surface() {
    Bench::new().with(|terrain, bounds| {
        let ground = terrain.height_mm(51.2, 51.2).expect("ground");
        let hand = Hand {
            hip_mm: [51.2, 51.2, ground + 7.0],
            proxy_mm: None,
        };
        let zoom = [PlacementChange::Zoom(4.0)];
        let changed = bounds.apply(terrain, &bounds.first, &zoom, (&hand, Measure::Again));
        let changed = changed.expect("zoomed");
        let [x, y, z] = changed.hip_mm;
        let ground = changed.terrain.height_mm(x, y).expect("ground");
        assert!((z - ground - 7.0).abs() < 1e-9, "{}", z - ground);
    });
}

#[test]
fn pending_ground_is_not_reported_as_available() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = Bench {
        raster: in_file(folder.path(), [2049, 600], |x, y| (x + y) as f32),
        // Its samples and those of the finest level lie in different blocks.
        level: Some(3),
    };
    bench.with(|terrain, bounds| {
        let terrain = terrain.non_blocking();
        let hand = Hand {
            hip_mm: [1.0, 1.0, 50.0],
            proxy_mm: None,
        };
        let zoom = [PlacementChange::Zoom(2.0)];
        let changed = || {
            let changed = bounds.apply(&terrain, &bounds.first, &zoom, (&hand, Measure::Again));
            changed.expect("zoomed")
        };
        let first = changed();
        assert!(!first.ground_is_known);
        assert_eq!(first.hip_mm[2], 50.0, "the height of before");
        wait_until("the ground", || changed().ground_is_known);
        // Twice the height of a terrain that rises by 1 unit for each cell.
        assert!(changed().hip_mm[2] > 50.0);
    });
}
