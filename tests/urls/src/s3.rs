//! A server of buckets with the S3 API, with a key.

use std::path::Path;

use hyper_util::rt::{TokioExecutor, TokioIo};
use hyper_util::server::conn::auto::Builder;
use s3s::auth::SimpleAuth;
use s3s::service::S3ServiceBuilder;
use s3s_fs::FileSystem;
use tokio::runtime::Runtime;

/// The name and the key of the only user.
pub const KEY: [&str; 2] = ["hand", "terrain"];

/// A server on this machine.
pub struct Server {
    url: String,
    _runtime: Runtime,
}

impl Server {
    /// Serves the subfolders of a folder as buckets.
    ///
    /// # Panics
    /// If no port is free.
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
                    // A client that disconnects is not an error of this server.
                    let _ = server.serve_connection(TokioIo::new(socket), service).await;
                });
            }
        });
        Self {
            url: format!("http://127.0.0.1:{port}"),
            _runtime: runtime,
        }
    }

    /// Returns its address.
    #[must_use]
    pub fn endpoint(&self) -> &str {
        &self.url
    }
}
