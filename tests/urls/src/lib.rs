//! Servers on this machine, with injected faults between them and a terrain.
//!
//! A separate package, because the servers and the program's code for them take minutes to build,
//! and no other test needs them.

pub mod azure;
pub mod bucket;
pub mod cog;
pub mod gcs;
pub mod http;
pub mod s3;

use std::future::Future;

use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};

/// Opens a port on this machine's loopback, and serves it until it is dropped.
pub(crate) fn listening<S: Future<Output = ()> + Send + 'static>(
    serve: impl FnOnce(TcpListener) -> S,
) -> (u16, Runtime) {
    let mut builder = Builder::new_multi_thread();
    let runtime = builder.worker_threads(2).enable_all().build();
    let runtime = runtime.expect("a thread");
    let listener = runtime.block_on(TcpListener::bind(("127.0.0.1", 0)));
    let listener = listener.expect("a port");
    let port = listener.local_addr().expect("bound").port();
    runtime.spawn(serve(listener));
    (port, runtime)
}

/// Returns true if there is a libgdal; otherwise a test that needs it prints a message.
#[must_use]
pub fn has_gdal() -> bool {
    let found = heightfield::gdal();
    found.inspect_err(|why| eprintln!("skipped: {why}")).is_ok()
}
