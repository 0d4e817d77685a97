//! Plans that follow a terrain: approach, press, slide, tap, lift.
//!
//! The hand is a spring: for a force of N newtons its target lies below the surface by the sum of
//! the deflections of wall, grip and arm. It follows the true surface, like a person who remembers
//! it.

use super::hand::HandModel;
use super::script::Script;

/// Height of the surface in mm at (east, north) in mm; `None` in no-data.
pub type Surface<'a> = &'a dyn Fn(f64, f64) -> Option<f64>;

/// Distance between the points of a slide, mm.
const SLIDE_STEP_MM: f64 = 0.5;
/// A slide follows the mean surface of this many points on both sides: a hand does not copy every
/// cliff.
const SLIDE_SMOOTHING: usize = 4;
/// Height of the hand above the rim of no-data while it crosses, mm.
const NO_DATA_CLEARANCE_MM: f64 = 3.0;
/// Speed of approach and tapping, mm/s.
const APPROACH_MM_S: f64 = 60.0;

/// Builds a [`Script`] that touches a surface.
pub struct Touch<'a> {
    surface: Surface<'a>,
    compliance_mm_per_n: f64,
    script: Script,
}

impl<'a> Touch<'a> {
    /// Starts `above_mm` over the surface at a place, for walls of the given stiffness. In no-data
    /// the nearest ground within 200 mm counts, or height zero if there is none.
    #[must_use]
    pub fn start(
        surface: Surface<'a>,
        hand: &HandModel,
        wall_n_per_mm: f64,
        place_mm: [f64; 2],
        above_mm: f64,
    ) -> Self {
        let [x, y] = place_mm;
        let ground = nearest_ground(surface, x, y).unwrap_or(0.0);
        Self {
            surface,
            compliance_mm_per_n: 1.0 / wall_n_per_mm + 1e3 * hand.compliance_m_per_n(),
            script: Script::start([x, y, ground + above_mm]),
        }
    }

    /// Presses straight down with a force and holds it for some seconds.
    #[must_use]
    pub fn press(mut self, newtons: f64, seconds: f64) -> Self {
        let target = self.press_target(newtons);
        self.script = self.script.line_to(target, APPROACH_MM_S).wait(seconds);
        self
    }

    /// Slides along a line on the map (mm) while pressing with a force.
    #[must_use]
    pub fn slide(mut self, line_mm: &[[f64; 2]], newtons: f64, speed_mm_s: f64) -> Self {
        let points = self.follow(&self.route(line_mm), newtons);
        self.script = self.script.along(&points, speed_mm_s);
        self
    }

    /// Returns the length of such a slide in three dimensions, mm.
    #[must_use]
    pub fn slide_length_mm(&self, line_mm: &[[f64; 2]], newtons: f64) -> f64 {
        let points = self.follow(&self.route(line_mm), newtons);
        let pairs = points.windows(2);
        let step = |a: [f64; 3], b: [f64; 3]| glam::DVec3::from(a).distance(b.into());
        pairs.map(|pair| step(pair[0], pair[1])).sum()
    }

    /// Returns closely spaced points from the hand's position along a line.
    fn route(&self, line_mm: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let [x, y, _] = self.script.end_mm();
        let mut line = vec![[x, y]];
        line.extend_from_slice(line_mm);
        resample(&line)
    }

    /// Lifts and presses again, several times, with a force at the bottom.
    #[must_use]
    pub fn tap(mut self, times: u32, newtons: f64) -> Self {
        for _ in 0..times {
            self = self.lift(4.0).press(newtons, 0.1);
        }
        self
    }

    /// Lifts straight up to `above_mm` over the surface.
    #[must_use]
    pub fn lift(mut self, above_mm: f64) -> Self {
        let [x, y, z] = self.script.end_mm();
        let ground = nearest_ground(self.surface, x, y).unwrap_or(z);
        self.script = self
            .script
            .line_to([x, y, ground + above_mm], APPROACH_MM_S);
        self
    }

    /// Returns the unfinished plan.
    #[must_use]
    pub fn script(&self) -> &Script {
        &self.script
    }

    /// Returns the plan.
    #[must_use]
    pub fn finish(self) -> Script {
        self.script
    }

