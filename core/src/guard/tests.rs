//! The guard tick by tick; the test provides its surroundings.

mod feedback;
mod hold;

use std::vec::Vec;

use super::*;
use crate::phantom::Calibration;

/// A guard and its inputs.
struct Bench {
    guard: Guard,
    mechanism: Kinematics,
    sense: GuardInputs,
    zeroed: bool,
    scene: SceneKind,
    watchdog_live: bool,
    calibrated: bool,
    target_n: Vec3,
    force_n: Vec3,
    modes: Vec<Mode>,
}

impl Bench {
    fn new() -> Self {
        Self::at(TickRate::DEFAULT)
    }

    fn at(rate: TickRate) -> Self {
        let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5).expect("valid");
        let mut guard = Guard::new(rate, None);
        guard.configure(&mechanism);
        Self {
            guard,
            mechanism,
            sense: GuardInputs::default(),
            zeroed: true,
            scene: SceneKind::Arm,
            watchdog_live: true,
            calibrated: true,
            target_n: Vec3::ZERO,
            force_n: Vec3::ZERO,
            modes: Vec::from([Mode::Disarmed]),
        }
    }

    /// Runs a tick in the order of the loop.
    fn tick(&mut self) -> GuardOutputs {
        let pose = self.mechanism.pose(self.sense.counts, [0; 3]);
        let around = Surroundings {
            arm: self.calibrated.then_some((&self.mechanism, &pose)),
            zeroed: self.zeroed,
            scene: self.scene,
            watchdog_live: self.watchdog_live,
        };
        let lost = self.guard.watch(&self.sense, &around);
        self.note();
        self.force_n = self.guard.limit_force(self.target_n);
        self.note();
        let torques = pose.torques_nm(self.force_n);
        let drive = self
            .guard
            .limit_currents(self.mechanism.currents_a(torques));
        self.note();
        self.zeroed &= !lost;
        assert_eq!(drive.enabled, self.guard.mode().is_driving());
        assert!(drive.enabled || drive == GuardOutputs::default());
        drive
    }

    fn note(&mut self) {
        let mode = self.guard.mode();
        if self.modes.last() != Some(&mode) {
            self.modes.push(mode);
        }
    }

    fn ticks(&mut self, n: u32) {
        for _ in 0..n {
            self.tick();
        }
    }

    fn armed() -> Self {
        let mut bench = Self::new();
        bench.arm();
        bench
    }

    fn arm(&mut self) {
        self.guard.arm();
        self.sense.dead_man = false;
        self.tick();
        self.sense.dead_man = true;
        self.ticks(2_200);
        assert_eq!(self.guard.mode(), Mode::Armed);
    }

    fn blockers(&mut self) -> Blockers {
        self.tick();
        self.guard.report().blockers
    }
}

/// Safety: 1.
#[test]
fn guard_boots_disarmed_and_stays_so_for_any_force() {
    let mut bench = Bench::new();
    bench.target_n = Vec3::new(3.0, 2.0, 1.0);
    for dead_man in [false, true, false, true] {
        bench.sense.dead_man = dead_man;
        bench.ticks(1_000);
    }
    assert_eq!(bench.modes, [Mode::Disarmed]);
}

/// Safety: 1.
#[test]
fn each_blocker_alone_refuses_arming_and_is_reported() {
    type Case = (fn(&mut Bench), Blockers);
    let cases: [Case; 11] = [
        (|b| b.calibrated = false, Blockers::NO_CALIBRATION),
        (|b| b.zeroed = false, Blockers::NOT_ZEROED),
        (|b| b.scene = SceneKind::None, Blockers::NO_SCENE),
        (|b| b.scene = SceneKind::Points, Blockers::REPLAY),
        (|b| b.guard.trip(Fault::Hardware), Blockers::FAULT_LATCHED),
        (|b| b.sense.emergency_stop = true, Blockers::EMERGENCY_STOP),
        (|b| b.sense.hardware_failed = true, Blockers::HARDWARE),
        (
            |b| b.sense.outputs_not_as_set = true,
            Blockers::OUTPUTS_NOT_AS_SET,
        ),
        (
            |b| b.sense.amplifier_not_ready = true,
            Blockers::AMPLIFIER_NOT_READY,
        ),
        (
            |b| b.sense.counts = [0, 40_000, 0],
            Blockers::OUTSIDE_LIMITS,
        ),
        (|b| b.watchdog_live = false, Blockers::WATCHDOG_NOT_LIVE),
    ];
    for (spoil, blocker) in cases {
        let mut bench = Bench::new();
        spoil(&mut bench);
        bench.guard.arm();
        bench.ticks(60);
        let report = bench.guard.report();
        assert_eq!(report.mode, Mode::Disarmed, "{blocker:?}");
        assert_eq!(report.decision.count, 1, "{blocker:?}");
        assert_eq!(report.decision.refused, blocker);
        let by_hand = Blockers::HOST_DISARMED | Blockers::DEAD_MAN_RELEASED;
        assert_eq!(report.blockers, blocker | by_hand);
        // A press of the switch now changes nothing.
        bench.sense.dead_man = true;
        bench.ticks(3_000);
        assert_eq!(bench.guard.mode(), Mode::Disarmed, "{blocker:?}");
    }
}

