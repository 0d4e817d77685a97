//! The examples run to their ends; their own assertions check their results.

#[path = "../examples/closed_loop.rs"]
mod closed_loop;
#[path = "../examples/forces_along_a_path.rs"]
mod forces_along_a_path;
#[path = "../examples/serve_tiles.rs"]
mod serve_tiles;

#[test]
fn forces_along_a_path_runs() {
    forces_along_a_path::main().expect("it runs");
}

#[test]
fn closed_loop_example_runs() {
    closed_loop::main().expect("it runs");
}

#[test]
fn tiles_are_served() {
    serve_tiles::main().expect("it runs");
}
