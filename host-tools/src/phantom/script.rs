//! The hand's target as a function of time: legs along polylines with smooth starts and ends, mm,
//! terrain frame.

use glam::DVec3;

/// Duration of an acceleration or deceleration, s.
const RAMP_S: f64 = 0.15;
/// Speed of the return to the beginning of a plan, mm/s.
const BACK_MM_S: f64 = 60.0;

/// The hand's target at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Position, mm, terrain frame.
    pub position_mm: [f64; 3],
    /// Its velocity, mm/s.
    pub speed_mm_s: [f64; 3],
}

/// A hand's plan: a list of consecutive legs, then rest.
#[derive(Clone, Debug)]
pub struct Script {
    legs: Vec<Leg>,
    end_mm: DVec3,
    duration_s: f64,
}

impl Script {
    /// Creates a plan that starts at a point.
    #[must_use]
    pub fn start(at_mm: [f64; 3]) -> Self {
        Self {
            legs: Vec::new(),
            end_mm: DVec3::from(at_mm),
            duration_s: 0.0,
        }
    }

    /// Adds a wait.
    #[must_use]
    pub fn wait(mut self, seconds: f64) -> Self {
        self.duration_s += seconds;
        self
    }

    /// Adds a straight line to a point, at up to `speed_mm_s`.
    #[must_use]
    pub fn line_to(self, to_mm: [f64; 3], speed_mm_s: f64) -> Self {
        self.along(&[to_mm], speed_mm_s)
    }

    /// Adds a polyline from the present end, at up to `speed_mm_s`, measured along the line.
    #[must_use]
    pub fn along(mut self, points_mm: &[[f64; 3]], speed_mm_s: f64) -> Self {
        let mut points = vec![self.end_mm];
        points.extend(points_mm.iter().map(|p| DVec3::from(*p)));
        points.dedup();
        if let Some(leg) = Leg::new(points, self.duration_s, speed_mm_s) {
            self.duration_s += leg.duration_s;
            self.end_mm = leg.end();
            self.legs.push(leg);
        }
        self
    }

    /// Repeats the plan `times` times; in between the hand returns straight to the beginning.
    #[must_use]
    pub fn repeated(self, times: u32) -> Self {
        let begin_mm = self.target(0.0).position_mm;
        let end_mm = self.end_mm;
        let (whole, last_s) = (self.clone().line_to(begin_mm, BACK_MM_S), self.duration_s);
        let mut legs = Vec::new();
        for round in 0..times.max(1) {
            let begin_s = f64::from(round) * whole.duration_s;
            let round = if round + 1 < times { &whole } else { &self };
            legs.extend(round.legs.iter().map(|leg| Leg {
                start_s: begin_s + leg.start_s,
                ..leg.clone()
            }));
        }
        let before_s = f64::from(times.max(1) - 1) * whole.duration_s;
        Self {
            legs,
            end_mm,
            duration_s: before_s + last_s,
        }
    }

    /// Returns the end of the last leg, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Returns the end point of the plan, mm.
    #[must_use]
    pub fn end_mm(&self) -> [f64; 3] {
        self.end_mm.to_array()
    }

    /// Returns all corners of the plan in order, mm: the points that an arm must reach.
    pub fn corners_mm(&self) -> impl Iterator<Item = [f64; 3]> {
        let legs = self.legs.iter().flat_map(|leg| &leg.points);
        legs.map(|p| p.to_array()).chain([self.end_mm()])
    }

    /// Returns the target at a time from the start, s. Before and after the plan it is at rest.
    #[must_use]
    pub fn target(&self, t_s: f64) -> Target {
        let begun = self.legs.partition_point(|leg| leg.start_s <= t_s);
        let (at, speed) = match (begun.checked_sub(1), self.legs.first()) {
            (Some(last), _) => self.legs[last].at(t_s),
            (None, Some(first)) => (first.points[0], DVec3::ZERO),
            (None, None) => (self.end_mm, DVec3::ZERO),
        };
        Target {
            position_mm: at.to_array(),
            speed_mm_s: speed.to_array(),
        }
    }
}

/// One polyline, followed once.
#[derive(Clone, Debug)]
struct Leg {
    start_s: f64,
    duration_s: f64,
    speed_mm_s: f64,
    points: Vec<DVec3>,
    /// Length up to each point, mm.
    travelled: Vec<f64>,
}

