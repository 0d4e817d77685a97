//! The closed loop: the whole tick, from encoder counts to motor currents, with a simulated arm
//! that a simulated hand presses onto a plane.
//!
//! ```text
//! cargo run -p hapterra-core --example closed_loop
//! ```

use hapterra_core::Vec3;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{GuardInputs, GuardOutputs, Mode};
use hapterra_core::phantom::{Calibration, CalibrationError, Kinematics};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::terrain::{FieldSize, Tile, TileArena, TileKey};
use hapterra_core::tick::{Command, Haptics};

const TICK_S: f32 = TickRate::DEFAULT.tick_s();
/// Distance of the plane below the tip's home, mm.
const ABOVE_PLANE_MM: f32 = 10.0;
const SIZE: FieldSize = FieldSize::new(64, 64);

/// An arm with a hand on it: three joints with inertia and friction.
struct Arm {
    mechanism: Kinematics,
    angles: Vec3,
    rates: Vec3,
}

impl Arm {
    /// Inertia of each joint with the hand on it, kg·m².
    const INERTIA: Vec3 = Vec3::new(0.02, 0.02, 0.015);
    /// Friction and the hand's damping, Nm·s/rad.
    const DAMPING: f32 = 0.15;
    /// Stiffness of the hand's grasp at its target, N/mm.
    const GRIP_N_PER_MM: f32 = 0.1;

    /// Returns the encoders' counts.
    fn counts(&self) -> [i32; 3] {
        self.mechanism.counts(self.angles, [0; 3])
    }

    /// Returns the tip's height over its home, mm.
    fn height_mm(&self) -> f32 {
        let pose = self.mechanism.pose(self.counts(), [0; 3]);
        pose.tip_mm().z - self.mechanism.home_mm().z
    }

    /// Advances by a tick, with these motor currents and a hand whose target is a height over the
    /// tip's home, mm.
    fn advance(&mut self, drive: &GuardOutputs, target_mm: f32) {
        let pose = self.mechanism.pose(self.counts(), [0; 3]);
        let wanted = self.mechanism.home_mm() + Vec3::Z * target_mm;
        let hand = pose.torques_nm((wanted - pose.tip_mm()) * Self::GRIP_N_PER_MM);
        let nm_per_ampere = self.mechanism.currents_a(Vec3::ONE).recip();
        let motors = drive.currents_a * nm_per_ampere;
        let weight = -self.mechanism.gravity_nm(&pose);
        let torques = motors + hand + weight - self.rates * Self::DAMPING;
        self.rates += torques / Self::INERTIA * TICK_S;
        self.angles += self.rates * TICK_S;
    }
}

pub(crate) fn main() -> Result<(), CalibrationError> {
    let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5)?;
    let mut arm = Arm {
        mechanism,
        angles: Vec3::ZERO,
        rates: Vec3::ZERO,
    };

    // The loop, in memory of this function.
    let mut storage = TileArena::<2>::new();
    let mut spare = Tile::VACANT;
    let mut haptics = Haptics::new(storage.slots(), TickRate::DEFAULT, None);
    haptics.configure(mechanism);
    let scene = Scene {
        epoch: 1,
        level: 0,
        size: SIZE,
        top: 1,
        fallback: None,
        cell_mm: 2.0,
        home: GridPoint::new([32, 32, 0], Vec3::Z * (ABOVE_PLANE_MM / 2.0)),
        params: SurfaceParams::PREMIUM,
        source: Source::Encoders,
        hold_clock: false,
        materials: None,
    };
    let _ = haptics.accept(Command::Scene(scene));
    // The whole field fits into the window, so its tiles are delivered once.
    let mut free = &mut spare;
    for index in SIZE.tiles() {
        let filled = free.fill_from(TileKey { level: 0, index }, 0, SIZE, |_, _| 0.0);
        filled.expect("base 0 is in range");
        let taken = haptics.accept(Command::Tile(free));
        free = taken.expect("taken").expect("another buffer");
    }
    let _ = haptics.accept(Command::Zero(arm.counts()));
    let _ = haptics.accept(Command::Arm);

    println!("  time  hand target    tip is    force up   arming      contact");
    let mut last = 0.0;
    for tick in 0..6_000_u16 {
        let time_s = f32::from(tick) * TICK_S;
        // Armed after the switch is pressed and the force has ramped up; then down.
        let target_mm = (-8.0 * (time_s - 2.5)).clamp(-20.0, 0.0);
        let sense = GuardInputs {
            counts: arm.counts(),
            dead_man: tick > 10,
            ..GuardInputs::default()
        };
        let outcome = haptics.tick(&sense, true);
        arm.advance(&outcome.drive, target_mm);
        let sample = outcome.sample;
        last = sample.force_n.z;
        if tick % 250 == 0 {
            println!(
                "{time_s:4.2} s {target_mm:9.2} mm {:6.2} mm {last:9.3} N   {:10} {:?}",
                arm.height_mm(),
                format!("{:?}", sample.mode),
                sample.state
            );
        }
    }
    assert_eq!(haptics.report().mode, Mode::Armed);
    // At rest the hand's spring and the surface's are in balance.
    let hand_n = Arm::GRIP_N_PER_MM * (arm.height_mm() + 20.0);
    println!("at rest: the surface pushes {last:.3} N up, the hand {hand_n:.3} N down");
    assert!(last > 0.5 && (last - hand_n).abs() < 0.05);
    Ok(())
}
