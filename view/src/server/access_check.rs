//! Check of the origin and the path of a request.
//!
//! A page of another site can make this machine's browser send requests to a server on the loopback
//! address, and can make its own name point there (DNS rebinding). So the name in `Host` must be an
//! address or `localhost`, which no such page can have, and requests with another origin are
//! refused. All requests only read.

use std::net::IpAddr;

/// The head of a request.
#[derive(Clone, Copy, Debug)]
pub struct RequestHead<'a> {
    /// The method.
    pub method: &'a str,
    /// `Host`.
    pub host: Option<&'a str>,
    /// `Origin`.
    pub origin: Option<&'a str>,
    /// `Sec-Fetch-Site`.
    pub site: Option<&'a str>,
    /// The path.
    pub path: &'a str,
}

impl RequestHead<'_> {
    /// Checks that a server on `port` may answer the request.
    ///
    /// # Errors
    /// The status of the refusal.
    pub fn check(&self, port: u16) -> Result<(), u16> {
        if !matches!(self.method, "GET" | "HEAD") {
            return Err(405);
        }
        let host = self.host.ok_or(400u16)?;
        if !is_own(host, port) {
            return Err(421);
        }
        // A link to the page may be anywhere; only the page itself requests its files.
        let is_page = self.path == "/";
        let is_foreign = match self.site {
            Some(site) => !matches!(site, "same-origin" | "none") && !is_page,
            None => false,
        };
        let from = self.origin.map(|origin| origin.strip_prefix("http://"));
        let is_elsewhere = from.is_some_and(|from| from != Some(host));
        match is_foreign || is_elsewhere {
            true => Err(403),
            false => Ok(()),
        }
    }
}

/// Returns true if `Host` is an address or `localhost`, with the server's port.
fn is_own(host: &str, port: u16) -> bool {
    let (name, host_port) = match host.rsplit_once(':') {
        Some((name, host_port)) if !host_port.ends_with(']') => (name, host_port.parse().ok()),
        _ => (host, Some(80)),
    };
    let inner = name
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'));
    let is_address = match inner {
        Some(inner) => inner.parse::<std::net::Ipv6Addr>().is_ok(),
        None => matches!(name.parse(), Ok(IpAddr::V4(_))),
    };
    host_port == Some(port) && (is_address || name.eq_ignore_ascii_case("localhost"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: RequestHead<'static> = RequestHead {
        method: "GET",
        host: Some("127.0.0.1:8760"),
        origin: None,
        site: Some("none"),
        path: "/",
    };

    #[test]
    fn page_and_its_parts_are_allowed() {
        let part = RequestHead {
            path: "/feed",
            site: Some("same-origin"),
            ..PAGE
        };
        let with_origin = RequestHead {
            origin: Some("http://127.0.0.1:8760"),
            ..part
        };
        let linked = RequestHead {
            site: Some("cross-site"),
            ..PAGE
        };
        for request_head in [PAGE, part, with_origin, linked] {
            assert_eq!(request_head.check(8760), Ok(()), "{request_head:?}");
        }
        for host in ["localhost:8760", "[::1]:8760", "192.168.7.7:8760"] {
            let request_head = RequestHead {
                host: Some(host),
                ..PAGE
            };
            assert_eq!(request_head.check(8760), Ok(()), "{host}");
        }
    }

    #[test]
    fn rebindable_host_names_are_refused() {
        for host in [
            "evil.example:8760",
            "127.0.0.1.evil.example:8760",
            "127.0.0.1:1",
            "127.0.0.1",
            "[::1]",
            "localhost.evil:8760",
            ":8760",
            "",
        ] {
            let request_head = RequestHead {
                host: Some(host),
                ..PAGE
            };
            assert_eq!(request_head.check(8760), Err(421), "{host}");
        }
        let request_head = RequestHead { host: None, ..PAGE };
        assert_eq!(request_head.check(8760), Err(400));
    }

    #[test]
    fn cross_site_reads_and_all_writes_are_refused() {
        let part = RequestHead {
            path: "/feed",
            ..PAGE
        };
        for site in ["cross-site", "same-site", "?"] {
            let request_head = RequestHead {
                site: Some(site),
                ..part
            };
            assert_eq!(request_head.check(8760), Err(403), "{site}");
        }
        for origin in ["null", "http://evil.example", "https://127.0.0.1:8760"] {
            let request_head = RequestHead {
                origin: Some(origin),
                site: None,
                ..part
            };
            assert_eq!(request_head.check(8760), Err(403), "{origin}");
        }
        for method in ["POST", "PUT", "OPTIONS", "CONNECT"] {
            let request_head = RequestHead { method, ..PAGE };
            assert_eq!(request_head.check(8760), Err(405));
        }
    }
}