/// Safety: 2.
#[test]
fn dead_man_switch_held_since_boot_does_not_arm() {
    let mut bench = Bench::new();
    bench.sense.dead_man = true;
    bench.ticks(10);
    bench.guard.arm();
    bench.ticks(20_000);
    assert_eq!(bench.guard.mode(), Mode::Requested);
    assert_eq!(bench.blockers(), Blockers::DEAD_MAN_STILL_HELD);
    bench.sense.dead_man = false;
    assert_eq!(bench.blockers(), Blockers::DEAD_MAN_RELEASED);
    bench.sense.dead_man = true;
    bench.ticks(2_200);
    assert_eq!(bench.guard.mode(), Mode::Armed);
    let modes = [
        Mode::Disarmed,
        Mode::Requested,
        Mode::Confirming,
        Mode::Ramping,
        Mode::Armed,
    ];
    assert_eq!(bench.modes, modes);
}

#[test]
fn arm_request_times_out_without_a_press() {
    let mut bench = Bench::new();
    bench.guard.arm();
    bench.ticks(30_002);
    assert_eq!(bench.guard.mode(), Mode::Disarmed);
    assert!(
        bench.guard.report().decision.refused.is_empty(),
        "granted before"
    );
    bench.sense.dead_man = true;
    bench.ticks(3_000);
    assert_eq!(bench.guard.mode(), Mode::Disarmed);
}

#[test]
fn confirming_requires_small_force_and_dead_man_press() {
    let mut bench = Bench::new();
    bench.target_n = Vec3::Z * 0.25;
    bench.guard.arm();
    bench.tick();
    bench.sense.dead_man = true;
    bench.ticks(5_000);
    assert_eq!(bench.guard.mode(), Mode::Confirming);
    assert_eq!(bench.blockers(), Blockers::FORCE_TOO_LARGE);
    bench.sense.dead_man = false;
    bench.tick();
    assert_eq!(
        (bench.guard.mode(), bench.guard.report().fault),
        (Mode::Requested, None)
    );
    bench.sense.dead_man = true;
    bench.target_n = Vec3::Z * 0.2;
    // A large force in between restarts the hundred ticks.
    bench.ticks(90);
    bench.target_n = Vec3::Z;
    bench.tick();
    bench.target_n = Vec3::ZERO;
    bench.ticks(99);
    assert_eq!(bench.guard.mode(), Mode::Confirming);
    bench.ticks(2);
    assert_eq!(bench.guard.mode(), Mode::Ramping);
}

#[test]
fn force_ramp_takes_two_seconds_at_any_tick_rate() {
    for khz in [1u32, 10] {
        let rate = TickRate::new(khz * 1_000).expect("in range");
        let mut bench = Bench::at(rate);
        bench.guard.arm();
        bench.tick();
        bench.sense.dead_man = true;
        while bench.guard.mode() != Mode::Ramping {
            bench.tick();
        }
        bench.target_n = Vec3::Z * 2.0;
        bench.ticks(1_000 * khz);
        assert!((bench.force_n.z - 1.0).abs() < 0.01, "{}", bench.force_n);
        assert!(bench.guard.report().limits.contains(Limits::RAMPING));
        bench.ticks(1_000 * khz + 2);
        assert_eq!(bench.guard.mode(), Mode::Armed);
        assert!((bench.force_n.z - 2.0).abs() < 1e-5);
        assert_eq!(bench.guard.report().limits, Limits::empty());
    }
}

