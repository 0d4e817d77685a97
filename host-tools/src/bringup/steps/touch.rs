//! The first touch: a soft plane with a force of at most 0.5 N.

use hapterra_core::guard::Fault;
use hapterra_core::scene::TickRecord;
use hapterra_core::wire::request::Request;

use super::{Board, Halt, plane};
use crate::bringup::attendant::{Attendant, Question, Task};
use crate::bringup::finding::Finding;

/// Distance of the plane below the tip, mm.
const BELOW_MM: f32 = 20.0;
/// Depth to which the tip must be pushed, mm.
const DEEP_MM: f32 = 5.0;
/// Largest increase of depth between two status requests while the tip is at rest, mm.
const STILL_MM: f32 = 0.1;
/// Maximum status requests, 0.1 s apart.
const MAX_POLLS: usize = 600;

/// Contact with the plane.
#[derive(Default)]
struct PlaneContact {
    /// Maximum depth of the HIP below the proxy, mm, and the upward force there, N.
    deepest: (f32, f32),
    /// Maximum force, N.
    max_n: f32,
    /// Present force, N.
    now_n: f32,
    /// Maximum depth at the last status request, mm.
    polled_depth_mm: f32,
}

impl PlaneContact {
    fn add(&mut self, sample: &TickRecord) {
        self.now_n = sample.force_n.length();
        self.max_n = self.max_n.max(self.now_n);
        let depth_mm = plane::depth_mm(sample);
        if depth_mm > self.deepest.0 {
            self.deepest = (depth_mm, sample.force_n.z);
        }
    }
}

/// Lets the user lower the tip into the plane, lift it and press the stop.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    super::armed_over_plane(board, attendant, BELOW_MM)?;
    let contact = wait_for_touch(board, attendant)?;
    let (depth_mm, up_n) = contact.deepest;
    let params = plane::SOFT;
    let expected_n = (params.stiffness_n_per_mm * depth_mm).min(params.max_force_n);
    let pushed = (0.5 * expected_n..=1.1 * expected_n).contains(&up_n);
    if !pushed || contact.max_n > 1.01 * params.max_force_n {
        return Err(Finding::NoFloor.into());
    }
    board.expect_fault(attendant, Task::PressStop, Fault::EmergencyStop)?;
    let released = |s: &hapterra_core::wire::status::Status| !s.health.sense.dead_man;
    board.wait_for_task(attendant, Task::ReleaseDeadMan, released)?;
    board.disarm_and_clear()?;
    // The arm is disarmed during the question, because the host does not supervise the board while
    // it waits.
    if !attendant.confirm(Question::StopCutsPower)? {
        return Err(Finding::StopLeavesPower.into());
    }
    board.wait_for_task(attendant, Task::ReleaseStop, |s| {
        !s.health.sense.emergency_stop
    })?;
    board.disarm_and_clear()?;
    if !attendant.confirm(Question::PushedBack)? {
        return Err(Finding::NoFloor.into());
    }
    Ok(format!(
        "{depth_mm:.1} mm deep the floor pushed up with {up_n:.2} N; the emergency stop caused fault 5"
    ))
}

/// Condition for the end of a move.
type IsDone = fn(&PlaneContact) -> bool;

/// Waits until the tip is deep enough, and then until it has no force.
fn wait_for_touch(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<PlaneContact, Halt> {
    let mut contact = PlaneContact::default();
    // Deep enough and at rest.
    let deep = |contact: &PlaneContact| {
        contact.deepest.0 >= DEEP_MM && contact.deepest.0 - contact.polled_depth_mm < STILL_MM
    };
    let free = |contact: &PlaneContact| contact.now_n == 0.0;
    let moves = [Task::LowerTip, Task::LiftTip];
    for (task, done) in moves.into_iter().zip([deep as IsDone, free]) {
        attendant.begin(task);
        for poll in 0.. {
            let status = board.poll_status_with(&mut |sample| contact.add(sample))?;
            if let Some(fault) = status.health.report.fault {
                return Err(Finding::Fault(fault).into());
            }
            if done(&contact) {
                break;
            }
            contact.polled_depth_mm = contact.deepest.0;
            if poll > MAX_POLLS {
                board.request(&Request::Disarm)?;
                return Err(Finding::NotDetected(task).into());
            }
        }
    }
    Ok(contact)
}
