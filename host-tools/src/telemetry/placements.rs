//! The placements of a session: each sample has the number of its own.

use hapterra_core::scene::TickRecord;

use crate::link::Event;
use crate::place::PlacedSurface;
use crate::terrain::Terrain;

/// A rendered placement.
pub struct SessionPlacement<'t> {
    /// Its terrain.
    pub terrain: Terrain<'t>,
    /// Place, scale and surface parameters; `None` for the first scene.
    pub placed_surface: Option<PlacedSurface>,
}

/// All placements of a session, in order.
pub struct Placements<'t> {
    views: Vec<SessionPlacement<'t>>,
    /// Index of the placement that has a number now. Numbers wrap around, and restart with the
    /// device.
    of_number: [usize; 256],
}

impl<'t> Placements<'t> {
    /// Begins with the first scene.
    #[must_use]
    pub fn new(terrain: Terrain<'t>) -> Self {
        let placed_surface = None;
        Self {
            views: vec![SessionPlacement {
                terrain,
                placed_surface,
            }],
            of_number: [0; 256],
        }
    }

    /// Adds a placement with a number: later samples may belong to it.
    pub fn add(&mut self, number: u8, terrain: Terrain<'t>, placed_surface: PlacedSurface) {
        if let Some(index) = self.of_number.get_mut(usize::from(number)) {
            *index = self.views.len();
        }
        let placed_surface = Some(placed_surface);
        self.views.push(SessionPlacement {
            terrain,
            placed_surface,
        });
    }

    /// Processes an event of the device.
    pub fn on_event(&mut self, event: &Event<'_>) {
        match event {
            // A placement that was not accepted, or was cancelled, has no samples.
            Event::SceneChangeResult {
                accepted: false, ..
            }
            | Event::ChangeCancelled
                if self.views.len() > 1 =>
            {
                self.views.pop();
            }
            // A restarted device begins with the latest placement as its scene.
            Event::Opened { resumed: false, .. } => self.of_number[0] = self.views.len() - 1,
            _ => {}
        }
    }

    /// Returns the number of placements.
    #[must_use]
    pub fn count(&self) -> usize {
        self.views.len()
    }

    /// Returns the index of a sample's placement, from 0.
    #[must_use]
    pub fn index_of(&self, sample: &TickRecord) -> usize {
        let index = self.of_number.get(usize::from(sample.view));
        index.copied().unwrap_or(0).min(self.views.len() - 1)
    }

    /// Returns a placement by its index; the last one if the index is too large.
    #[must_use]
    pub fn get(&self, index: usize) -> &SessionPlacement<'t> {
        &self.views[index.min(self.views.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::hello;
    use crate::place::{PlacementOptions, Reach};
    use hapterra_core::force::SurfaceParams;
    use hapterra_core::grid::GridPoint;
    use hapterra_core::phantom::Calibration;
    use hapterra_core::scene::{SceneChange, Source};
    use heightfield::Raster;

    fn with(test: impl for<'t> FnOnce(Placements<'t>, Terrain<'t>, PlacedSurface)) {
        let raster = Raster::from_fn(9, 9, |x, _| x as f32).expect("raster");
        let options = PlacementOptions::default();
        let grid = options.target.grid(&raster, Default::default());
        let grid = grid.expect("a grid");
        let reach = Reach::of(&Calibration::PREMIUM_1_5);
        let view = crate::place::Placement::new(&grid, &reach, &options).expect("a view");
        let terrain = view.terrain(grid).expect("a terrain");
        let params = SurfaceParams::PREMIUM;
        let views = Placements::new(terrain.clone());
        test(views, terrain, PlacedSurface { view, params });
    }

    fn of(view: u8) -> TickRecord {
        TickRecord {
            view,
            ..TickRecord::default()
        }
    }

    #[test]
    fn number_finds_its_placement_after_it_wraps() {
        with(|mut views, terrain, placed_surface| {
            assert_eq!(views.index_of(&of(0)), 0);
            for count in 1..=300_usize {
                let number = count as u8;
                views.add(number, terrain.clone(), placed_surface);
                assert_eq!(views.index_of(&of(number)), count);
            }
            // 300 is 44 in a byte, and 45 is still the earlier one.
            assert_eq!(views.index_of(&of(44)), 300);
            assert_eq!((views.index_of(&of(45)), views.count()), (45, 301));
        });
    }

    #[test]
    fn refused_placement_has_no_sample() {
        with(|mut views, terrain, placed_surface| {
            views.add(1, terrain.clone(), placed_surface);
            let hip = GridPoint::default();
            let scene = terrain.scene(placed_surface.params, Source::Encoders, hip);
            let view = SceneChange {
                number: 1,
                scene,
                hip,
                keeps_tiles: true,
                in_contact: None,
            };
            let (view, accepted) = (&view, false);
            views.on_event(&Event::SceneChangeResult { view, accepted });
            assert_eq!(views.count(), 1);
        });
    }

    #[test]
    fn restarted_device_begins_with_the_latest_placement() {
        with(|mut views, terrain, placed_surface| {
            views.add(1, terrain.clone(), placed_surface);
            let device = hello();
            for (resumed, index) in [(true, 0), (false, 1)] {
                let device = &device;
                views.on_event(&Event::Opened { device, resumed });
                assert_eq!(views.index_of(&of(0)), index);
            }
        });
    }
}
