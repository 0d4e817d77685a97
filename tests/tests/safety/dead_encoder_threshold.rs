//! Travel of the other joints while one does not move by a count, with working encoders: the guard
//! must accept it before it reports a dead encoder.

use std::f64::consts::TAU;

use hapterra::phantom::{HandModel, PhantomModel, Plant, kinematics};
use hapterra_core::guard::MAX_OTHERS_TRAVEL;

/// Frequency of the tremor in each axis, Hz.
const TREMOR_HZ: [f64; 3] = [8.3, 9.7, 11.2];
const TICK_S: f64 = 1e-3;

/// Most counts that the others travelled while a joint stayed within a count of its position.
#[derive(Default)]
struct TravelWhileStill {
    at: [i32; 3],
    others: [u32; 3],
    last: [i32; 3],
    max: [u32; 3],
}

impl TravelWhileStill {
    fn add(&mut self, counts: [i32; 3]) {
        let distance: u32 = (0..3).map(|i| counts[i].abs_diff(self.last[i])).sum();
        self.last = counts;
        for (axis, count) in counts.into_iter().enumerate() {
            if count.abs_diff(self.at[axis]) <= 1 {
                self.others[axis] += distance;
            } else {
                self.at[axis] = count;
                self.others[axis] = 0;
            }
            self.max[axis] = self.max[axis].max(self.others[axis]);
        }
    }
}

/// Moves the tip along `path` (joint angles by time) with a tremor.
fn travel_along(
    path: impl Fn(f64) -> [f64; 3],
    tremor_mm: f64,
    current_a: f64,
    seconds: f64,
) -> [u32; 3] {
    let model = PhantomModel::premium_1_5();
    let mut plant = Plant::new(model, path(0.0)).with_hand(HandModel::default());
    let target = |t: f64| {
        let tip = kinematics::tip(&model, path(t));
        std::array::from_fn(|i| tip[i] + 1e-3 * tremor_mm * (TAU * TREMOR_HZ[i] * t).sin())
    };
    let mut travel = TravelWhileStill::default();
    let ticks = (seconds / TICK_S) as u32;
    for tick in 0..ticks {
        let t = f64::from(tick) * TICK_S;
        let (now, next): ([f64; 3], [f64; 3]) = (target(t), target(t + TICK_S));
        plant.set_target(now, std::array::from_fn(|i| (next[i] - now[i]) / TICK_S));
        plant.step([current_a; 3], TICK_S);
        // The first second is for settling.
        if tick == 1_000 {
            travel = TravelWhileStill {
                at: plant.counts(),
                last: plant.counts(),
                ..TravelWhileStill::default()
            };
        }
        travel.add(plant.counts());
    }
    travel.max
}

/// Checks that the guard accepts three times the travel of a hand.
fn assert_passes(what: &str, max: [u32; 3]) {
    eprintln!("{what}: {max:?} counts");
    let allowed = MAX_OTHERS_TRAVEL / 3;
    assert!(max.iter().all(|max| *max <= allowed), "{what}: {max:?}");
}

/// The hardest case: only the tremor moves the other joints.
///
/// Safety: 8.
#[test]
fn tremor_prevents_dead_encoder_fault_on_one_joint_motion() {
    let ways = [(0.1, 0.3), (0.3, 0.3), (0.8, 0.3), (0.5, 0.03)];
    for (tremor_mm, (hz, rad)) in [0.2, 0.4].into_iter().flat_map(|t| ways.map(|w| (t, w))) {
        for joint in 0..3 {
            let path = |t: f64| {
                let mut q = [0.1, 0.2, 0.15];
                q[joint] += rad * (TAU * hz * t).sin();
                q
            };
            let what = format!(
                "tremor {tremor_mm} mm, joint {} by {rad} rad at {hz} Hz",
                joint + 1
            );
            assert_passes(&what, travel_along(path, tremor_mm, 0.7, 30.0));
        }
    }
}

#[test]
fn wandering_hand_causes_no_dead_encoder_fault() {
    let path = |t: f64| {
        [
            0.25 * (1.9 * t).sin() + 0.1 * (4.1 * t).sin(),
            0.2 + 0.15 * (1.3 * t).sin(),
            0.15 + 0.2 * (2.3 * t + 1.0).sin(),
        ]
    };
    assert_passes("wandering", travel_along(path, 0.0, 0.7, 60.0));
}
