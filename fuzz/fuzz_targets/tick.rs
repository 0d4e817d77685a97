//! Arbitrary scenes, tiles, points and encoder counts into the tick.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| hapterra_tests::fuzzing::tick::run(data));
