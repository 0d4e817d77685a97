//! Board.
fn main() {}
