//! Arbitrary bytes as a packed tile, and arbitrary heights through the packed form.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| hapterra_tests::fuzzing::tile::run(data));
