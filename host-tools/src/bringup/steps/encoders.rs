//! Check of the encoders: each joint is moved by hand, forth and back.

use super::{Board, Halt};
use crate::bringup::attendant::{Attendant, Task};
use crate::bringup::finding::Finding;
use crate::calibrate::Direction;

/// Distance of the move, mm.
const MOVE_MM: u16 = 80;
/// Counts that a working encoder exceeds in this move.
const MIN_LIVE_COUNTS: u32 = 400;
/// Largest relative difference of forth and back: a hand returns to the zero pose no better.
const MAX_LOSS_SHARE: f64 = 0.1;

/// Checks the encoders while the tip is moved right, up and towards the user, and back.
pub(super) fn check(
    board: &mut Board<'_, '_>,
    attendant: &mut dyn Attendant,
) -> Result<String, Halt> {
    attendant.finish(Task::ZeroPose)?;
    let mut from = board.wait_for_rest(attendant)?;
    let mut reported = Vec::new();
    for (joint, direction) in Direction::ALL.into_iter().enumerate() {
        attendant.finish(Task::MoveAlong(direction, MOVE_MM))?;
        let to = board.wait_for_rest(attendant)?;
        attendant.finish(Task::ZeroPose)?;
        let again = board.wait_for_rest(attendant)?;
        let (there, back) = (moved(from, to), moved(to, again));
        check_joint(joint, there, back)?;
        reported.push(format!("joint {}: {:+} counts", joint + 1, there[joint]));
        from = again;
    }
    Ok(reported.join(", "))
}

fn moved(from: [i32; 3], to: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|i| to[i].wrapping_sub(from[i]))
}

/// Checks the encoder of the moved joint (0 to 2).
fn check_joint(joint: usize, there: [i32; 3], back: [i32; 3]) -> Result<(), Finding> {
    let max_joint = (0..3).max_by_key(|i| there[*i].unsigned_abs());
    let max_joint = max_joint.unwrap_or(joint);
    let counts = there[joint];
    let is_live = counts.unsigned_abs() > MIN_LIVE_COUNTS / 10;
    if max_joint != joint && is_live && there[max_joint].unsigned_abs() > MIN_LIVE_COUNTS {
        return Err(Finding::SwappedEncoders {
            joint: joint + 1,
            encoder: max_joint + 1,
        });
    }
    // A joint's encoder that does not count is dead, even if others count.
    if counts.unsigned_abs() <= MIN_LIVE_COUNTS {
        return Err(Finding::DeadEncoder {
            joint: joint + 1,
            counts,
        });
    }
    let error = (f64::from(counts) + f64::from(back[joint])).abs();
    if error > MAX_LOSS_SHARE * f64::from(counts).abs() {
        return Err(Finding::CountsLost {
            joint: joint + 1,
            there: counts,
            back: back[joint],
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_encoder_mistake_has_its_own_finding() {
        let back = |there: [i32; 3]| there.map(|counts| -counts);
        let check_joint_2 = |there| check_joint(1, there, back(there));
        assert_eq!(check_joint_2([40, 2_800, 700]), Ok(()));
        assert_eq!(check_joint_2([40, -2_800, 700]), Ok(()));
        let dead = |counts| Err(Finding::DeadEncoder { joint: 2, counts });
        assert_eq!(check_joint_2([0, 0, 0]), dead(0));
        assert_eq!(check_joint_2([40, 1, 700]), dead(1));
        let swapped = Finding::SwappedEncoders {
            joint: 2,
            encoder: 3,
        };
        assert_eq!(check_joint_2([40, 700, 2_800]), Err(swapped));
        // The counts are from the link and may have any value.
        let max_joint = check_joint(1, [0, i32::MAX, 0], [0, i32::MAX, 0]);
        assert!(matches!(
            max_joint,
            Err(Finding::CountsLost { joint: 2, .. })
        ));
        let lost = check_joint(1, [40, 2_800, 700], [-40, -2_000, -700]);
        assert!(matches!(lost, Err(Finding::CountsLost { joint: 2, .. })));
    }
}
