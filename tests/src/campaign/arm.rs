//! A virtual Phantom in a hand that wanders over the terrain, pressing and
//! lifting.

use std::f64::consts::TAU;

use hapterra::phantom::{AmplifierFault, ArmFrame, HandModel, PhantomModel, Plant, kinematics};
use hapterra::terrain::Terrain;

use crate::random::Random;

/// Range of the hand around the home pose, east and north, mm.
const MAX_OFFSET_MM: [f64; 2] = [55.0, 30.0];
/// Vertical speed of the hand except during a yank, mm/s.
const UP_AND_DOWN_MM_S: f64 = 100.0;
/// Height above the terrain while the arm is being armed, mm.
const LIFTED_MM: f64 = 14.0;
/// Physiological tremor: amplitude, mm, and frequency of each axis, Hz.
const TREMOR_MM: f64 = 0.4;
const TREMOR_HZ: [f64; 3] = [8.3, 9.7, 11.2];
/// Length of a tick, s.
const TICK_S: f64 = 1e-3;

/// Behaviour of the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandMotion {
    /// Held off the terrain.
    Lifted,
    /// Wanders in and out of contact.
    Wander,
    /// Presses as hard as it can.
    Press,
    /// Is pulled away by this much, mm.
    Yank([f64; 3]),
}

/// The arm and its hand.
pub struct Arm<'t> {
    terrain: &'t Terrain<'t>,
    plant: Plant,
    placement: ArmFrame,
    /// Frequency (Hz) and phase of the waves that make the path: two east, two north, two up.
    waves: [(f64, f64); 6],
    t_s: f64,
    above_mm: f64,
    ground_mm: f64,
    target_mm: [f64; 3],
}

impl<'t> Arm<'t> {
    /// Creates an arm with its home pose over the middle of a terrain.
    ///
    /// # Panics
    /// If the terrain has no data in its middle or is out of reach.
    pub fn new(terrain: &'t Terrain<'t>, random: &mut Random) -> Self {
        let [east, north] = terrain.size_mm().map(|side| 0.5 * side);
        let ground_mm = terrain
            .height_mm(east, north)
            .expect("no hole in the middle");
        let placement = ArmFrame {
            home_mm: [east, north, ground_mm],
        };
        let model = PhantomModel::premium_1_5();
        let start = [east, north, ground_mm + LIFTED_MM];
        let q = kinematics::inverse(&model, placement.to_device_m(&model, start));
        let wave = |random: &mut Random| (random.between(0.05, 0.45), random.between(0.0, TAU));
        Self {
            terrain,
            plant: Plant::new(model, q.expect("within reach")).with_hand(HandModel::default()),
            placement,
            waves: std::array::from_fn(|_| wave(random)),
            t_s: 0.0,
            above_mm: LIFTED_MM,
            ground_mm,
            target_mm: start,
        }
    }

    /// Returns the terrain point at the home pose, mm.
    #[must_use]
    pub fn home_mm(&self) -> [f64; 3] {
        self.placement.home_mm
    }

    /// Returns the encoders' counts.
    #[must_use]
    pub fn counts(&self) -> [i32; 3] {
        self.plant.counts()
    }

    /// Breaks the amplifier of one axis, or repairs all with `None`.
    pub fn break_amplifier(&mut self, broken: Option<(usize, AmplifierFault)>) {
        for axis in 0..3 {
            let fault = broken.filter(|(at, _)| *at == axis).map(|(_, fault)| fault);
            self.plant.set_amplifier_fault(axis, fault);
        }
    }

    /// Returns the plant.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Advances the arm by one tick under these motor currents.
    pub fn step(&mut self, currents_a: [f64; 3], hand_motion: HandMotion) {
        let before = self.target_mm;
        self.t_s += TICK_S;
        self.target_mm = self.target(hand_motion);
        let speed = std::array::from_fn(|i| 1e-3 * (self.target_mm[i] - before[i]) / TICK_S);
        let at = self.placement.to_device_m(self.plant.model(), before);
        self.plant.set_target(at, ArmFrame::turn_to_device(speed));
        self.plant.step(currents_a, TICK_S);
    }

    fn target(&mut self, hand_motion: HandMotion) -> [f64; 3] {
        let wave = |i: usize| {
            let (turns, phase) = self.waves[i];
            libm::sin(TAU * turns * self.t_s + phase)
        };
        let [home_east, home_north, _] = self.placement.home_mm;
        let east = home_east + MAX_OFFSET_MM[0] * (0.6 * wave(0) + 0.4 * wave(1));
        let north = home_north + MAX_OFFSET_MM[1] * (0.6 * wave(2) + 0.4 * wave(3));
        let expected = match hand_motion {
            HandMotion::Lifted => LIFTED_MM,
            HandMotion::Press => -70.0,
            HandMotion::Wander | HandMotion::Yank(_) => -5.0 + 7.0 * wave(4) + 5.0 * wave(5),
        };
        let max = UP_AND_DOWN_MM_S * TICK_S;
        self.above_mm += (expected - self.above_mm).clamp(-max, max);
        // Over no-data the hand keeps its height.
        if let Some(ground) = self.terrain.height_mm(east, north) {
            self.ground_mm += (ground - self.ground_mm).clamp(-2.0 * max, 2.0 * max);
        }
        let mut target = [east, north, self.ground_mm + self.above_mm];
        for (at, turns) in target.iter_mut().zip(TREMOR_HZ) {
            *at += TREMOR_MM * libm::sin(TAU * turns * self.t_s);
        }
        if let HandMotion::Yank(by) = hand_motion {
            target.iter_mut().zip(by).for_each(|(at, by)| *at += by);
        }
        target
    }
}