#[test]
fn modes_change_only_through_their_listed_exits() {
    let mut dice = 7u32;
    let mut random = move |n: u32| {
        dice = dice.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (dice >> 8) % n
    };
    let mut bench = Bench::new();
    for _ in 0..600 {
        // Through the modes of arming, as far as possible.
        bench.guard.clear();
        bench.note();
        bench.watchdog_live = true;
        bench.scene = SceneKind::Arm;
        bench.sense.emergency_stop = false;
        bench.sense.dead_man = false;
        bench.guard.arm();
        bench.ticks(1 + random(3));
        bench.sense.dead_man = random(4) > 0;
        let far = [1, 90, 2_000, 2_500][random(4) as usize];
        bench.ticks(random(far));
        match random(9) {
            0 => bench.guard.arm(),
            1 => bench.guard.disarm(),
            2 => bench.guard.clear(),
            3 => bench.sense.emergency_stop = true,
            4 => bench.watchdog_live = false,
            5 => bench.scene = SceneKind::None,
            6 => bench.target_n = Vec3::Z * random(3) as f32,
            7 => bench.sense.dead_man = false,
            _ => {}
        }
        bench.note();
        bench.ticks(random(150));
        bench.target_n = Vec3::ZERO;
    }
    let mut taken = std::collections::HashSet::new();
    for pair in bench.modes.windows(2) {
        assert!(pair[0].exits().contains(&pair[1]), "{pair:?}");
        taken.insert((pair[0], pair[1]));
    }
    let all = [
        Mode::Disarmed,
        Mode::Requested,
        Mode::Confirming,
        Mode::Ramping,
        Mode::Armed,
        Mode::Fading,
    ];
    let listed: usize = all.iter().map(|mode| mode.exits().len()).sum();
    assert_eq!(taken.len(), listed, "exits that are listed and never taken");
}

/// Failures while armed, and the faults that they must latch within the tick.
///
/// Safety: 13, response times.
#[test]
fn each_fault_switches_off_in_its_tick_and_latches() {
    type Case = (fn(&mut Bench), Fault);
    let cases: [Case; 10] = [
        (|b| b.sense.dead_man = false, Fault::DeadManReleased),
        (|b| b.sense.emergency_stop = true, Fault::EmergencyStop),
        (|b| b.sense.hardware_failed = true, Fault::Hardware),
        (
            |b| b.sense.outputs_not_as_set = true,
            Fault::OutputsNotAsSet,
        ),
        (|b| b.watchdog_live = false, Fault::TaskStalled),
        (|b| b.sense.counts[1] += 129, Fault::EncoderJump),
        (|b| b.target_n.x = f32::NAN, Fault::NotANumber),
        (|b| b.target_n.z = f32::INFINITY, Fault::NotANumber),
        (|b| b.guard.trip(Fault::TickOverrun), Fault::TickOverrun),
        (|b| b.calibrated = false, Fault::CalibrationCorrupt),
    ];
    for (spoil, fault) in cases {
        let mut bench = Bench::armed();
        bench.target_n = Vec3::Z * 2.0;
        bench.ticks(10);
        let before = bench.sense;
        spoil(&mut bench);
        assert_eq!(bench.tick(), GuardOutputs::default(), "{fault:?}");
        assert_eq!(bench.guard.report().fault, Some(fault));
        assert_eq!(bench.force_n, Vec3::ZERO);
        // The cause has ended; the fault stays.
        bench.sense = before;
        (bench.watchdog_live, bench.calibrated) = (true, true);
        bench.target_n = Vec3::ZERO;
        bench.ticks(3_000);
        assert_eq!(bench.guard.report().fault, Some(fault));
        bench.guard.arm();
        bench.ticks(3_000);
        assert_eq!(bench.guard.mode(), Mode::Disarmed, "{fault:?}");
        // After the clear it is still off; only a new request and a new press arm.
        bench.guard.clear();
        bench.ticks(3_000);
        assert_eq!(
            (bench.guard.report().fault, bench.guard.mode()),
            (None, Mode::Disarmed)
        );
        bench.zeroed = true;
        bench.arm();
    }
}

#[test]
fn first_fault_is_kept() {
    let mut bench = Bench::armed();
    bench.sense.emergency_stop = true;
    bench.sense.dead_man = false;
    bench.tick();
    bench.sense.counts = [5_000, 0, 0];
    bench.tick();
    assert_eq!(bench.guard.report().fault, Some(Fault::EmergencyStop));
}

