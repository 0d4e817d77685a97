//! The compared methods, each at its best: they keep state between ticks if it helps, and none does
//! work that its own description does not require.

mod god_object;
mod paper;
mod parry;
mod proxy_graph;
mod triangle;

pub use hapterra::published::{Paper, Real, Start, newton};

pub use god_object::GodObject;
pub use parry::{Parry, Project};
pub use proxy_graph::ProxyGraph;
