//! The files of the page.

use anyhow::{Context as _, Result};
use re_web_viewer_server::WebViewerData;

/// Sources from which a page may load: only this server. Without this policy, rerun's viewer sends
/// requests to other machines, for fonts and to count its users.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; \
    connect-src 'self'; worker-src 'self' blob:; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";

/// A file.
pub(super) struct File {
    path: &'static str,
    kind: &'static str,
    pub(super) bytes: Vec<u8>,
}

/// All of them.
pub(super) struct Files(Vec<File>);

impl Files {
    /// Loads the files. `page_bytes` is the memory at which a page reloads.
    pub(super) fn load(page_bytes: u64) -> Result<Self> {
        let viewer = WebViewerData::load(None).context("rerun's viewer is not in this program")?;
        let page = include_str!("../../page/index.html");
        let page = page.replace("PAGE_BYTES", &page_bytes.to_string());
        let file = |path, kind, bytes: &[u8]| File {
            path,
            kind,
            bytes: bytes.to_vec(),
        };
        let (text, script) = ("text/html; charset=utf-8", "text/javascript");
        let own = include_bytes!("../../page/page.js");
        Ok(Self(vec![
            file("/", text, page.as_bytes()),
            file("/page.js", script, own),
            file("/re_viewer.js", script, viewer.viewer_js()),
            file(
                "/re_viewer_bg.wasm",
                "application/wasm",
                viewer.viewer_wasm(),
            ),
            file("/favicon.ico", "image/x-icon", viewer.favicon()),
        ]))
    }

    pub(super) fn named(&self, path: &str) -> Option<&File> {
        self.0.iter().find(|file| file.path == path)
    }
}

impl File {
    pub(super) fn headers(&self) -> [(&'static str, String); 7] {
        [
            ("Content-Type", self.kind.into()),
            ("Content-Security-Policy", POLICY.into()),
            ("X-Content-Type-Options", "nosniff".into()),
            ("Referrer-Policy", "no-referrer".into()),
            ("Cross-Origin-Resource-Policy", "same-origin".into()),
            ("Cross-Origin-Opener-Policy", "same-origin".into()),
            // Another version of this program may later use the same port.
            ("Cache-Control", "no-cache".into()),
        ]
    }
}
