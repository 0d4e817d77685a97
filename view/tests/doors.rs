//! Access to the viewer, and its robustness against any page.

mod common;

use std::io::{Read, Write};
use std::net::TcpStream;

use hapterra_view_stream::{Hello, Message};

use common::scene::{batch, greeting, layer, scene};
use common::{HANG, Viewer, send_request};

/// Starts a viewer that shows the beginning of a live session; returns it and its port.
fn live(options: &str) -> (Viewer, u16) {
    let mut viewer = Viewer::start(options);
    let mut held = Vec::new();
    let messages = [greeting(), scene(true), layer()];
    for message in messages.iter().chain(&batch(0, 100, &mut held)) {
        assert!(viewer.send(message));
    }
    let port = viewer.port();
    (viewer, port)
}

fn get(port: u16, path: &str, host: &str, more: &str) -> String {
    send_request(
        port,
        &format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}Connection: close\r\n\r\n"),
    )
}

fn status(answer: &str) -> u16 {
    let status = answer.split(' ').nth(1).unwrap_or_default();
    status.parse().unwrap_or(0)
}

#[test]
fn foreign_hosts_origins_and_write_methods_are_refused() {
    let (_viewer, port) = live("");
    let own = format!("127.0.0.1:{port}");
    let page = get(port, "/", &own, "");
    assert_eq!(status(&page), 200);
    assert!(page.contains("default-src 'none'") && page.contains("frame-ancestors 'none'"));
    assert!(!page.contains("https://"), "the page names another machine");
    for path in ["/page.js", "/re_viewer.js", "/favicon.ico"] {
        assert_eq!(status(&get(port, path, &own, "")), 200, "{path}");
    }
    for path in ["/nothing", "/../Cargo.toml", "/feed/", "//feed"] {
        assert_eq!(status(&get(port, path, &own, "")), 404, "{path}");
    }
    for host in [
        "evil.example",
        &format!("evil.example:{port}"),
        "127.0.0.1:1",
    ] {
        for path in ["/", "/feed", "/page.js"] {
            assert_eq!(status(&get(port, path, host, "")), 421, "{host} {path}");
        }
    }
    for more in [
        "Origin: http://evil.example\r\n",
        "Sec-Fetch-Site: cross-site\r\n",
    ] {
        assert_eq!(status(&get(port, "/feed", &own, more)), 403, "{more}");
    }
    // The page is requested first, because its answer ends.
    for (method, path) in ["POST", "PUT", "DELETE", "OPTIONS"]
        .into_iter()
        .flat_map(|method| [(method, "/"), (method, "/feed")])
    {
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {own}\r\nContent-Length: 2\r\nConnection: close\r\n\r\nhi"
        );
        assert_eq!(
            status(&send_request(port, &request)),
            405,
            "{method} {path}"
        );
    }
}

/// Opens the stream, and reads `bytes` bytes of it.
fn reading(port: u16, bytes: usize) -> TcpStream {
    let mut line = TcpStream::connect(("127.0.0.1", port)).expect("a connection");
    line.set_read_timeout(Some(HANG)).expect("a limit");
    write!(line, "GET /feed HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").expect("it is read");
    let mut read = vec![0; bytes];
    line.read_exact(&mut read).expect("the stream");
    assert!(read.starts_with(b"HTTP/1.1 200"));
    line
}

#[test]
fn stalled_and_disconnecting_pages_do_not_block_the_viewer() {
    let (mut viewer, port) = live("");
    let mut held = Vec::new();
    // One hangs without reading; others connect and disconnect.
    let hanging = reading(port, 200);
    for round in 1..400u64 {
        if round % 50 == 0 {
            drop(reading(port, 20_000));
        }
        for message in batch(100 * round, 100 * (round + 1), &mut held) {
            assert!(viewer.send(&message), "round {round}");
        }
    }
    drop(hanging);
    // The last page receives the whole recording, and its end.
    let mut last = reading(port, 1000);
    assert!(viewer.send(&Message::End));
    let mut rest = Vec::new();
    last.read_to_end(&mut rest).expect("the stream ends");
    assert!(rest.ends_with(&[0; 4]), "its end is reported");
    assert!(rest.len() > 100_000, "{}", rest.len());
}

#[test]
fn stream_of_another_or_no_version_is_reported() {
    let mut viewer = Viewer::start("");
    let other = Message::Hello(Hello {
        version: 999,
        program: "9.9".into(),
    });
    assert!(viewer.send(&other));
    let line = viewer.line();
    assert!(
        line.contains("999") && line.contains("build both"),
        "{line}"
    );
    assert!(!viewer.end());
    let mut viewer = Viewer::start("");
    viewer.close_stream();
    assert!(
        viewer
            .line()
            .contains("hapterra starts this program itself")
    );
    assert!(!viewer.end());
}

#[test]
fn feed_end_distinguishes_session_end_from_lost_hapterra() {
    for (is_reported, last) in [(true, 0), (false, u32::MAX - 1)] {
        let (mut viewer, port) = live("");
        let mut page = reading(port, 1000);
        if is_reported {
            assert!(viewer.send(&Message::End));
        }
        viewer.close_stream();
        let mut rest = Vec::new();
        page.read_to_end(&mut rest).expect("the stream ends");
        assert!(rest.ends_with(&u32::to_le_bytes(last)), "{is_reported}");
    }
}

#[test]
fn viewer_exits_after_the_last_page_disconnects() {
    let (mut viewer, port) = live("--linger 0.2s");
    let page = reading(port, 1000);
    viewer.close_stream();
    std::thread::sleep(std::time::Duration::from_millis(100));
    drop(page);
    assert!(viewer.end());
}

#[test]
fn viewer_exits_if_hapterra_dies_before_any_page_connects() {
    let (mut viewer, _) = live("");
    // No end is sent. The viewer's own time-out is 15 s.
    viewer.close_stream();
    assert!(viewer.end());
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_under_rrd_file_is_reported_and_page_still_works() {
    let (mut viewer, port) = live("-o /dev/full --linger 0s");
    let mut held = Vec::new();
    for round in 1..100u64 {
        for message in batch(100 * round, 100 * (round + 1), &mut held) {
            assert!(viewer.send(&message), "round {round}");
        }
    }
    assert_eq!(
        status(&get(port, "/", &format!("127.0.0.1:{port}"), "")),
        200
    );
    assert!(viewer.send(&Message::End));
    let line = viewer.line();
    assert!(
        line.contains(".rrd") && line.contains("not complete"),
        "{line}"
    );
    assert!(!viewer.end());
}

#[test]
fn reachable_address_is_warned_of() {
    let viewer = Viewer::start("--bind 0.0.0.0");
    assert!(viewer.line().contains("warning: other machines"));
}
