//! The project itself: tables, pictures and rules that the sources must agree with.

mod pictures;
mod safety;
mod wall_clock;
