//! The demonstration that suits a terrain: its place and its motions.

use glam::DVec3;

use super::arm_frame::{ArmFrame, OutOfReach};
use super::hand::HandModel;
use super::model::PhantomModel;
use super::script::Script;
use super::touch::{Surface, Touch};

/// Half the size of the touched place, east and north, mm: most of a Premium 1.5's reach at any
/// height.
const HALF_MM: [f64; 2] = [70.0, 35.0];
/// Max share of the terrain's half size that is used.
const MAX_USED_SHARE: f64 = 0.84;
/// Factors tried in order until the arm reaches all of the plan and there is hardly any no-data.
const SHRINK: [f64; 5] = [1.0, 0.6, 0.35, 0.2, 0.1];
/// Share of known ground at which no smaller place is searched.
const ENOUGH_KNOWN_SHARE: f64 = 0.97;
/// Places tried in each direction.
const PLACES: u32 = 11;
/// Relief above which a place gets no higher score, mm.
const ENOUGH_RELIEF_MM: f64 = 25.0;
/// Force of presses and taps relative to the slide. With a slide of 1 N, all forces are below the
/// 1.55 N that a Premium 1.5 can hold upwards continuously (1.24 A).
const PRESS_FACTOR: f64 = 1.5;
/// Max distance of a plan's middle from a fixed home position along each axis, mm: about the
/// sideways reach of a Premium 1.5.
const MAX_HOME_DISTANCE_MM: f64 = 250.0;
/// Min and max speed of the slide, mm/s, and its intended duration, s.
const SLIDE_MM_S: (f64, f64) = (45.0, 120.0);
const SLIDE_S: f64 = 7.0;

/// A plan and the terrain's position for it.
#[derive(Clone, Debug)]
pub struct Tour {
    /// Approach, press, slide along a winding line, three taps, lift.
    pub script: Script,
    /// Placement with the middle of the plan at the arm's home.
    pub placement: ArmFrame,
}

/// Conditions of a tour.
#[derive(Clone, Copy)]
pub struct TourPlan<'a> {
    /// The terrain, mm.
    pub surface: Surface<'a>,
    /// Its extent east and north, mm.
    pub size_mm: [f64; 2],
    /// The arm.
    pub model: PhantomModel,
    /// The hand.
    pub hand: HandModel,
    /// Stiffness of the surface, N/mm.
    pub wall_n_per_mm: f64,
    /// Force of the slide, N; presses and taps are 1.5 times as strong.
    pub push_n: f64,
    /// The terrain point at the arm's home, mm east, north, up, if it is fixed; otherwise the
    /// middle of the plan is there.
    pub home_mm: Option<[f64; 3]>,
}