/// Safety: 8, response times.
#[test]
fn joint_limits_and_linkage_trip_while_armed() {
    // Turned outwards slowly until a fault: a count is 0.1 mrad.
    let turned = |axis: usize, sign: i32| {
        let mut bench = Bench::armed();
        while bench.guard.report().fault.is_none() {
            bench.sense.counts[axis] += sign * 5;
            bench.tick();
        }
        let q = bench.mechanism.angles(bench.sense.counts, [0; 3]);
        (bench.guard.report().fault, q[axis].to_degrees().abs())
    };
    let (fault, degrees) = turned(0, 1);
    assert_eq!(fault, Some(Fault::JointLimit));
    assert!((94.9..95.1).contains(&degrees), "{degrees}");
    assert_eq!(turned(0, -1).0, Some(Fault::JointLimit));
    let (fault, degrees) = turned(1, 1);
    assert_eq!(fault, Some(Fault::Linkage));
    assert!((69.9..70.1).contains(&degrees), "{degrees}");
    assert_eq!(turned(2, 1).0, Some(Fault::Linkage));
    assert_eq!(turned(2, -1).0, Some(Fault::JointLimit));
}

/// Safety: 8.
#[test]
fn encoder_jump_of_a_zeroed_arm_faults_and_clears_the_zero() {
    let mut bench = Bench::new();
    bench.zeroed = false;
    bench.sense.counts = [100_000, 0, 0];
    bench.tick();
    bench.sense.counts = [0; 3];
    bench.tick();
    assert_eq!(bench.guard.report().fault, None, "nothing is measured yet");
    bench.zeroed = true;
    bench.ticks(2);
    bench.sense.counts = [128, -128, 0];
    bench.tick();
    assert_eq!(bench.guard.report().fault, None);
    bench.sense.counts = [128, 1, 0];
    bench.tick();
    assert_eq!(bench.guard.report().fault, Some(Fault::EncoderJump));
    assert!(!bench.zeroed);
}

#[test]
fn encoder_jump_limit_scales_with_the_tick_period() {
    let mut bench = Bench::at(TickRate::new(10_000).expect("in range"));
    bench.tick();
    bench.sense.counts[0] += 13;
    bench.tick();
    assert_eq!(bench.guard.report().fault, None);
    bench.sense.counts[0] += 14;
    bench.tick();
    assert_eq!(bench.guard.report().fault, Some(Fault::EncoderJump));
}

/// Safety: 10.
#[test]
fn force_clamp_keeps_direction_and_is_reported() {
    let mut bench = Bench::armed();
    bench.target_n = Vec3::new(30.0, -40.0, 0.0);
    bench.ticks(20);
    assert!(bench.force_n.length() <= 7.65 && bench.force_n.length() > 7.649);
    let direction = Vec3::new(0.6, -0.8, 0.0);
    assert!((bench.force_n - 7.65 * direction).length() < 1e-4);
    assert!(bench.guard.report().limits.contains(Limits::FORCE_CLAMPED));
}

/// Safety: 10.
#[test]
fn slew_limit_bounds_force_change_and_is_reported() {
    let mut bench = Bench::armed();
    bench.target_n = Vec3::Z * 2.5;
    bench.tick();
    assert!((bench.force_n.z - 1.0).abs() < 1e-6);
    assert_eq!(bench.guard.report().limits, Limits::SLEW_LIMITED);
    bench.ticks(2);
    assert!((bench.force_n.z - 2.5).abs() < 1e-6);
    assert_eq!(bench.guard.report().limits, Limits::empty());
}

/// Safety: 11.
#[test]
fn current_limit_keeps_direction_and_is_reported() {
    let mut bench = Bench::armed();
    let drive = bench.guard.limit_currents(Vec3::new(16.5, -8.25, 1.65));
    assert!((drive.currents_a - Vec3::new(5.5, -2.75, 0.55)).length() < 1e-5);
    assert!(drive.currents_a.abs().max_element() <= 5.5);
    assert!(
        bench
            .guard
            .report()
            .limits
            .contains(Limits::CURRENT_LIMITED)
    );
    let nothing = bench.guard.limit_currents(Vec3::new(f32::NAN, 0.0, 0.0));
    assert_eq!(nothing, GuardOutputs::default());
    assert_eq!(bench.guard.report().fault, Some(Fault::NotANumber));
}

#[test]
fn hard_working_motor_is_derated_below_its_limit() {
    let mut bench = Bench::armed();
    bench.target_n = Vec3::Z * 6.0;
    let mut derated = None;
    for tick in 0..60_000u32 {
        // A hand that trembles: a stationary one would be another fault.
        bench.sense.counts[1] = (tick as i32 / 50) % 2;
        let drive = bench.tick();
        let limits = bench.guard.report().limits;
        if limits.contains(Limits::THERMAL_DERATED) {
            derated = derated.or(Some((tick, drive.currents_a.y)));
        }
    }
    let (tick, current_a) = derated.expect("derated");
    assert!((1_000..60_000).contains(&tick), "{tick}");
    assert!(current_a < 5.5, "{current_a}");
    assert_eq!(bench.guard.report().fault, None);
    let hottest = bench.guard.motors().winding_c().max_element();
    assert!((80.0..110.0).contains(&hottest), "{hottest}");
}

