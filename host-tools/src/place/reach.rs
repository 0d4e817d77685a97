//! Workspace and resolution of an arm, from its calibration.

use std::f64::consts::PI;

use hapterra_core::Vec3;
use hapterra_core::phantom::Calibration;

/// Distance from the stops that poses must keep, rad: 5°, so that a hand at the terrain's border
/// does not touch the stops.
const MARGIN_RAD: f32 = 5.0 * (std::f32::consts::PI / 180.0);
/// Min distance of the tip from the base's axis, as a share of both links' length: nearer to the
/// axis, the first joint turns far for a small step to the side.
const MIN_AXIS_SHARE: f64 = 0.25;
/// Places of the profile along the links' whole length.
const PLACES: usize = 96;

/// A box around terrain, mm: east, north and up from the tip in its home pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReachBox {
    /// West, south and lowest.
    pub low: [f64; 3],
    /// East, north and highest.
    pub high: [f64; 3],
}

impl ReachBox {
    /// Returns a box of a size around a middle.
    #[must_use]
    pub fn around(middle: [f64; 3], size: [f64; 3]) -> Self {
        Self {
            low: [0, 1, 2].map(|axis| middle[axis] - 0.5 * size[axis]),
            high: [0, 1, 2].map(|axis| middle[axis] + 0.5 * size[axis]),
        }
    }
}

/// Workspace of an arm.
///
/// The arm turns about the base's axis, so its workspace is a profile of distances from this axis
/// and heights, rotated through the angles of the first joint.
#[derive(Clone, Debug)]
pub struct Reach {
    /// Distance of two places of the profile, mm.
    step_mm: f64,
    /// Distance from the axis and height of the tip in the home pose, mm, device frame.
    home_mm: [f64; 2],
    /// Angles of the first joint, rad.
    turn_rad: [f64; 2],
    /// Places of the profile outwards from the axis.
    columns: usize,
    /// Places of the profile upwards, from both links' length below the axis.
    rows: usize,
    /// Number of unreachable places inwards of and below each place.
    missing: Vec<u32>,
    /// Resolution of the coarsest axis at the tip in the home pose, mm for each count.
    resolution_mm: f64,
}

impl Reach {
    /// Computes the reach of an arm from its calibration.
    #[must_use]
    pub fn of(record: &Calibration) -> Self {
        let whole = f64::from(record.l1_mm) + f64::from(record.l2_mm);
        let step_mm = whole / PLACES as f64;
        let limits = &record.limits;
        let turn = [
            f64::from(limits.min_rad.x + MARGIN_RAD),
            f64::from(limits.max_rad.x - MARGIN_RAD),
        ];
        let mut reach = Self {
            step_mm,
            home_mm: [f64::from(record.l1_mm), -f64::from(record.l2_mm)],
            turn_rad: turn,
            columns: PLACES + 1,
            rows: 2 * PLACES + 1,
            missing: Vec::new(),
            resolution_mm: resolution_mm(record),
        };
        reach.missing = reach.sums(record, MIN_AXIS_SHARE * whole);
        reach
    }

    /// Returns the resolution of the encoders at the tip in the home pose, mm: that of the coarsest
    /// axis. The levers of the three axes are there the upper link, the upper link and the fore
    /// link.
    #[must_use]
    pub const fn resolution_mm(&self) -> f64 {
        self.resolution_mm
    }

    /// Returns the height from the lowest to the highest point of the profile, mm.
    #[must_use]
    pub fn height_mm(&self) -> f64 {
        let reached = |row: usize| {
            (0..self.columns).any(|column| self.missing_in([column, column], [row, row]) == 0)
        };
        let rows = (0..self.rows).filter(|row| reached(*row));
        let (low, high) = rows.fold((self.rows, 0), |(low, high), row| {
            (low.min(row), high.max(row))
        });
        high.saturating_sub(low) as f64 * self.step_mm
    }

