//! The opponents, each at its best: what it needs to know between ticks it
//! remembers, and none does work that its own description does not ask for.

mod god_object;
mod line;
mod paper;
mod parry;
mod proxy_graph;
mod real;
mod triangle;

pub use god_object::GodObject;
pub use paper::{Paper, Start, newton};
pub use parry::{Parry, Project};
pub use proxy_graph::ProxyGraph;
pub use real::Real;