/// Safety: 11, response times.
#[test]
fn winding_above_its_limit_is_a_fault() {
    let mut bench = Bench::armed();
    for _ in 0..60_000 {
        // As if the amplifier drove more than its command.
        bench.guard.motors.heat(Vec3::Y * 5.5);
    }
    assert_eq!(bench.tick(), GuardOutputs::default());
    assert_eq!(bench.guard.report().fault, Some(Fault::MotorTooHot));
    // Cleared while it is hot, it trips again; the temperatures are kept.
    bench.guard.clear();
    bench.tick();
    assert_eq!(bench.guard.report().fault, Some(Fault::MotorTooHot));
}

/// Joint 2 turns by `counts_a_tick` while 1 N is commanded.
fn hurried(counts_a_tick: i32, ticks: u32) -> Bench {
    let mut bench = Bench::armed();
    bench.target_n = Vec3::Z;
    bench.ticks(20);
    for _ in 0..ticks {
        bench.sense.counts[1] += counts_a_tick;
        bench.tick();
    }
    bench
}

/// Safety: 9, response times.
#[test]
fn speed_limit_reduces_force_and_excess_speed_is_a_fault() {
    // 28.7 µm a count: 30 counts a tick are 0.86 m/s, 52 are 1.49, 80 are 2.3.
    let slow = hurried(30, 40);
    assert_eq!(
        (slow.force_n.z, slow.guard.report().limits),
        (1.0, Limits::empty())
    );
    let fast = hurried(52, 40);
    assert!((fast.force_n.z - 0.51).abs() < 0.02, "{}", fast.force_n);
    assert_eq!(fast.guard.report().limits, Limits::SPEED_LIMITED);
    assert_eq!(fast.guard.report().fault, None);
    let thrown = hurried(80, 40);
    assert_eq!(thrown.guard.report().fault, Some(Fault::TooFast));
}

#[test]
fn motor_that_pushes_without_motion_is_a_fault() {
    let mut bench = Bench::armed();
    // 2 N on the lever of joint 2 is 1.6 A, above its continuous current.
    bench.target_n = Vec3::Z * 2.0;
    bench.ticks(1_900);
    assert_eq!(bench.guard.report().fault, None);
    bench.ticks(200);
    assert_eq!(bench.guard.report().fault, Some(Fault::NoMotion));
}

#[test]
fn host_disarm_fades_force_out_without_a_step() {
    let mut bench = Bench::armed();
    bench.target_n = Vec3::new(1.0, 2.0, 6.0);
    bench.ticks(20);
    let full = bench.force_n;
    bench.guard.disarm();
    // The commanded force no longer matters.
    bench.target_n = Vec3::X * 8.0;
    let mut last = full;
    let mut ticks = 0;
    while bench.guard.mode() != Mode::Disarmed {
        bench.tick();
        let step = (bench.force_n - last).length();
        assert!(step <= 0.0101 * full.length(), "{step} N");
        last = bench.force_n;
        ticks += 1;
    }
    assert!((99..=102).contains(&ticks), "{ticks}");
    assert_eq!(bench.guard.report().fault, None);
    // Released during the fade: off at once, without a fault, because the host disarmed first.
    let mut bench = Bench::armed();
    bench.target_n = Vec3::Z;
    bench.ticks(5);
    bench.guard.disarm();
    bench.tick();
    bench.sense.dead_man = false;
    assert_eq!(bench.tick(), GuardOutputs::default());
    assert_eq!(
        (bench.guard.mode(), bench.guard.report().fault),
        (Mode::Disarmed, None)
    );
}

#[test]
fn arming_during_force_fade_out_is_refused() {
    let mut bench = Bench::armed();
    bench.guard.disarm();
    bench.tick();
    bench.guard.arm();
    bench.ticks(300);
    let report = bench.guard.report();
    assert_eq!(report.mode, Mode::Disarmed);
    assert_eq!(report.decision.refused, Blockers::HOST_DISARMED);
}

#[test]
fn fault_found_at_boot_blocks_until_cleared() {
    let mut bench = Bench::new();
    bench.guard = Guard::new(TickRate::DEFAULT, Some(Fault::WatchdogReset));
    bench.guard.configure(&bench.mechanism);
    assert!(bench.blockers().contains(Blockers::FAULT_LATCHED));
    bench.guard.clear();
    bench.arm();
}