    /// Returns the rectangle around the workspace at all heights: west, south, east and north of
    /// the tip in its home pose, mm.
    #[must_use]
    pub fn sides_mm(&self) -> [f64; 4] {
        let is_reached =
            |column: &usize| (0..self.rows).any(|row| self.missing_in([*column; 2], [row; 2]) == 0);
        let mut columns = (0..self.columns).filter(is_reached);
        let out = |column: Option<usize>| self.step_mm * column.unwrap_or(0) as f64;
        let nearest = columns.next();
        let [near, far] = [nearest, columns.next_back().or(nearest)].map(out);
        let [left, right] = self.turn_rad.map(|turn| turn.clamp(-PI / 2.0, PI / 2.0));
        let widest = self.turn_rad.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        // The user faces the device: north is towards the base's axis.
        let northernmost = [near, far].map(|out| out * widest.min(PI).cos());
        [
            far * left.sin(),
            self.home_mm[0] - far,
            far * right.sin(),
            self.home_mm[0] - northernmost[0].min(northernmost[1]),
        ]
    }

    /// Returns true if the arm reaches every point of a box.
    #[must_use]
    pub fn contains(&self, of: &ReachBox) -> bool {
        let ([west, south, low], [east, north, high]) = (of.low, of.high);
        self.outwards([west, east], [south, north])
            .is_some_and(|out| self.reaches_all(out, [low, high]))
    }

    /// Returns the middle of a box of a size in the workspace, the closest to the tip in its home
    /// pose and not to the side: mm east, north, up from that tip.
    #[must_use]
    pub fn middle_of(&self, size: [f64; 3]) -> Option<[f64; 3]> {
        let half = size.map(|side| 0.5 * side);
        let mut best: Option<(f64, [f64; 3])> = None;
        for column in 0..self.columns {
            let north = self.home_mm[0] - self.step_mm * column as f64;
            let sides = [north - half[1], north + half[1]];
            let Some(out) = self.outwards([-half[0], half[0]], sides) else {
                continue;
            };
            for row in 0..self.rows {
                let up = self.height_of(row) - self.home_mm[1];
                let far = north.hypot(up);
                let nearer = best.is_none_or(|(best, _)| far < best);
                if nearer && self.reaches_all(out, [up - half[2], up + half[2]]) {
                    best = Some((far, [0.0, north, up]));
                }
            }
        }
        best.map(|(_, middle)| middle)
    }

    /// Returns the nearest and farthest distance from the axis in a rectangle east and north of the
    /// home pose, mm; `None` if the first joint does not turn that far.
    fn outwards(&self, [west, east]: [f64; 2], [south, north]: [f64; 2]) -> Option<[f64; 2]> {
        // The user faces the device: north is towards the base's axis.
        let [near, far] = [self.home_mm[0] - north, self.home_mm[0] - south];
        if near.is_nan() || near <= 0.0 {
            return None;
        }
        let turned = [west, east].map(|east| east.atan2(near));
        if turned[0] < self.turn_rad[0] || turned[1] > self.turn_rad[1] {
            return None;
        }
        let aside = if west <= 0.0 && east >= 0.0 {
            0.0
        } else {
            west.abs().min(east.abs())
        };
        Some([near.hypot(aside), far.hypot(west.abs().max(east.abs()))])
    }

    fn height_of(&self, row: usize) -> f64 {
        self.step_mm * (row as f64 - PLACES as f64)
    }

    /// Returns true if a rectangle of the profile is reachable, with all places around it:
    /// distances from the axis and heights over the home pose, mm.
    fn reaches_all(&self, out_mm: [f64; 2], up_mm: [f64; 2]) -> bool {
        let place = |mm: f64| mm / self.step_mm;
        let columns = [place(out_mm[0]).floor(), place(out_mm[1]).ceil()];
        let up = up_mm.map(|up| up + self.home_mm[1]);
        let rows = [place(up[0]).floor(), place(up[1]).ceil()].map(|row| row + PLACES as f64);
        let inside = columns[0] >= 0.0
            && columns[1] < self.columns as f64
            && rows[0] >= 0.0
            && rows[1] < self.rows as f64;
        // All four are whole numbers not below zero here.
        inside && self.missing_in(columns.map(|c| c as usize), rows.map(|r| r as usize)) == 0
    }

