//! The stream of one page: pieces of a recording, each after its length.
//!
//! A length is four bytes, least significant first. Zero means that the session has ended and
//! nothing follows; [`LOST`] means that it ended because `hapterra` is gone. A stream that ends
//! without either was cut off.

use std::io::{self, Write};
use std::time::Duration;

use crate::history::{Batching, End, Next, Page};

/// Time without a piece after which the page receives a sign of life, a length that no piece has.
const SIGN_EVERY: Duration = Duration::from_secs(2);
const SIGN: u32 = u32::MAX;
/// Time for which entries are gathered, for a page that receives gathered entries.
const GATHERED: Duration = Duration::from_secs(1);
/// Length that reports the end of `hapterra` without a reason: no piece has it.
const LOST: u32 = u32::MAX - 1;

const HEAD: &str = "HTTP/1.1 200 OK\r\n\
    Content-Type: application/octet-stream\r\n\
    X-Content-Type-Options: nosniff\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Cache-Control: no-store\r\n\
    Connection: close\r\n\r\n";

/// Sends the history and all new entries to a page, until the session ends, or the page disconnects
/// or is cut off.
///
/// # Errors
/// If the page has disconnected.
pub(super) fn run(to: &mut dyn Write, page: &Page) -> io::Result<()> {
    to.write_all(HEAD.as_bytes())?;
    loop {
        if page.batching() == Batching::Joined && page.is_drained() {
            std::thread::sleep(GATHERED);
        }
        match page.next(SIGN_EVERY) {
            Next::Blob(blob) => {
                to.write_all(&(blob.len() as u32).to_le_bytes())?;
                to.write_all(&blob)?;
            }
            Next::Idle => to.write_all(&SIGN.to_le_bytes())?,
            Next::Ended(how) => {
                let code = match how {
                    End::Reported => 0,
                    End::Lost => LOST,
                };
                to.write_all(&code.to_le_bytes())?;
                return to.flush();
            }
            Next::Dropped => return to.flush(),
        }
        to.flush()?;
    }
}
