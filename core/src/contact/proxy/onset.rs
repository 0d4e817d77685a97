//! A contact that begins on the surface, where the hand had the proxy before the placement changed.

use glam::Vec3;

use super::{Contact, OnSurface, Phase};
use crate::contact::budget::Budget;
use crate::contact::closest_point::position_on;
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::settings::ContactSettings;
use crate::contact::surface::SurfacePoint;
use crate::grid::GridPoint;
use crate::terrain::{CellContent, Window};

/// Start of a contact.
#[derive(Clone, Debug)]
pub(super) struct Onset {
    /// Place over or under the surface; the height does not count.
    at: GridPoint,
    /// Vector from the HIP to the proxy, cells.
    displacement: Vec3,
    /// Share of the force at the start.
    fade: f32,
}

impl Contact {
    /// Creates a contact whose proxy begins on the surface at the column of a place, with the
    /// vector `displacement` from the HIP to it, cells. No force is rendered before the terrain
    /// there is available and [`Contact::place_on_surface`] has placed the HIP; then this share of
    /// it, which grows to all.
    #[must_use]
    pub fn onset(settings: ContactSettings, at: GridPoint, displacement: Vec3, fade: f32) -> Self {
        Self {
            onset: Some(Onset {
                at,
                displacement,
                fade,
            }),
            ..Self::new(settings)
        }
    }

    /// Returns true if the contact waits to begin on the surface.
    #[must_use]
    pub const fn is_onset_pending(&self) -> bool {
        self.onset.is_some()
    }

    /// Returns the vector from the HIP to the proxy, cells, while the proxy touches or is about to.
    #[must_use]
    pub fn displacement(&self) -> Option<Vec3> {
        match &self.onset {
            Some(onset) => Some(onset.displacement),
            None if self.output.state == ContactState::Touching => {
                Some(self.hip.to(&self.output.proxy))
            }
            None => None,
        }
    }

    /// Puts the proxy of a beginning contact onto the surface as soon as the terrain there is
    /// available, and returns the HIP at the same depth as before. At no-data there is no contact.
    ///
    #[must_use]
    pub fn place_on_surface<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
    ) -> Option<GridPoint> {
        let Onset {
            at,
            displacement,
            fade,
        } = self.onset.as_ref()?;
        let (cell, frac) = (at.column(), at.frac());
        let (u, v) = (frac.x, frac.y);
        let point = SurfacePoint { cell, u, v };
        let fade = *fade;
        match window.ground(cell) {
            CellContent::Missing => return None,
            CellContent::NoData => self.onset = None,
            CellContent::Patch(_) => {
                let surface = position_on(window, &point)?;
                let hip = GridPoint::new(surface.cell(), surface.frac() - *displacement);
                self.onset = None;
                self.phase = Phase::OnSurface(OnSurface::at(point, fade));
                self.hip = hip;
                return Some(hip);
            }
        }
        None
    }
}

impl Onset {
    /// Returns the output while the terrain at the place is missing.
    #[cold]
    pub(super) fn pending_output(&self, budget: &mut Budget) -> ContactOutput {
        budget.record_missing(self.at.column());
        ContactOutput {
            proxy: self.at,
            ..ContactOutput::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::testing::{Field, buffers};
    use crate::terrain::{FieldSize, TileIndex, TileKey};

    fn column(x: f32, y: f32) -> GridPoint {
        GridPoint::new([0; 3], Vec3::new(x, y, -77.0))
    }

    /// A wall 30 cells high whose foot is at x = 10 and whose top is at x = 11.
    fn wall(x: i32, _y: i32) -> f32 {
        if x <= 10 { 0.0 } else { 30.0 }
    }

    #[test]
    fn onset_keeps_depth_and_stays_on_its_side_of_a_wall() {
        let mut tiles = buffers::<2>();
        let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), wall);
        // Three cells deep in the wall from the west, relative to the proxy.
        let displacement = Vec3::new(-3.0, 0.1, 0.0);
        let mut contact = Contact::onset(
            ContactSettings::AT_1_KHZ,
            column(10.5, 20.5),
            displacement,
            0.0,
        );
        assert!(contact.is_onset_pending());
        let hip = contact
            .place_on_surface(&field.window)
            .expect("the terrain is there");
        assert!(!contact.is_onset_pending());
        let expected = GridPoint::new([13, 20, 15], Vec3::new(0.5, 0.4, 0.0));
        assert!(hip.to(&expected).length() < 1e-5, "{hip:?}");
        let mut last = Vec3::ZERO;
        for tick in 0..40 {
            let output = contact.step(&field.window, &hip);
            assert_eq!(output.state, ContactState::Touching);
            let change = (output.displacement - last).length();
            assert!(change < 0.15, "tick {tick}: {change} cells at once");
            last = output.displacement;
        }
        assert!(last.length() <= displacement.length() + 1e-4, "{last}");
        assert!(last.x < -2.0, "on its side: {last}");
    }

    #[test]
    fn onset_without_terrain_reports_missing_tile_without_force() {
        let mut tiles = buffers::<2>();
        let mut field = Field::<2>::empty(&mut tiles, FieldSize::new(100, 100), |_, _| 2.0);
        let displacement = Vec3::new(40.0, 0.0, 1.0);
        let mut contact = Contact::onset(
            ContactSettings::AT_1_KHZ,
            column(60.5, 5.5),
            displacement,
            0.0,
        );
        let hip = GridPoint::new([20, 5, 1], Vec3::splat(0.5));
        for _ in 0..3 {
            assert_eq!(contact.place_on_surface(&field.window), None);
            let output = *contact.step(&field.window, &hip);
            assert_eq!(output.missing_tile, Some(TileIndex::new(1, 0)));
            assert_eq!(output.displacement, Vec3::ZERO);
        }
        assert_eq!(
            contact.displacement(),
            Some(displacement),
            "for another view meanwhile"
        );
        let _ = field.install(TileKey::new(0, 1, 0));
        let hip = contact
            .place_on_surface(&field.window)
            .expect("now it is there");
        assert_eq!(hip, GridPoint::new([20, 5, 1], Vec3::new(0.5, 0.5, 0.0)));
    }

    #[test]
    fn onset_over_no_data_ends_without_contact() {
        let mut tiles = buffers::<2>();
        let field = Field::<2>::filled(&mut tiles, FieldSize::new(40, 40), |x, _| {
            if x > 20 { f32::NAN } else { 0.0 }
        });
        let displacement = Vec3::new(0.0, 0.0, 1.0);
        let mut contact = Contact::onset(
            ContactSettings::AT_1_KHZ,
            column(30.5, 5.5),
            displacement,
            0.0,
        );
        assert_eq!(contact.place_on_surface(&field.window), None);
        let output = *contact.step(&field.window, &column(30.5, 5.5));
        assert_eq!(
            (output.state, output.missing_tile),
            (ContactState::Unseeded, None)
        );
        assert!(!contact.is_onset_pending());
    }
}
