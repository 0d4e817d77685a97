//! The virtual Phantom at the emulated board's second line: encoders and switches in, motor
//! currents out, one exchange in each tick.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hapterra_core::wire::plant::{Currents, PlantState};

use super::messages::{Inbox, send};
use super::transport::Transport;
use crate::phantom::HeldPhantom;

/// Moves the arm with the board's ticks until `stop` returns true or the board is disconnected. The
/// board's time stops until it has received a tick's counts.
///
/// # Errors
/// When the board is disconnected.
pub fn serve_plant(
    transport: &mut dyn Transport,
    arm: &mut HeldPhantom,
    stop: &dyn Fn() -> bool,
) -> io::Result<()> {
    let mut inbox = Inbox::default();
    let mut tick = 0;
    while !stop() {
        let sense = arm.guard_inputs();
        send(transport, &PlantState { tick, sense })?;
        let currents: Currents = loop {
            if let Some(currents) = inbox.next(transport, Duration::from_millis(100))? {
                break currents;
            }
            if stop() {
                return Ok(());
            }
        };
        // A failed board sends a tick number that does not match.
        if currents.tick != tick && !currents.enabled {
            return Err(io::Error::other("the board has failed"));
        }
        let tick_s = f64::from(currents.tick_ns) / 1e9;
        arm.step(currents.currents_a.map(f64::from), tick_s);
        tick = tick.wrapping_add(1);
    }
    Ok(())
}

/// Moves the arm at a board's plant line in a separate thread while `run` runs; returns the result
/// of `run`.
pub fn move_arm_while<T>(
    line: &mut (dyn Transport + Send),
    arm: &mut HeldPhantom,
    run: impl FnOnce() -> T,
) -> T {
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            // At the end the board may close the line first.
            if let Err(error) = serve_plant(line, arm, &|| done.load(Ordering::Relaxed)) {
                tracing::debug!("the plant's line ended: {error}");
            }
        });
        let result = run();
        done.store(true, Ordering::Relaxed);
        result
    })
}
