//! The link as a task over a board's reader and writer.

use core::cell::RefCell;

use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::signal::Signal;
use embedded_io_async::{Read, Write};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::request::Refusal;

use super::Link;

/// Bytes moved at once in either direction.
const CHUNK: usize = 64;

/// Interface of the board for the link's task.
pub trait LinkBoard {
    /// Waits for the end of the next tick.
    fn tick_done(&self) -> impl Future<Output = ()>;

    /// Called after every poll, with the link's state.
    fn after_poll<const D: usize>(&self, link: &Link<'_, D>);

    /// Stores a calibration in the board's memory. The watchdog stays active, so a long operation
    /// must await instead of blocking.
    fn store(&self, _calibration: &Calibration) -> impl Future<Output = Result<(), Refusal>> {
        core::future::ready(Err(Refusal::NoMemory))
    }
}

/// Serves the link forever.
///
/// Reading and writing run concurrently, so that a host that does not read cannot block the
/// device's reading or the polling of the link. A reader that returns no bytes means that the
/// transport was interrupted, and so does a writer that fails.
pub async fn run<const D: usize>(
    link: &mut Link<'_, D>,
    mut rx: impl Read,
    mut tx: impl Write,
    board: &impl LinkBoard,
) {
    let link = RefCell::new(link);
    let work = Signal::<NoopRawMutex, ()>::new();
    let room = Signal::<NoopRawMutex, ()>::new();
    let reading = async {
        let mut chunk = [0; CHUNK];
        loop {
            let n = rx.read(&mut chunk).await.unwrap_or(0);
            let mut rest = chunk.get(..n).unwrap_or(&[]);
            if rest.is_empty() {
                link.borrow_mut().interrupted();
            }
            while !rest.is_empty() {
                let consumed = link.borrow_mut().receive(rest);
                rest = rest.get(consumed..).unwrap_or(&[]);
                work.signal(());
                if !rest.is_empty() {
                    room.wait().await;
                }
            }
        }
    };
    let writing = async {
        let mut chunk = [0; CHUNK];
        loop {
            select(board.tick_done(), work.wait()).await;
            let to_store = link.borrow().to_store();
            if let Some(calibration) = to_store {
                let result = board.store(&calibration).await;
                link.borrow_mut().stored(result);
            }
            loop {
                link.borrow_mut().poll();
                board.after_poll(&**link.borrow());
                room.signal(());
                let n = link.borrow_mut().transmit(&mut chunk);
                if n == 0 {
                    break;
                }
                let bytes = chunk.get(..n).unwrap_or(&[]);
                // A host that does not read, or has left, can block the writer for any time. The
                // link continues with the loop.
                let polling = async {
                    loop {
                        board.tick_done().await;
                        link.borrow_mut().poll();
                        board.after_poll(&**link.borrow());
                        room.signal(());
                    }
                };
                let sent = select(tx.write_all(bytes), polling).await;
                if let Either::First(Err(_)) = sent {
                    link.borrow_mut().interrupted();
                }
            }
            let _ = tx.flush().await;
            // The last byte of a session may have ended it.
            board.after_poll(&**link.borrow());
        }
    };
    join(reading, writing).await;
}
