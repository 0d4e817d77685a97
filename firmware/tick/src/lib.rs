//! The haptic tick over the windows that images have, compiled for speed.
//!
//! What is generic is compiled where it is used, as that crate is. An image is
//! compiled for size (`hapterra-firmware` in the workspace's profiles): 20 KB of
//! flash less, and a tick that takes a quarter more. So the tick is here, a function
//! for each size of window that is not generic any more.
#![no_std]

use hapterra_core::contact::{Contact, Felt, Pace, Rule};
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::Sense;
use hapterra_core::terrain::Window;
use hapterra_core::tick::{Haptics, Outcome};

/// A [`Haptics`] over a window of a size that is compiled here.
pub trait FastTick {
    /// [`Haptics::tick_into`].
    fn tick_fast(&mut self, sense: &Sense, watchdog_live: bool, outcome: &mut Outcome);
}

/// A [`Window`] of a size that is compiled here.
pub trait FastStep {
    /// [`Contact::step`] in real time, for counting what it costs alone.
    fn step_fast<'c>(&self, contact: &'c mut Contact, hip: GridPoint, rule: Rule) -> &'c Felt;
}

macro_rules! compiled {
    ($($side:literal),*) => {$(
        impl FastTick for Haptics<'_, $side> {
            // Inlined, it would be compiled as its caller is.
            #[inline(never)]
            fn tick_fast(&mut self, sense: &Sense, watchdog_live: bool, outcome: &mut Outcome) {
                self.tick_into(sense, watchdog_live, outcome);
            }
        }

        impl FastStep for Window<'_, $side> {
            #[inline(never)]
            fn step_fast<'c>(
                &self,
                contact: &'c mut Contact,
                hip: GridPoint,
                rule: Rule,
            ) -> &'c Felt {
                contact.step(self, &hip, rule, Pace::RealTime)
            }
        }
    )*};
}

// The fuzzers; NUCLEO-G474RE; NUCLEO-H743ZI2; the emulated board and the desktop.
compiled!(2, 4, 8, 16);
