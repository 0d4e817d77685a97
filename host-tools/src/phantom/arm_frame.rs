//! Frame of the arm in the terrain.
//!
//! The user faces the device, so east is the device's +y, north is −x and up
//! is +z.

use super::kinematics;
use super::model::PhantomModel;
use super::script::Script;

/// Mapping of the terrain frame (mm) to the device frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmFrame {
    /// The terrain point at the tip of the arm in its home pose `q = 0`, mm east, north, up.
    pub home_mm: [f64; 3],
}

/// A point of the script is out of the arm's reach.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the arm cannot reach ({:.1}, {:.1}, {:.1}) mm of the terrain, with ({:.1}, {:.1}, {:.1}) mm at its home",
    .at_mm[0], .at_mm[1], .at_mm[2], .home_mm[0], .home_mm[1], .home_mm[2]
)]
pub struct OutOfReach {
    /// The point, mm, terrain frame.
    pub at_mm: [f64; 3],
    /// The terrain point at the arm's home, mm.
    pub home_mm: [f64; 3],
}

impl ArmFrame {
    /// Converts terrain millimetres to device metres.
    #[must_use]
    pub fn to_device_m(&self, model: &PhantomModel, terrain_mm: [f64; 3]) -> [f64; 3] {
        let [east, north, up] = std::array::from_fn(|i| (terrain_mm[i] - self.home_mm[i]) * 1e-3);
        let [x, y, z] = kinematics::tip(model, [0.0; 3]);
        [x - north, y + east, z + up]
    }

    /// Converts device metres to terrain millimetres.
    #[must_use]
    pub fn to_terrain_mm(&self, model: &PhantomModel, device_m: [f64; 3]) -> [f64; 3] {
        let home_m = kinematics::tip(model, [0.0; 3]);
        let [x, y, z] = std::array::from_fn(|i| (device_m[i] - home_m[i]) * 1e3);
        let [east, north, up] = self.home_mm;
        [east + y, north - x, up + z]
    }

    /// Rotates a direction (force, velocity) from the device frame to the terrain frame, unit
    /// unchanged.
    #[must_use]
    pub fn turn_to_terrain(device: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = device;
        [y, -x, z]
    }

    /// Rotates a direction from the terrain frame to the device frame, unit unchanged.
    #[must_use]
    pub fn turn_to_device(terrain: [f64; 3]) -> [f64; 3] {
        let [east, north, up] = terrain;
        [-north, east, up]
    }

    /// Returns the joint angles for the tip at a terrain point, rad.
    ///
    /// # Errors
    /// [`OutOfReach`]: the point lies beyond the links or the stops.
    pub fn joints_at(&self, model: &PhantomModel, at_mm: [f64; 3]) -> Result<[f64; 3], OutOfReach> {
        kinematics::inverse(model, self.to_device_m(model, at_mm))
            .filter(|q| kinematics::within_stops(model, *q))
            .ok_or(OutOfReach {
                at_mm,
                home_mm: self.home_mm,
            })
    }

    /// Checks that the arm reaches every point of a script.
    ///
    /// # Errors
    /// [`OutOfReach`] names the first corner that the arm does not reach.
    pub fn check(&self, model: &PhantomModel, script: &Script) -> Result<(), OutOfReach> {
        let mut corners = script.corners_mm();
        corners.try_for_each(|at_mm| self.joints_at(model, at_mm).map(drop))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_conversion_round_trips_and_maps_home() {
        let model = PhantomModel::premium_1_5();
        let place = ArmFrame {
            home_mm: [600.0, 400.0, 35.0],
        };
        let tip = kinematics::tip(&model, [0.0; 3]);
        assert_eq!(place.to_terrain_mm(&model, tip), place.home_mm);
        let there = place.to_device_m(&model, [612.0, 380.0, 40.0]);
        for (got, expected) in there
            .iter()
            .zip([tip[0] + 0.02, tip[1] + 0.012, tip[2] + 0.005])
        {
            assert!((got - expected).abs() < 1e-12);
        }
        let back = place.to_terrain_mm(&model, there);
        for (got, expected) in back.iter().zip([612.0, 380.0, 40.0]) {
            assert!((got - expected).abs() < 1e-9);
        }
    }

    #[test]
    fn directions_rotate_like_displacements() {
        assert_eq!(ArmFrame::turn_to_terrain([1.0, 2.0, 3.0]), [2.0, -1.0, 3.0]);
        let back = ArmFrame::turn_to_device(ArmFrame::turn_to_terrain([1.0, 2.0, 3.0]));
        assert_eq!(back, [1.0, 2.0, 3.0]);
    }

    #[test]
    fn hand_span_is_in_reach_but_a_metre_is_not() {
        let model = PhantomModel::premium_1_5();
        let place = ArmFrame { home_mm: [0.0; 3] };
        for corner in [
            [-90., -50., -40.],
            [90., -50., 40.],
            [-90., 50., 40.],
            [90., 50., -40.],
        ] {
            assert!(place.joints_at(&model, corner).is_ok(), "{corner:?}");
        }
        assert!(place.joints_at(&model, [1000.0, 0.0, 0.0]).is_err());
    }
}