    /// Returns the number of unreachable places in a rectangle, ends included.
    fn missing_in(&self, columns: [usize; 2], rows: [usize; 2]) -> u32 {
        let until = |column: usize, row: usize| {
            let index = row * (self.columns + 1) + column;
            self.missing.get(index).copied().unwrap_or(u32::MAX)
        };
        let ([west, east], [low, high]) = ([columns[0], columns[1] + 1], [rows[0], rows[1] + 1]);
        (until(east, high).wrapping_add(until(west, low)))
            .wrapping_sub(until(west, high).wrapping_add(until(east, low)))
    }

    /// Returns the number of unreachable places before each column and row.
    fn sums(&self, record: &Calibration, nearest_mm: f64) -> Vec<u32> {
        let width = self.columns + 1;
        let mut sums = vec![0; width * (self.rows + 1)];
        for row in 0..self.rows {
            let mut along = 0;
            for column in 0..self.columns {
                let out = self.step_mm * column as f64;
                let reached = out >= nearest_mm && is_reached(record, out, self.height_of(row));
                along += u32::from(!reached);
                let below = sums[row * width + column + 1];
                sums[(row + 1) * width + column + 1] = below + along;
            }
        }
        sums
    }
}

/// Returns true if a pose inside the stops, with the margin, has its tip at a distance from the
/// axis and a height, mm.
fn is_reached(record: &Calibration, out_mm: f64, up_mm: f64) -> bool {
    // Straight ahead if the first joint's stops allow it, otherwise the nearest allowed angle.
    let limits = &record.limits;
    // `clamp` would panic on a calibration with exchanged limits.
    let turn = 0.0_f32.max(limits.min_rad.x).min(limits.max_rad.x);
    let (sin, cos) = turn.sin_cos();
    let out = out_mm as f32;
    let tip = Vec3::new(out * cos, out * sin, up_mm as f32);
    let inner = |q: &Vec3| {
        let rest = Vec3::new(0.5 * (limits.min_rad.x + limits.max_rad.x), q.y, q.z);
        limits.contains(rest, -MARGIN_RAD)
    };
    record.joints_at(tip).ok().filter(inner).is_some()
}

