//! Feedback of the amplifiers: whether they are ready, and which currents
//! flow.

use glam::Vec3;

use super::{Fault, GuardInputs};
use crate::rate::TickRate;

/// Time for which after the enable an amplifier need not be ready yet, ms. An ESCON's digital
/// inputs switch within 8 ms.
const ENABLE_MS: u32 = 10;
/// Time for which an amplifier that was ready may say that it is not, ms: a spike on the wire.
const SPIKE_MS: u32 = 2;
/// Time constant of the comparison of currents, ms. Twice what it takes an amplifier that
/// reads duty cycles at 1 kHz to follow the fastest change of force (5.5 A in 8 ms, each
/// current 1 ms late) without coming near the tolerance.
const COMPARE_MS: u32 = 20;

/// Largest difference of a measured current from its command, A, averaged over the comparison's
/// 20 ms. A tenth of an amplifier's range: three times what an ESCON's reading of a duty
/// cycle may be wrong. What is 2 A off is found within 15 ms, an amplifier that pushes at
/// its peak by itself within 5 ms.
pub const CURRENT_TOLERANCE_A: f32 = 0.55;

/// Largest difference of a measured current from its command without its sign, A, averaged as
/// above. An error that changes its sign, as that of an amplifier whose own loop
/// oscillates, is nothing on the average with its sign. Twice the tolerance: the fastest
/// change of force, to and fro in every tick, is 0.69 A away for an amplifier that is 1 ms
/// late, and no more. A sine of 1.8 A is above it. Less than that warms the motor, and the
/// thermal model sees that.
pub const CURRENT_ROUGHNESS_A: f32 = 1.1;

/// Follows the amplifiers' ready lines and current monitors, tick by tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feedback {
    /// Ticks after the enable in which an amplifier need not be ready.
    enable_ticks: u32,
    /// Ticks that one may say that it is not ready.
    spike_ticks: u32,
    /// Share of a difference that a tick adds to the average.
    share: f32,
    /// Ticks that the amplifiers have been on.
    on: u32,
    /// Ticks in a row that one of them was not ready.
    unready: u32,
    /// The command of the tick before the last, A: a monitor is converted at the
    /// beginning of a tick and read in the next.
    before_a: Vec3,
    /// True if currents were measured in the last tick with the amplifiers off, or since.
    is_measured: bool,
    /// Currents measured in this tick, A, without their signs; zero where nothing was measured.
    measured_a: Vec3,
    /// Measured less commanded, averaged, A.
    error_a: Vec3,
    /// The same without its sign.
    roughness_a: Vec3,
}

impl Feedback {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            enable_ticks: rate.ticks(ENABLE_MS),
            spike_ticks: rate.ticks(SPIKE_MS),
            share: 1.0 / rate.ticks(COMPARE_MS) as f32,
            on: 0,
            unready: 0,
            before_a: Vec3::ZERO,
            is_measured: false,
            measured_a: Vec3::ZERO,
            error_a: Vec3::ZERO,
            roughness_a: Vec3::ZERO,
        }
    }

    /// Returns true if an amplifier that is on says for too long that it is not ready.
    pub(super) fn is_unready(&mut self, sense: &GuardInputs) -> bool {
        self.on = self.on.saturating_add(1);
        let counts = sense.amplifier_not_ready && self.on > self.enable_ticks;
        self.unready = if counts { self.unready + 1 } else { 0 };
        self.unready > self.spike_ticks
    }

    /// Returns true if currents are measured.
    pub(super) const fn has_monitors(&self) -> bool {
        self.is_measured
    }

    /// Currents that were measured in this tick, A, without their signs. Zero where there
    /// are no monitors.
    pub(super) const fn measured_a(&self) -> Vec3 {
        self.measured_a
    }

    /// The amplifiers are off.
    pub(super) const fn rest(&mut self, sense: &GuardInputs) {
        self.is_measured = sense.measured_ma.is_some();
        self.on = 0;
        self.unready = 0;
    }

    /// Takes the commands of the last tick, A (zero while the amplifiers are off), and
    /// returns the fault that a measured current is not what was commanded. Without monitors
    /// there is nothing to compare; monitors that are there no more, while the amplifiers are
    /// `on`, are a fault of the board's wiring.
    pub(super) fn check(
        &mut self,
        sense: &GuardInputs,
        commanded_a: Vec3,
        on: bool,
    ) -> Option<Fault> {
        let Some([a, b, c]) = sense.measured_ma else {
            self.measured_a = Vec3::ZERO;
            return (on && self.is_measured).then_some(Fault::Hardware);
        };
        self.is_measured = true;
        let before_a = core::mem::replace(&mut self.before_a, commanded_a);
        let measured_a = Vec3::new(f32::from(a), f32::from(b), f32::from(c)) * 1e-3;
        self.measured_a = measured_a.abs();
        let error_a = measured_a - before_a;
        self.error_a += (error_a - self.error_a) * self.share;
        self.roughness_a += (error_a.abs() - self.roughness_a) * self.share;
        let within = |error_a: Vec3, most_a| error_a.cmple(Vec3::splat(most_a)).all();
        // Written so that what is not a number disagrees.
        let agrees = within(self.error_a.abs(), CURRENT_TOLERANCE_A)
            && within(self.roughness_a, CURRENT_ROUGHNESS_A);
        (!agrees).then_some(Fault::CurrentMismatch)
    }
}
