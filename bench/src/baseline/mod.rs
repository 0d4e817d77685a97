//! The opponents, each at its best: what it needs to know between ticks it
//! remembers, and none does work that its own description does not ask for.

mod god_object;
mod paper;
mod parry;
mod proxy_graph;
mod triangle;

pub use hapterra::published::{Paper, Real, Start, newton};

pub use god_object::GodObject;
pub use parry::{Parry, Project};
pub use proxy_graph::ProxyGraph;
