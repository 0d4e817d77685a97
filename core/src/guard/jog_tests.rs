use std::vec::Vec;

use super::*;
use crate::guard::{Blockers, GuardInputs, GuardOutputs, Mode, Report};
use crate::terrain::TileArena;
use crate::tick::{Command, Haptics};

const RECORD: Calibration = Calibration::PREMIUM_1_5;

/// The loop without a scene, with joints that respond to currents as the test defines.
struct Bench<'t> {
    haptics: Haptics<'t, 1>,
    sense: GuardInputs,
    rate: TickRate,
    drives: Vec<GuardOutputs>,
}

impl<'t> Bench<'t> {
    fn new(storage: &'t mut TileArena<1>, rate: TickRate) -> Self {
        let mut haptics = Haptics::new(storage.slots(), rate, None);
        haptics.configure(Kinematics::new(&RECORD).expect("valid"));
        let mut bench = Self {
            haptics,
            sense: GuardInputs::default(),
            rate,
            drives: Vec::new(),
        };
        bench.send(Command::Zero([0; 3]));
        bench
    }

    fn send(&mut self, command: Command<'t>) {
        assert!(matches!(self.haptics.accept(command), Ok(None)));
    }

    fn report(&self) -> Report {
        self.haptics.report()
    }

    /// Runs a tick; once a millisecond the encoders move as `motion` computes from the currents.
    fn tick(&mut self, motion: impl Fn(Vec3) -> [i32; 3]) -> GuardOutputs {
        let drive = self.haptics.tick(&self.sense, true).drive;
        self.drives.push(drive);
        let is_ms = (self.drives.len() as u32).is_multiple_of(self.rate.ticks(1));
        let moved = motion(drive.currents_a).map(|counts| if is_ms { counts } else { 0 });
        for (count, moved) in self.sense.counts.iter_mut().zip(moved) {
            *count += moved;
        }
        drive
    }

    /// Requests a jog, presses the switch a moment later, and runs for `ms`.
    fn jog(&mut self, jog: Jog, ms: u32, motion: impl Fn(Vec3) -> [i32; 3]) {
        self.send(Command::Jog(jog));
        for tick in 0..self.rate.ticks(ms) {
            self.sense.dead_man = tick > self.rate.ticks(20);
            self.tick(&motion);
        }
    }
}

const JOG: Jog = Jog {
    axis: 1,
    current_a: -0.3,
    hold_ms: 500,
};

/// A held joint: it moves by some counts when the current has overcome its friction.
fn held_joint(current: Vec3) -> [i32; 3] {
    [0, i32::from((0.05..0.052).contains(&-current.y)), 0]
}

/// Safety: 16.
#[test]
fn jog_drives_only_its_motor_at_its_current_and_duration() {
    for rate in [1_000, 10_000].map(|hz| TickRate::new(hz).expect("in range")) {
        let (mut storage, ms) = (TileArena::<1>::new(), rate.ticks(1) as usize);
        let mut bench = Bench::new(&mut storage, rate);
        bench.jog(JOG, 4_000, held_joint);
        assert_eq!(bench.report().fault, None);
        assert_eq!(bench.report().mode, Mode::Disarmed);
        let on = || bench.drives.iter().filter(|drive| drive.enabled);
        assert!(on().all(|drive| drive.currents_a * Vec3::Y == drive.currents_a));
        assert!(on().all(|drive| (-0.3..=0.0).contains(&drive.currents_a.y)));
        // 2 s ramp-up, the requested time, 0.1 s fade-out; and 0.1 s after the press before that.
        let (driven, full) = (on().count(), on().filter(|d| d.currents_a.y < -0.299));
        assert!(driven.abs_diff(2_600 * ms) <= 5 * ms, "{driven}");
        assert!(full.count().abs_diff(508 * ms) <= 5 * ms);
        let steps = bench.drives.windows(2).map(|pair| {
            let [a, b] = [pair[0], pair[1]].map(|drive| drive.currents_a.y);
            (a - b).abs()
        });
        // No step is larger than the fade-out's, 0.3 A in 100 ms.
        let max = steps.fold(0.0, f32::max);
        assert!(max <= 0.3 / (100 * ms) as f32 + 1e-5, "{max}");
    }
}

