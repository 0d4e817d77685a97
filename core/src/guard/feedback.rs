//! Feedback of the amplifiers: their ready lines and their measured currents.

use glam::Vec3;

use super::{Fault, GuardInputs};
use crate::rate::TickRate;

/// Time after the enable within which an amplifier may be not ready, ms. An ESCON's digital inputs
/// switch within 8 ms.
const ENABLE_MS: u32 = 10;
/// Time for which a ready amplifier may report that it is not ready, ms: a spike on the wire.
const SPIKE_MS: u32 = 2;
/// Time constant of the comparison of currents, ms. With half of this value, an amplifier that
/// reads duty cycles at 1 kHz follows the fastest change of force (5.5 A in 8 ms, each current 1 ms
/// late) well within the tolerance.
const COMPARE_MS: u32 = 20;

/// Maximum difference of a measured current from its command, A, averaged over the comparison's 20
/// ms. It is a tenth of an amplifier's range: three times the error of an ESCON's reading of a duty
/// cycle. An error of 2 A is detected within 15 ms, an amplifier that drives its peak current by
/// itself within 5 ms.
pub const CURRENT_TOLERANCE_A: f32 = 0.55;

/// Maximum absolute difference of a measured current from its command, A, averaged as above. An
/// error of alternating sign, as from an amplifier whose own loop oscillates, averages to zero with
/// its sign. The limit is twice the tolerance: the fastest change of force, back and forth in every
/// tick, stays 0.69 A away with an amplifier that is 1 ms late. A sine of 1.8 A exceeds the limit.
/// A smaller one warms the motor, which the thermal model covers.
pub const CURRENT_ROUGHNESS_A: f32 = 1.1;

/// Monitor of the amplifiers' ready lines and currents, tick by tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feedback {
    /// Ticks after the enable within which an amplifier may be not ready.
    enable_ticks: u32,
    /// Ticks for which an amplifier may report that it is not ready.
    spike_ticks: u32,
    /// Weight of a tick's difference in the average.
    share: f32,
    /// Ticks since the amplifiers were switched on.
    on_ticks: u32,
    /// Ticks in a row in which an amplifier was not ready.
    unready_ticks: u32,
    /// The command of the tick before the last, A: a monitor is converted at the start of a tick
    /// and read in the next.
    before_a: Vec3,
    /// True if currents were measured in the last tick with the amplifiers off, or since.
    is_measured: bool,
    /// Absolute currents measured in this tick, A; zero without a measurement.
    measured_a: Vec3,
    /// Average of measured minus commanded, A.
    error_a: Vec3,
    /// Average of its absolute value, A.
    roughness_a: Vec3,
}

impl Feedback {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            enable_ticks: rate.ticks(ENABLE_MS),
            spike_ticks: rate.ticks(SPIKE_MS),
            share: 1.0 / rate.ticks(COMPARE_MS) as f32,
            on_ticks: 0,
            unready_ticks: 0,
            before_a: Vec3::ZERO,
            is_measured: false,
            measured_a: Vec3::ZERO,
            error_a: Vec3::ZERO,
            roughness_a: Vec3::ZERO,
        }
    }

    /// Returns true if an enabled amplifier has reported for too long that it is not ready.
    pub(super) fn is_unready(&mut self, sense: &GuardInputs) -> bool {
        self.on_ticks = self.on_ticks.saturating_add(1);
        let counts = sense.amplifier_not_ready && self.on_ticks > self.enable_ticks;
        self.unready_ticks = if counts { self.unready_ticks + 1 } else { 0 };
        self.unready_ticks > self.spike_ticks
    }

    /// Returns true if currents are measured.
    pub(super) const fn has_monitors(&self) -> bool {
        self.is_measured
    }

    /// Returns the absolute currents measured in this tick, A; zero without monitors.
    pub(super) const fn measured_a(&self) -> Vec3 {
        self.measured_a
    }

    /// Resets the times while the amplifiers are off.
    pub(super) const fn reset_off(&mut self, sense: &GuardInputs) {
        self.is_measured = sense.measured_ma.is_some();
        self.on_ticks = 0;
        self.unready_ticks = 0;
    }

    /// Compares the measured currents with the commands of the last tick, A (zero while the
    /// amplifiers are off), and returns the fault for a difference. Without monitors nothing is
    /// compared; monitors that disappear while the amplifiers are `on` are a fault of the board's
    /// wiring.
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
        let within = |error_a: Vec3, max_a| error_a.cmple(Vec3::splat(max_a)).all();
        // Written so that NaN does not agree.
        let agrees = within(self.error_a.abs(), CURRENT_TOLERANCE_A)
            && within(self.roughness_a, CURRENT_ROUGHNESS_A);
        (!agrees).then_some(Fault::CurrentMismatch)
    }
}