fn resolution_mm(record: &Calibration) -> f64 {
    let levers = Vec3::new(record.l1_mm, record.l1_mm, record.l2_mm);
    let counts = record.counts_per_radian().abs();
    f64::from((levers / counts).max_element())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::phantom::Pose;

    const PRESETS: [Calibration; 4] = [
        Calibration::PREMIUM_1_0,
        Calibration::PREMIUM_1_5,
        Calibration::PREMIUM_3_0,
        Calibration::OMNI,
    ];

    #[test]
    fn every_point_of_a_contained_box_is_reachable() {
        for record in PRESETS {
            let (reach, whole) = (Reach::of(&record), f64::from(record.l1_mm + record.l2_mm));
            let home = Pose::from_angles(&record, Vec3::ZERO).tip_mm();
            for share in [[0.7, 0.3, 0.1], [0.2, 0.4, 0.2], [0.1, 0.1, 0.5]] {
                let size = share.map(|share| share * whole);
                let middle = reach.middle_of(size).expect("in reach");
                let held = ReachBox::around(middle, size);
                for place in 0..1000 {
                    let steps = [place % 10, place / 10 % 10, place / 100];
                    let [east, north, up] = [0, 1, 2].map(|axis| {
                        let share = f64::from(steps[axis]) / 9.0;
                        (held.low[axis] + share * (held.high[axis] - held.low[axis])) as f32
                    });
                    let tip = home + Vec3::new(-north, east, up);
                    let q = record.joints_at(tip).expect("reached");
                    assert!(record.limits.contains(q, -0.5 * MARGIN_RAD), "{tip} {q}");
                }
            }
        }
    }

    /// Checked against poses of all joints within their stops.
    #[test]
    fn workspace_sides_enclose_all_poses_tightly() {
        for record in PRESETS {
            let reach = Reach::of(&record);
            let home = Pose::from_angles(&record, Vec3::ZERO).tip_mm();
            let nearest = MIN_AXIS_SHARE * f64::from(record.l1_mm + record.l2_mm);
            let mut found = [0.0_f64; 4];
            for pose in 0..41 * 41 * 41 {
                let steps = [pose % 41, pose / 41 % 41, pose / 1681].map(|step| step as f32 / 40.0);
                let limits = &record.limits;
                let angles = limits.min_rad + Vec3::from(steps) * (limits.max_rad - limits.min_rad);
                let tip = Pose::from_angles(&record, angles).tip_mm();
                let out = f64::from(tip.x.hypot(tip.y));
                if !limits.contains(angles, -MARGIN_RAD) || out < nearest {
                    continue;
                }
                let from_home = tip - home;
                let [east, north] = [from_home.y, -from_home.x].map(f64::from);
                found = [
                    found[0].min(east),
                    found[1].min(north),
                    found[2].max(east),
                    found[3].max(north),
                ];
            }
            for (side, (found, expected)) in found.iter().zip(reach.sides_mm()).enumerate() {
                let outwards = if side < 2 {
                    found - expected
                } else {
                    expected - found
                };
                let room = -reach.step_mm..3.0 * reach.step_mm;
                assert!(
                    room.contains(&outwards),
                    "side {side}: {found} and {expected}"
                );
            }
        }
    }

    #[test]
    fn boxes_beyond_links_or_behind_base_are_out_of_reach() {
        let reach = Reach::of(&Calibration::PREMIUM_1_5);
        for (middle, size) in [
            ([0.0, 0.0, 0.0], [900.0, 10.0, 10.0]),
            ([0.0, 0.0, 0.0], [10.0, 10.0, 900.0]),
            ([0.0, 400.0, 0.0], [10.0, 10.0, 10.0]),
            ([0.0, -400.0, 0.0], [10.0, 10.0, 10.0]),
            ([f64::NAN, 0.0, 0.0], [10.0, 10.0, 10.0]),
        ] {
            assert!(
                !reach.contains(&ReachBox::around(middle, size)),
                "{middle:?} {size:?}"
            );
        }
        assert_eq!(reach.middle_of([900.0, 10.0, 10.0]), None);
        assert!(reach.contains(&ReachBox::around([0.0; 3], [40.0, 20.0, 20.0])));
        assert!(
            (300.0..750.0).contains(&reach.height_mm()),
            "{}",
            reach.height_mm()
        );
    }

    #[test]
    fn invalid_record_has_an_empty_workspace() {
        for bad in [f32::NAN, f32::INFINITY, 0.0, -200.0] {
            let mut record = Calibration {
                l1_mm: bad,
                l2_mm: bad,
                ..Calibration::PREMIUM_1_5
            };
            assert_eq!(Reach::of(&record).middle_of([1.0; 3]), None, "{bad}");
            record = Calibration::PREMIUM_1_5;
            record.limits.min_rad.x = f32::NAN;
            assert_eq!(Reach::of(&record).middle_of([1.0; 3]), None);
            record.limits.min_rad.x = 3.0;
            assert_eq!(Reach::of(&record).middle_of([1.0; 3]), None);
        }
    }

    /// The numbers of docs/how-to/place-and-scale.md.
    #[test]
    fn encoder_resolution_matches_the_docs() {
        let counts = PRESETS.map(|record| Reach::of(&record).resolution_mm());
        for (found, expected) in counts.into_iter().zip([0.0192, 0.0287, 0.0202, 0.055]) {
            assert!(
                (found / expected - 1.0).abs() < 0.01,
                "{found} for {expected}"
            );
        }
    }
}