#[test]
fn jog_needs_a_press_and_is_not_repeated() {
    let mut storage = TileArena::<1>::new();
    let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
    // Without a jog and without a scene, the arm cannot be armed.
    bench.send(Command::Arm);
    (0..100).for_each(|_| _ = bench.tick(held_joint));
    assert!(bench.report().decision.refused.contains(Blockers::NO_SCENE));
    // A switch that was held from the start does not count.
    bench.sense.dead_man = true;
    bench.send(Command::Jog(JOG));
    for _ in 0..1_000 {
        assert!(!bench.tick(held_joint).enabled);
    }
    bench.jog(JOG, 4_000, held_joint);
    assert_eq!(bench.report().mode, Mode::Disarmed);
    assert!(bench.drives.iter().any(|drive| drive.enabled));
    // Another arm command does not repeat the jog.
    bench.drives.clear();
    bench.sense.dead_man = false;
    bench.send(Command::Arm);
    (0..100).for_each(|_| _ = bench.tick(held_joint));
    assert!(bench.report().decision.refused.contains(Blockers::NO_SCENE));
    assert!(bench.drives.iter().all(|drive| !drive.enabled));
}

/// Also without a tick in between, and in the tick after the fade-out.
///
/// Safety: images.
#[test]
fn plain_arm_command_does_not_arm_for_an_earlier_jog() {
    let mut storage = TileArena::<1>::new();
    let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
    for between in [Some(Command::Disarm), None] {
        bench.send(Command::Jog(JOG));
        between.into_iter().for_each(|command| bench.send(command));
        bench.send(Command::Arm);
        (0..100).for_each(|_| _ = bench.tick(held_joint));
        let refused = bench.report().decision.refused;
        assert!(refused.contains(Blockers::NO_SCENE), "{refused:?}");
    }
    bench.jog(JOG, 1_500, held_joint);
    assert!(bench.report().mode.is_driving());
    bench.send(Command::Disarm);
    while bench.report().mode.is_driving() {
        bench.tick(held_joint);
    }
    bench.send(Command::Arm);
    bench.sense.dead_man = false;
    (0..100).for_each(|_| _ = bench.tick(held_joint));
    assert!(bench.report().decision.refused.contains(Blockers::NO_SCENE));
}

#[test]
fn blockers_of_arming_also_block_a_jog() {
    let mut storage = TileArena::<1>::new();
    let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
    bench.sense.emergency_stop = true;
    bench.jog(JOG, 1_000, held_joint);
    let refused = bench.report().decision.refused;
    assert!(refused.contains(Blockers::EMERGENCY_STOP), "{refused:?}");
    bench.sense.emergency_stop = false;
    bench.send(Command::Trip(Fault::Hardware));
    bench.jog(JOG, 1_000, held_joint);
    let refused = bench.report().decision.refused;
    assert!(refused.contains(Blockers::FAULT_LATCHED), "{refused:?}");
    assert!(bench.drives.iter().all(|drive| !drive.enabled));
}

#[test]
fn dead_man_release_ends_a_jog_within_the_tick() {
    let mut storage = TileArena::<1>::new();
    let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
    bench.jog(JOG, 1_500, held_joint);
    assert!(bench.report().mode.is_driving());
    bench.sense.dead_man = false;
    assert_eq!(bench.tick(held_joint), GuardOutputs::default());
    assert_eq!(bench.report().fault, Some(Fault::DeadManReleased));
}

