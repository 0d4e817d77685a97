//! Servers on this machine, with what goes wrong between them and a terrain.
//!
//! A package of its own: servers, and what the program needs to reach them, take minutes
//! to build, and no other test wants them.

pub mod azure;
pub mod bucket;
pub mod cog;
pub mod gcs;
pub mod http;
pub mod s3;

use std::future::Future;

use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};

/// A port of this machine's loopback, and what serves it until it is dropped.
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

/// Returns true if there is a libgdal; without one, a test that wants it reports it.
#[must_use]
pub fn has_gdal() -> bool {
    let found = heightfield::gdal();
    found.inspect_err(|why| eprintln!("skipped: {why}")).is_ok()
}
