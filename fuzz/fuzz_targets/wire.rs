//! Arbitrary bytes into the frame decoder and the device's end of the link.
#![no_main]

use std::cell::RefCell;

use hapterra_tests::fuzzing::wire::Wire;

thread_local! {
    // One device for all inputs, because its memory cannot be freed. Each input begins a session
    // and a scene of its own.
    static WIRE: RefCell<Wire> = RefCell::default();
}

libfuzzer_sys::fuzz_target!(|data: &[u8]| WIRE.with_borrow_mut(|wire| wire.run(data)));