/// Safety: 16.
#[test]
fn runaway_of_any_joint_is_a_fault() {
    for axis in 0..3 {
        for speed in [9, -9, 30, 2] {
            let mut storage = TileArena::<1>::new();
            let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
            // For two of the three, a joint that is not the motor's own.
            bench.jog(JOG, 4_000, |current| {
                let mut moved = held_joint(current);
                moved[axis] += if current.y < -0.1 { speed } else { 0 };
                moved
            });
            let fault = bench.report().fault;
            assert_eq!(fault, Some(Fault::JogRanAway), "{axis} {speed}");
            let counts = bench.sense.counts[axis].unsigned_abs() as f32;
            let rotation = counts / RECORD.counts_per_radian()[axis];
            assert!(
                rotation < MAX_JOG_ROTATION_RAD * 1.1,
                "{axis} {speed}: {rotation} rad"
            );
        }
    }
}

/// Safety: 16.
#[test]
fn stationary_encoder_is_detected_at_half_the_current() {
    for motion in [
        |_| [0; 3],
        |current: Vec3| {
            // One dead channel: a count up and down. Then another joint moves.
            [i32::from(current.y < -0.1 && current.y > -0.11), 0, 0]
        },
    ] {
        let mut storage = TileArena::<1>::new();
        let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
        bench.jog(JOG, 4_000, motion);
        assert_eq!(bench.report().fault, Some(Fault::NoMotion));
        let max = bench.drives.iter().map(|drive| -drive.currents_a.y);
        assert!(max.fold(0.0, f32::max) < 0.152);
    }
}

/// Safety: 16.
#[test]
fn out_of_range_jog_is_invalid_and_stays_bounded() {
    for (axis, current_a, hold_ms) in [
        (1, 5.0, 500),
        (1, f32::INFINITY, 500),
        (3, 0.3, 500),
        (255, -0.3, 500),
        (1, 0.3, u16::MAX),
        (1, f32::NAN, 500),
    ] {
        let jog = Jog {
            axis,
            current_a,
            hold_ms,
        };
        assert!(!jog.is_valid(&RECORD), "{jog:?}");
        let mut storage = TileArena::<1>::new();
        let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
        bench.jog(jog, 10_000, |current| held_joint(-current));
        let max = bench
            .drives
            .iter()
            .map(|d| d.currents_a.abs().max_element());
        assert!(max.fold(0.0, f32::max) <= JOG_SHARE * 1.24);
        let on = bench.drives.iter().filter(|drive| drive.enabled).count();
        assert!(on <= 2_100 + usize::from(JOG_MAX_MS) + 10, "{on}");
        let one = |drive: &GuardOutputs| drive.currents_a * Vec3::Y == drive.currents_a;
        assert!(bench.drives.iter().all(one), "{jog:?}");
    }
    assert!(JOG.is_valid(&RECORD));
}

#[test]
fn scene_zero_disarm_or_new_settings_end_a_jog() {
    let ends: [fn(&mut Bench<'_>); 4] = [
        |bench| bench.send(Command::Disarm),
        |bench| bench.send(Command::DropScene),
        |bench| bench.send(Command::Zero([0; 3])),
        |bench| {
            bench
                .haptics
                .configure(Kinematics::new(&RECORD).expect("valid"));
        },
    ];
    for end in ends {
        let mut storage = TileArena::<1>::new();
        let mut bench = Bench::new(&mut storage, TickRate::DEFAULT);
        bench.jog(JOG, 1_500, held_joint);
        assert!(bench.report().mode.is_driving());
        end(&mut bench);
        bench.drives.clear();
        (0..200).for_each(|_| _ = bench.tick(held_joint));
        assert_eq!(bench.report().mode, Mode::Disarmed);
        assert!(bench.drives[101..].iter().all(|drive| !drive.enabled));
        assert!(matches!(bench.haptics.accept(Command::Arm), Ok(None)));
        (0..100).for_each(|_| _ = bench.tick(held_joint));
        assert!(bench.report().decision.refused.contains(Blockers::NO_SCENE));
    }
}