impl TourPlan<'_> {
    /// Finds the place with the least no-data and enough relief, preferably in the centre, and
    /// plans a tour there.
    ///
    /// # Errors
    /// [`OutOfReach`] if even a small tour has points beyond the arm's reach: the terrain is too
    /// high.
    pub fn plan(&self) -> Result<Tour, OutOfReach> {
        let mut best: Option<(f64, Tour)> = None;
        let mut first_failure = None;
        for shrink in SHRINK {
            let limit = |i: usize| f64::min(HALF_MM[i], 0.5 * MAX_USED_SHARE * self.size_mm[i]);
            let half = [0, 1].map(|i| shrink * limit(i));
            let line = wave_path(self.best_place(half), half);
            let (known, tour) = (known_share(&self.heights(&line)), self.tour_along(&line));
            match tour.placement.check(&self.model, &tour.script) {
                Ok(()) if best.as_ref().is_none_or(|best| known > best.0) => {
                    best = Some((known, tour));
                }
                Ok(()) => {}
                Err(far) => first_failure = first_failure.or(Some(far)),
            }
            if best
                .as_ref()
                .is_some_and(|best| best.0 >= ENOUGH_KNOWN_SHARE)
            {
                break;
            }
        }
        best.map(|(_, tour)| tour)
            .ok_or(first_failure.unwrap_or(OutOfReach {
                at_mm: [0.0; 3],
                home_mm: [0.0; 3],
            }))
    }

    /// Returns the heights along a line. With a ball each height is expensive, so a line is sampled
    /// once.
    fn heights(&self, line: &[[f64; 2]]) -> Vec<Option<f64>> {
        line.iter().map(|p| (self.surface)(p[0], p[1])).collect()
    }

    fn tour_along(&self, line: &[[f64; 2]]) -> Tour {
        let touch = Touch::start(self.surface, &self.hand, self.wall_n_per_mm, line[0], 12.0)
            .press(PRESS_FACTOR * self.push_n, 0.6);
        let length = touch.slide_length_mm(line, self.push_n);
        let speed = (length / SLIDE_S).clamp(SLIDE_MM_S.0, SLIDE_MM_S.1);
        let script = touch
            .slide(line, self.push_n, speed)
            .tap(3, PRESS_FACTOR * self.push_n)
            .lift(12.0)
            .finish();
        let home_mm = self.home_mm.unwrap_or_else(|| middle(&script));
        let placement = ArmFrame { home_mm };
        Tour { script, placement }
    }

    fn best_place(&self, half: [f64; 2]) -> [f64; 2] {
        let along = |step: u32, axis: usize| {
            let [low, high] = self.middle_range(axis, half[axis]);
            low + (high - low) * f64::from(step) / f64::from(PLACES - 1)
        };
        let places = (0..PLACES * PLACES).map(|i| [along(i % PLACES, 0), along(i / PLACES, 1)]);
        let scored = places.map(|place| (self.score(place, half), place));
        let best = scored.reduce(|best, next| if next.0 > best.0 { next } else { best });
        best.map_or(self.size_mm.map(|side| 0.5 * side), |best| best.1)
    }

    /// Returns the range for the middle of a plan along an axis: on the terrain and, if the home
    /// position is fixed, within [`MAX_HOME_DISTANCE_MM`] of it.
    fn middle_range(&self, axis: usize, half: f64) -> [f64; 2] {
        let (middle, room) = (0.5 * self.size_mm[axis], half / MAX_USED_SHARE);
        let room = (middle - room).max(0.0);
        let on_terrain = [middle - room, middle + room];
        match self.home_mm {
            None => on_terrain,
            Some(home) => [-MAX_HOME_DISTANCE_MM, MAX_HOME_DISTANCE_MM]
                .map(|far| (home[axis] + far).clamp(on_terrain[0], on_terrain[1])),
        }
    }

    /// Returns the share of a line beyond the arm's reach from a fixed home position.
    fn share_beyond_reach(&self, line: &[[f64; 2]], heights: &[Option<f64>]) -> f64 {
        let Some(home_mm) = self.home_mm else {
            return 0.0;
        };
        let place = ArmFrame { home_mm };
        let beyond = line.iter().zip(heights).filter(|(at, height)| {
            height.is_some_and(|z| place.joints_at(&self.model, [at[0], at[1], z]).is_err())
        });
        beyond.count() as f64 / line.len() as f64
    }

    /// Returns the score of a place: known ground counts most, then relief up to
    /// [`ENOUGH_RELIEF_MM`], then closeness to the centre.
    fn score(&self, place: [f64; 2], half: [f64; 2]) -> f64 {
        let line = wave_path(place, half);
        let heights = self.heights(&line);
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for height in heights.iter().flatten() {
            (low, high) = (low.min(*height), high.max(*height));
        }
        let relief = (high - low).clamp(0.0, ENOUGH_RELIEF_MM) / ENOUGH_RELIEF_MM;
        let off = |axis: usize| (2.0 * place[axis] / self.size_mm[axis] - 1.0).abs();
        // The hand approaches at one end and taps at the other.
        let ends = [heights.first(), heights.last()];
        let unknown = ends.iter().flatten().filter(|height| height.is_none());
        10.0 * known_share(&heights) + relief
            - 0.2 * off(0).max(off(1))
            - 4.0 * unknown.count() as f64
            - 30.0 * self.share_beyond_reach(&line, &heights)
    }
}

/// Returns the share of a line on known ground.
fn known_share(heights: &[Option<f64>]) -> f64 {
    heights.iter().flatten().count() as f64 / heights.len() as f64
}

/// Returns the middle of the box around a script.
fn middle(script: &Script) -> [f64; 3] {
    let corners = || script.corners_mm().map(DVec3::from);
    let low = corners().fold(DVec3::MAX, DVec3::min);
    let high = corners().fold(DVec3::MIN, DVec3::max);
    (0.5 * (low + high)).to_array()
}

