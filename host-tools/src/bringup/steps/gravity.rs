//! Check that the motors carry the arm's weight, with no surface within its workspace.

use std::collections::VecDeque;

use glam::DVec3;
use hapterra_core::guard::Fault;
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::request::Request;

use super::{Board, Halt, plane};
use crate::bringup::attendant::{Attendant, Task};
use crate::bringup::finding::Finding;

/// Distance of the scene's plane below the tip, mm: out of reach.
const OUT_OF_REACH_MM: f32 = 1_000.0;
/// Status requests, 0.1 s apart, for which the tip is released.
const MAX_POLLS: usize = 30;
/// Largest drift of the tip in that time, mm.
const MAX_DRIFT_MM: f64 = 20.0;

/// Speed limit of the released tip, mm/s: half of a jog's.
const MAX_SPEED_MM_S: f64 = 100.0;
/// Interval of the speed estimate, ms.
const SPEED_INTERVAL_MS: u32 = 10;

/// Motion of the tip, from samples.
struct TipMotion {
    ticks_per_ms: u32,
    /// The latest samples: tick, and position of the tip, mm.
    latest: VecDeque<(u32, DVec3)>,
    /// Maximum speed, mm/s.
    max_speed_mm_s: f64,
}

impl TipMotion {
    fn new(tick_hz: u32) -> Self {
        Self {
            ticks_per_ms: (tick_hz / 1000).max(1),
            latest: VecDeque::new(),
            max_speed_mm_s: 0.0,
        }
    }

    /// Adds a sample. Returns true if the tip is too fast.
    fn add(&mut self, sample: &TickRecord) -> bool {
        let now = (sample.tick, plane::hip_mm(sample));
        let since = |then: &(u32, DVec3)| now.0.wrapping_sub(then.0) / self.ticks_per_ms;
        // Keep one sample that is old enough; older ones are not needed.
        while self
            .latest
            .get(1)
            .is_some_and(|then| since(then) >= SPEED_INTERVAL_MS)
        {
            self.latest.pop_front();
        }
        let then = self
            .latest
            .front()
            .filter(|then| since(then) >= SPEED_INTERVAL_MS);
        if let Some(then) = then {
            let mm_s = 1e3 * now.1.distance(then.1) / f64::from(since(then));
            self.max_speed_mm_s = self.max_speed_mm_s.max(mm_s);
        }
        self.latest.push_back(now);
        self.max_speed_mm_s > MAX_SPEED_MM_S
    }
}

/// Checks that the released tip stays in place, and then that releasing the switch ends the force.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    let record = super::armed_over_plane(board, attendant, OUT_OF_REACH_MM)?;
    let from = plane::tip_mm(&record, &board.poll_status()?);
    attendant.begin(Task::ReleaseTip);
    let mut motion = TipMotion::new(board.device().tick_hz);
    let mut drift_mm = 0.0_f64;
    for poll in 1..=MAX_POLLS {
        let status = board.poll_status_until(&mut |sample| motion.add(sample))?;
        if let Some(fault) = status.health.report.fault {
            return Err(Finding::Fault(fault).into());
        }
        drift_mm = drift_mm.max(from.distance(plane::tip_mm(&record, &status)));
        let finding = match motion.max_speed_mm_s {
            mm_s if mm_s > MAX_SPEED_MM_S => Finding::MovesByItself { mm_s },
            _ if drift_mm > MAX_DRIFT_MM => Finding::Drifts {
                mm: drift_mm,
                seconds: 0.1 * poll as f64,
            },
            _ => continue,
        };
        board.request(&Request::Disarm)?;
        attendant.begin(Task::HoldTip);
        return Err(finding.into());
    }
    attendant.begin(Task::HoldTip);
    board.expect_fault(attendant, Task::ReleaseDeadMan, Fault::DeadManReleased)?;
    board.disarm_and_clear()?;
    Ok(format!(
        "the tip stayed within {drift_mm:.1} mm for 3 s; releasing the switch caused fault 6"
    ))
}
