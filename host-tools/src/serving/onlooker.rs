//! Who looks on while a terrain is served.

use crate::link::{Ask, Event, Tally};

/// Is told what happens while a terrain is served, and says what is asked of the device
/// and when there is enough of it.
pub trait Onlooker {
    /// Is told what the device tells.
    fn take(&mut self, event: Event<'_>);

    /// Is told what becomes of the line, in words for the user.
    fn hear(&mut self, line: &str);

    /// What is to be asked of the device now; taken after each look at the line.
    fn asks(&mut self) -> Vec<Ask>;

    /// May show how it goes; called after each look at the line.
    fn show(&mut self, tally: &Tally);

    /// Whether it has seen enough.
    fn is_over(&self) -> bool;
}
