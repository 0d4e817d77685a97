//! The task itself, against a host that does not read.

use core::convert::Infallible;
use core::future::{pending, poll_fn};
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use std::cell::Cell;
use std::vec::Vec;

use embedded_io_async::{ErrorType, Read, Write};
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::status::BootReport;

use super::rig::{HELLO, device, frame};
use crate::link::Link;
use crate::link::task::{LinkBoard, run};
use crate::store::Stored;

/// Bytes that a host has sent before it stopped reading.
struct Sent(Vec<u8>);

impl ErrorType for Sent {
    type Error = Infallible;
}

impl Read for Sent {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        let n = self.0.len().min(into.len());
        if n == 0 {
            return pending().await;
        }
        into[..n].copy_from_slice(&self.0[..n]);
        self.0.drain(..n);
        Ok(n)
    }
}

/// The transport to a host that does not read.
struct Stuck;

impl ErrorType for Stuck {
    type Error = Infallible;
}

impl Write for Stuck {
    async fn write(&mut self, _: &[u8]) -> Result<usize, Infallible> {
        pending().await
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Ticks that have ended and were not waited for, and polls of the link.
#[derive(Default)]
struct Board {
    ticks: Cell<u32>,
    polls: Cell<u32>,
}

impl LinkBoard for Board {
    async fn tick_done(&self) {
        poll_fn(|_| match self.ticks.get() {
            0 => Poll::Pending,
            left => {
                self.ticks.set(left - 1);
                Poll::Ready(())
            }
        })
        .await;
    }

    fn after_poll<const D: usize>(&self, _: &Link<'_, D>) {
        self.polls.set(self.polls.get() + 1);
    }
}

/// The board sets the LED after each poll.
#[test]
fn board_polls_the_link_while_the_host_does_not_read() {
    let mut device = device(Stored::Missing, BootReport::default());
    let sent = Sent(frame(&ToDevice::Hello(HELLO)));
    let board = Board::default();
    let mut running = pin!(run(&mut device.link, sent, Stuck, &board));
    let mut context = Context::from_waker(Waker::noop());
    for tick in 0..10 {
        let before = board.polls.get();
        board.ticks.set(1);
        assert!(running.as_mut().poll(&mut context).is_pending());
        assert!(board.polls.get() > before, "tick {tick}");
    }
}