impl Leg {
    fn new(points: Vec<DVec3>, start_s: f64, speed_mm_s: f64) -> Option<Self> {
        let mut travelled = vec![0.0];
        let mut length = 0.0;
        for pair in points.windows(2) {
            length += pair[0].distance(pair[1]);
            travelled.push(length);
        }
        if length == 0.0 {
            return None;
        }
        // A short leg gets a lower speed, not a sharper start.
        let speed_mm_s = speed_mm_s.min(length / RAMP_S);
        Some(Self {
            start_s,
            duration_s: length / speed_mm_s + RAMP_S,
            speed_mm_s,
            points,
            travelled,
        })
    }

    fn end(&self) -> DVec3 {
        self.points[self.points.len() - 1]
    }

    fn at(&self, t_s: f64) -> (DVec3, DVec3) {
        let (length, speed) = self.progress(t_s - self.start_s);
        let next = self.travelled.partition_point(|s| *s <= length);
        let Some(to) = self.points.get(next) else {
            return (self.end(), DVec3::ZERO);
        };
        let (from, done) = (self.points[next - 1], self.travelled[next - 1]);
        let along = (*to - from).normalize();
        (from + along * (length - done), along * speed)
    }

    /// Returns the distance (mm) and speed (mm/s) at a time after the leg's start. The speed rises
    /// and falls as the smooth step 3u² − 2u³.
    fn progress(&self, t_s: f64) -> (f64, f64) {
        let ramp = |u: f64| {
            let distance = self.speed_mm_s * RAMP_S * u * u * u * (1.0 - 0.5 * u);
            (distance, self.speed_mm_s * u * u * (3.0 - 2.0 * u))
        };
        let left_s = self.duration_s - t_s;
        if left_s <= 0.0 {
            (self.travelled[self.travelled.len() - 1], 0.0)
        } else if t_s < RAMP_S {
            ramp(t_s.max(0.0) / RAMP_S)
        } else if left_s < RAMP_S {
            let (distance, speed) = ramp(left_s / RAMP_S);
            (self.travelled[self.travelled.len() - 1] - distance, speed)
        } else {
            let cruised = self.speed_mm_s * (t_s - 0.5 * RAMP_S);
            (cruised, self.speed_mm_s)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Script {
        Script::start([1.0, 2.0, 3.0])
            .wait(0.5)
            .line_to([11.0, 2.0, 3.0], 40.0)
            .along(&[[11.0, 12.0, 3.0], [11.0, 12.0, 8.0]], 25.0)
            .wait(0.25)
            .line_to([11.0, 12.0, 9.0], 100.0)
    }

    #[test]
    fn script_starts_waits_and_ends_at_its_stated_points() {
        let plan = plan();
        assert_eq!(plan.target(-1.0).position_mm, [1.0, 2.0, 3.0]);
        assert_eq!(plan.target(0.4).position_mm, [1.0, 2.0, 3.0]);
        let end = plan.target(plan.duration_s() + 1e-9);
        assert_eq!(end.position_mm, [11.0, 12.0, 9.0]);
        assert_eq!(end.speed_mm_s, [0.0; 3]);
        assert_eq!(Script::start([1.0; 3]).target(7.0).position_mm, [1.0; 3]);
    }

    #[test]
    fn repeated_script_returns_to_start_and_keeps_its_end() {
        let (once, thrice) = (plan(), plan().repeated(3));
        let back_s = (thrice.duration_s() - 3.0 * once.duration_s()) / 2.0;
        assert!(back_s > 0.0);
        let round_s = once.duration_s() + back_s;
        for t_s in [0.1, 0.6, 1.1, 1.6] {
            for round in 0..3 {
                let at = thrice.target(f64::from(round) * round_s + t_s).position_mm;
                let moved = DVec3::from(at).distance(DVec3::from(once.target(t_s).position_mm));
                assert!(moved < 1e-9, "{t_s} {round}");
            }
        }
        let end = thrice.target(thrice.duration_s() + 1e-9).position_mm;
        assert_eq!((end, thrice.end_mm()), ([11.0, 12.0, 9.0], once.end_mm()));
        assert_eq!(plan().repeated(0).duration_s(), once.duration_s());
    }

    #[test]
    fn speed_is_the_slope_of_position_and_bounded() {
        let plan = plan();
        let h = 1e-6;
        for step in 0..(plan.duration_s() * 1e3) as u32 {
            let t = 1e-3 * f64::from(step) + 0.4e-3;
            let at = |t| DVec3::from(plan.target(t).position_mm);
            let slope = (at(t + h) - at(t - h)) / (2.0 * h);
            let speed = DVec3::from(plan.target(t).speed_mm_s);
            assert!((slope - speed).length() < 1e-3, "{t}: {slope} {speed}");
            assert!(speed.length() <= 40.0 + 1e-9);
        }
    }
}
