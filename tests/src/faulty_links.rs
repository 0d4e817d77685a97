//! Links with injected faults.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::Transport;

use crate::random::Random;

/// Fault of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A bit flips.
    Flip,
    /// A run of bytes is lost.
    Drop,
    /// One transfer is duplicated.
    Twice,
}

/// A transport that injects one kind of fault, in both directions, into one transfer in `one_in`.
pub struct Faulty<T> {
    inner: T,
    fault: Fault,
    one_in: usize,
    random: Random,
    incoming: VecDeque<u8>,
    /// Number of faults injected, so that tests can check that there were some.
    pub harmed: Rc<RefCell<u32>>,
}

impl<T> Faulty<T> {
    /// Wraps a transport.
    pub fn new(inner: T, fault: Fault, one_in: usize, seed: u64) -> Self {
        Self {
            inner,
            fault,
            one_in,
            random: Random::new(seed),
            incoming: VecDeque::new(),
            harmed: Rc::default(),
        }
    }

    fn corrupt(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        if bytes.is_empty() || self.random.below(self.one_in) != 0 {
            return bytes;
        }
        *self.harmed.borrow_mut() += 1;
        let at = self.random.below(bytes.len());
        match self.fault {
            Fault::Flip => bytes[at] ^= 1 << self.random.below(8),
            Fault::Drop => {
                let end = (at + 1 + self.random.below(40)).min(bytes.len());
                bytes.drain(at..end);
            }
            Fault::Twice => bytes.extend_from_within(..),
        }
        bytes
    }
}

impl<T: Transport> Transport for Faulty<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let bytes = self.corrupt(bytes);
        self.inner.send(&bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        if self.incoming.is_empty() {
            let mut chunk = [0; 4096];
            let n = self.inner.receive(&mut chunk, wait)?;
            let corrupted = self.corrupt(&chunk[..n]);
            self.incoming.extend(corrupted);
        }
        io::Read::read(&mut self.incoming, into)
    }
}

/// A transport that outlives its session.
pub struct Shared<T>(pub Rc<RefCell<T>>);

impl<T: Transport> Transport for Shared<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.borrow_mut().send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.0.borrow_mut().receive(into, wait)
    }
}