    fn press_target(&self, newtons: f64) -> [f64; 3] {
        let [x, y, z] = self.script.end_mm();
        match (self.surface)(x, y) {
            Some(ground) => [x, y, ground - newtons * self.compliance_mm_per_n],
            None => [x, y, z],
        }
    }

    /// Returns the targets for the points of a line: the smoothed surface minus the press, or over
    /// no-data a height above the last rim.
    fn follow(&self, line: &[[f64; 2]], newtons: f64) -> Vec<[f64; 3]> {
        let ground: Vec<_> = line.iter().map(|[x, y]| (self.surface)(*x, *y)).collect();
        let mut rim = ground.iter().flatten().next().copied();
        let mut points = Vec::with_capacity(line.len());
        for (i, [x, y]) in line.iter().enumerate() {
            let near = &ground[i.saturating_sub(SLIDE_SMOOTHING)..];
            let near = &near[..near.len().min(2 * SLIDE_SMOOTHING + 1)];
            let known: Vec<f64> = near.iter().flatten().copied().collect();
            let z = if known.len() == near.len() {
                let mean = known.iter().sum::<f64>() / known.len() as f64;
                mean - newtons * self.compliance_mm_per_n
            } else {
                let highest = known.iter().copied().reduce(f64::max);
                rim = highest.or(rim);
                rim.unwrap_or(0.0) + NO_DATA_CLEARANCE_MM
            };
            points.push([*x, *y, z]);
        }
        points
    }
}

/// Returns the ground at a place, or the first ground found on growing rings around it.
fn nearest_ground(surface: Surface<'_>, x: f64, y: f64) -> Option<f64> {
    let on_ring = |radius: u32| {
        (0..24).find_map(|turn| {
            let (sin, cos) = libm::sincos(f64::from(turn) * std::f64::consts::TAU / 24.0);
            surface(x + f64::from(radius) * cos, y + f64::from(radius) * sin)
        })
    };
    surface(x, y).or_else(|| (1..=200).find_map(on_ring))
}

/// Returns points at most [`SLIDE_STEP_MM`] apart along a line.
fn resample(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut points = vec![line[0]];
    for pair in line.windows(2) {
        let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
        let pieces = ((x1 - x0).hypot(y1 - y0) / SLIDE_STEP_MM).ceil().max(1.0);
        for piece in 1..=pieces as u32 {
            let u = f64::from(piece) / pieces;
            points.push([x0 + u * (x1 - x0), y0 + u * (y1 - y0)]);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAND: fn() -> HandModel = HandModel::default;

    #[test]
    fn press_target_is_below_surface_by_spring_deflection() {
        let plan = Touch::start(&|_, _| Some(10.0), &HAND(), 0.5, [1.0, 2.0], 8.0)
            .press(2.0, 1.0)
            .finish();
        assert_eq!(plan.target(0.0).position_mm, [1.0, 2.0, 18.0]);
        let compliance_mm_per_n = 1.0 / 0.5 + 1.0 / 0.3 + 1.0 / 2.0;
        let [x, y, z] = plan.end_mm();
        assert_eq!((x, y), (1.0, 2.0));
        assert!((z - (10.0 - 2.0 * compliance_mm_per_n)).abs() < 1e-9);
    }

    #[test]
    fn start_over_no_data_is_above_the_rim() {
        let surface = |x: f64, _: f64| (x > 30.0).then_some(45.0);
        let plan = Touch::start(&surface, &HAND(), 0.5, [0.0, 0.0], 5.0).finish();
        assert_eq!(plan.end_mm(), [0.0, 0.0, 50.0]);
    }

    #[test]
    fn slide_follows_the_slope_and_clears_no_data() {
        let surface = |x: f64, _: f64| (!(20.0..30.0).contains(&x)).then_some(0.5 * x);
        let plan = Touch::start(&surface, &HAND(), 0.5, [0.0, 0.0], 5.0)
            .press(1.0, 0.1)
            .slide(&[[50.0, 0.0]], 1.0, 40.0)
            .finish();
        for [x, _, z] in plan.corners_mm() {
            if (20.0..30.0).contains(&x) {
                assert!(z > 10.0, "x {x}: {z} is below the rim");
            } else if (5.0..17.0).contains(&x) {
                assert!((z - (0.5 * x - 5.833)).abs() < 0.01, "x {x}: {z}");
            }
        }
    }
}
