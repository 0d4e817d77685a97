//! The hardware seam: the parts of a board that the application needs.
//!
//! The link is any pair of [`embedded_io_async::Read`] and
//! [`embedded_io_async::Write`]. embedded-hal has no traits for encoders,
//! amplifiers and tick timer; they are here. [`crate::amplifier`]
//! builds amplifiers from embedded-hal's pins, duty cycles and SPI.

pub use hapterra_core::guard::GuardInputs;
use hapterra_core::rate::TickRate;

/// The encoders, the safety inputs and the amplifiers' feedback.
pub trait Encoders {
    /// Reads all inputs of the tick now. Bounded, never waits.
    fn sense(&mut self) -> GuardInputs;
}

/// Amplifiers that are off: this type has no method to command a current.
pub trait Amplifiers: Sized {
    /// The same amplifiers, on.
    type Enabled: EnabledAmplifiers<Disabled = Self>;

    /// Commands zero current, then switches the power stages on. If the outputs can be read and do
    /// not read back as they were set, the power stages stay off, and
    /// [`GuardInputs::outputs_not_as_set`] reports it in the next tick.
    fn enable(self) -> Self::Enabled;

    /// Runs a tick with the power stages off: sets the outputs to these shares of full scale, each
    /// clamped to -1..=1, and keeps the outputs ready. The enable line stays low. Zero unless the
    /// user measures the outputs ([`Guard::hold`](hapterra_core::guard::Guard::hold)).
    fn set_held_outputs(&mut self, held: [f32; 3]);
}

/// Amplifiers that are on.
pub trait EnabledAmplifiers: Sized {
    /// The same amplifiers, off.
    type Disabled: Amplifiers<Enabled = Self>;

    /// Commands the motor currents of axes 1 to 3, in amperes. The board's own range limits them;
    /// NaN commands zero.
    fn write(&mut self, currents_a: [f32; 3]);

    /// Switches the power stages off, then commands zero current.
    fn disable(self) -> Self::Disabled;
}

/// The timer of the haptic tick and the clock that measures it.
pub trait TickClock {
    /// Counts of [`Self::now`] and [`Self::since_due`] in a second.
    const HZ: u32;
    /// Counts between two ticks.
    const PERIOD: u32;
    /// The tick rate. A board whose rate core does not support does not compile.
    const RATE: TickRate = match TickRate::new(Self::HZ / Self::PERIOD) {
        Some(rate) => rate,
        None => panic!("the tick rate is 1 to 10 kHz"),
    };

    /// Returns a free-running counter that wraps around.
    fn now(&self) -> u32;

    /// Returns the counts since the current tick's timer event, at most
    /// [`Self::PERIOD`].
    fn since_due(&self) -> u32;

    /// Returns the counts since the last call, [`Self::PERIOD`] at the first. Its clock continues
    /// while a debugger halts the core. It may wrap around after 65 ms; by then the watchdog has
    /// reset a halted board.
    fn since_last_tick(&mut self) -> u32;

    /// Acknowledges the timer event of this tick.
    fn begin_tick(&mut self);

    /// Returns true if the next tick's event has already occurred: this tick has overrun.
    fn next_is_due(&self) -> bool;
}
