//! A server of buckets that speaks S3, with a key.

use std::path::Path;

use hyper_util::rt::{TokioExecutor, TokioIo};
use hyper_util::server::conn::auto::Builder;
use s3s::auth::SimpleAuth;
use s3s::service::S3ServiceBuilder;
use s3s_fs::FileSystem;
use tokio::runtime::Runtime;

/// The name and the key that the server accepts.
pub const KEY: [&str; 2] = ["hand", "terrain"];

/// A server on this machine.
pub struct Server {
    url: String,
    _runtime: Runtime,
}

impl Server {
    /// Serves the folders of a folder as buckets.
    ///
    /// # Panics
    /// When there is no port.
    #[must_use]
    pub fn of(folder: &Path) -> Self {
        let mut builder = S3ServiceBuilder::new(FileSystem::new(folder).expect("a folder"));
        builder.set_auth(SimpleAuth::from_single(KEY[0], KEY[1]));
        let service = builder.build();
        let (port, runtime) = crate::listening(async move |listener| {
            while let Ok((socket, _)) = listener.accept().await {
                let service = service.clone();
                tokio::spawn(async move {
                    let server = Builder::new(TokioExecutor::new());
                    // A client that goes away is no error of this server's.
                    let _ = server.serve_connection(TokioIo::new(socket), service).await;
                });
            }
        });
        Self {
            url: format!("http://127.0.0.1:{port}"),
            _runtime: runtime,
        }
    }

    /// Returns its place.
    #[must_use]
    pub fn endpoint(&self) -> &str {
        &self.url
    }
}
