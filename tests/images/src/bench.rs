//! An arm that presses on a plane, on every board with an image.

use hapterra::terrain::{Scale, Terrain};
use hapterra_core::scene::{Scene, Source};
use heightfield::Raster;

use crate::device::{Device, Plane, machines};
use crate::machine::{Machine, Stop};

/// A level plane for every board's arm.
pub struct Bench {
    /// The plane to press.
    pub plane: Plane,
    raster: Raster,
    scale: Scale,
}

impl Default for Bench {
    fn default() -> Self {
        Self::new()
    }
}

impl Bench {
    /// Creates a plane 20 mm high, under a home at 30 mm.
    ///
    /// # Panics
    /// Never: the sizes are fixed.
    #[must_use]
    pub fn new() -> Self {
        Self {
            plane: Plane::level([100.0, 100.0, 30.0], 20.0),
            raster: Raster::from_fn(201, 201, |_, _| 20.0).expect("raster"),
            scale: Scale::new(1.0, 1.0).expect("scale"),
        }
    }

    /// Returns the terrain.
    ///
    /// # Panics
    /// Never: the sizes are fixed.
    #[must_use]
    pub fn terrain(&self) -> Terrain<'_> {
        Terrain::new(&self.raster, self.scale, 0).expect("terrain")
    }

    /// Returns the scene over it.
    ///
    /// # Panics
    /// Never: the home is near.
    #[must_use]
    pub fn scene(&self, terrain: &Terrain<'_>) -> Scene {
        let home = self
            .scale
            .to_grid(self.plane.place.home_mm)
            .expect("addressable");
        terrain.scene(self.plane.params, Source::Encoders, home)
    }

    /// Presses 3 mm deep and keeps still.
    ///
    /// # Panics
    /// If the board does not arm.
    #[must_use]
    pub fn press<'t>(&self, machine: Machine, terrain: &'t Terrain<'t>) -> Device<'t> {
        let mut device = Device::arm(machine, terrain, self.scene(terrain));
        device.move_to(self.plane.counts_at([100.0, 100.0], -3.0));
        device.run_ms(40);
        device.move_to(self.plane.counts_at([100.0, 100.0], 3.0));
        device.run_ms(40);
        let mut machine = device.machine.borrow_mut();
        assert!(machine.is_enabled(), "{}: pressed", machine.chip.board);
        // The test continues between two ticks.
        assert_eq!(machine.run_ticks(1), Stop::Requested);
        let _ = machine.take_effects();
        drop(machine);
        device
    }

    /// Presses on every board and calls `then`.
    ///
    /// # Panics
    /// If a board does not arm.
    pub fn on_each(&self, mut then: impl FnMut(&mut Device<'_>)) {
        for machine in machines() {
            let terrain = self.terrain();
            then(&mut self.press(machine, &terrain));
        }
    }
}
