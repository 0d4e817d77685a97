//! Outputs held with the amplifiers off.

use super::*;
use crate::guard::MAX_HOLD_S;

const HELD: Vec3 = Vec3::new(0.5, -0.25, 1.0);

fn holding() -> Bench {
    let mut bench = Bench::new();
    bench.guard.hold(Some(HELD.to_array()));
    bench.tick();
    assert_eq!(bench.guard.held_shares(), HELD);
    assert_eq!(bench.guard.mode(), Mode::Disarmed);
    bench
}

/// Safety: 19.
#[test]
fn outputs_are_held_within_full_scale_for_a_minute_at_most() {
    let mut bench = holding();
    bench.ticks(MAX_HOLD_S * 1_000 - 2);
    assert_eq!(bench.guard.held_shares(), HELD);
    bench.tick();
    assert_eq!(bench.guard.held_shares(), Vec3::ZERO);
    bench.guard.hold(Some([7.0, f32::NEG_INFINITY, 0.0]));
    assert_eq!(bench.guard.held_shares(), Vec3::new(1.0, -1.0, 0.0));
    bench.guard.hold(Some([0.1, f32::NAN, 0.0]));
    assert_eq!(bench.guard.held_shares(), Vec3::ZERO);
}

/// Safety: 19.
#[test]
fn every_other_command_ends_the_hold() {
    let ends: [fn(&mut Bench); 7] = [
        |b| b.guard.hold(None),
        |b| b.guard.arm(),
        |b| b.guard.disarm(),
        |b| b.guard.stop(),
        |b| b.guard.clear(),
        |b| b.guard.trip(Fault::EmergencyStop),
        |b| b.sense.counts[0] += 1_000,
    ];
    for (i, end) in ends.into_iter().enumerate() {
        let mut bench = holding();
        end(&mut bench);
        bench.tick();
        assert_eq!(bench.guard.held_shares(), Vec3::ZERO, "end {i}");
    }
}

/// Safety: 19.
#[test]
fn outputs_are_not_held_while_arming_armed_or_faulted() {
    let mut bench = Bench::new();
    let mut tried = 0;
    bench.guard.arm();
    bench.tick();
    bench.sense.dead_man = true;
    while bench.guard.mode() != Mode::Disarmed {
        bench.guard.hold(Some(HELD.to_array()));
        assert_eq!(
            bench.guard.held_shares(),
            Vec3::ZERO,
            "{:?}",
            bench.guard.mode()
        );
        bench.tick();
        tried += 1;
        if tried == 3_000 {
            assert_eq!(bench.guard.mode(), Mode::Armed);
            bench.sense.emergency_stop = true;
        }
    }
    assert!(tried >= 3_000);
    assert_eq!(bench.guard.report().fault, Some(Fault::EmergencyStop));
    bench.guard.hold(Some(HELD.to_array()));
    assert_eq!(bench.guard.held_shares(), Vec3::ZERO, "a fault is latched");
}