/// Returns one and a half waves from west to east.
fn wave_path(centre_mm: [f64; 2], half_mm: [f64; 2]) -> Vec<[f64; 2]> {
    (0..=240)
        .map(|i| {
            let u = f64::from(i) / 240.0;
            let turn = libm::sin(3.0 * std::f64::consts::PI * u);
            let x = centre_mm[0] + half_mm[0] * (2.0 * u - 1.0);
            [x, centre_mm[1] + half_mm[1] * turn]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan<'a>(surface: Surface<'a>, size_mm: [f64; 2]) -> TourPlan<'a> {
        TourPlan {
            surface,
            size_mm,
            model: PhantomModel::premium_1_5(),
            hand: HandModel::default(),
            wall_n_per_mm: 0.5,
            push_n: 1.0,
            home_mm: None,
        }
    }

    fn east_extent(tour: &Tour) -> f64 {
        let east = tour.script.corners_mm().map(|c| c[0]);
        let (low, high) = east.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    }

    #[test]
    fn tour_stays_on_known_terrain() {
        // Only the north-east quarter is known.
        let surface = |x: f64, y: f64| (x > 500.0 && y > 400.0).then_some(3.0);
        let tour = plan(&surface, [1000.0, 800.0]).plan().expect("in reach");
        for [x, y, _] in tour.script.corners_mm() {
            assert!(surface(x, y).is_some(), "{x} {y}");
            assert!(x < 1000.0 && y < 800.0);
        }
    }

    #[test]
    fn tour_avoids_no_data_in_the_middle() {
        let ring = |x: f64, _: f64| ((x - 500.0).abs() > 30.0).then_some(0.0);
        let tour = plan(&ring, [1000.0, 800.0]).plan().expect("in reach");
        for [x, y, _] in tour.script.corners_mm() {
            assert!(ring(x, y).is_some(), "{x} {y}");
        }
        let wide = east_extent(&tour);
        assert!((wide - 2.0 * HALF_MM[0]).abs() < 1e-6, "{wide}");
    }

    #[test]
    fn tour_with_a_fixed_home_stays_in_reach_of_the_arm() {
        let ramp = |x: f64, _: f64| Some(0.05 * x);
        for home in [
            [500.0, 400.0, 40.0],
            [60.0, 40.0, 20.0],
            [990.0, 700.0, 60.0],
        ] {
            let plan = TourPlan {
                home_mm: Some(home),
                ..plan(&ramp, [1000.0, 800.0])
            };
            let tour = plan.plan().expect("in reach");
            assert_eq!(tour.placement.home_mm, home);
            assert!(tour.placement.check(&plan.model, &tour.script).is_ok());
            assert!(east_extent(&tour) > 40.0, "{}", east_extent(&tour));
        }
        let far = TourPlan {
            home_mm: Some([-3000.0, 0.0, 0.0]),
            ..plan(&ramp, [1000.0, 800.0])
        };
        assert!(far.plan().is_err());
    }

    #[test]
    fn tour_finds_a_small_island_surrounded_by_no_data() {
        let island = |x: f64, y: f64| ((x - 600.0).hypot(y - 240.0) < 60.0).then_some(3.0);
        let tour = plan(&island, [1000.0, 800.0]).plan().expect("in reach");
        for [x, y, _] in tour.script.corners_mm() {
            assert!(island(x, y).is_some(), "{x} {y}");
        }
    }

    #[test]
    fn tour_shrinks_on_steep_terrain_and_fails_on_a_cliff() {
        let steep = |x: f64, _: f64| Some(2.0 * x);
        let tour = plan(&steep, [300.0, 200.0]).plan().expect("small tour");
        let wide = east_extent(&tour);
        assert!((20.0..130.0).contains(&wide), "{wide}");
        let cliff = |x: f64, _: f64| Some(if x > 150.0 { 1000.0 } else { 0.0 } + x * 40.0);
        assert!(plan(&cliff, [300.0, 200.0]).plan().is_err());
    }

    #[test]
    fn tiny_and_empty_terrains_have_a_plan() {
        let nothing = |_: f64, _: f64| None;
        for size in [[1.0, 1.0], [500.0, 0.5], [40.0, 80.0]] {
            for surface in [&(|_: f64, _: f64| Some(0.0)) as Surface<'_>, &nothing] {
                let tour = plan(surface, size).plan().expect("in reach");
                assert!(tour.script.corners_mm().flatten().all(f64::is_finite));
            }
        }
    }
}
